"""Base classes, values and errors of packages that add a sensor, link, target or tap.

A package names a module in an entry point; the module has `create`:

    group             create                      returns
    orbtouch.sensors  create(options, rate_hz)    Sensor; the module has `Options`, too
    orbtouch.links    create(url, welcome, access)  Link
    orbtouch.targets  create(options)             Target
    orbtouch.taps     create(address)             Tap

What is listed in `__all__` keeps its names and meanings, as in `orbtouch`. Each name is imported at
its first use, so a sensor needs neither pygame nor the packages of the host.
"""

TYPE_CHECKING = False  # as of `typing`, which takes 10 ms
if TYPE_CHECKING:
    from typing import Any, Final

    from controller.links.base import Access, Link, LinkAwayError, LinkError
    from controller.recognition.images.scale import Signal
    from controller.sensors.base import Sensor, SensorOptions
    from controller.sensors.geometry import Geometry, SensorAwayError, SensorError
    from controller.shared.plugins import names
    from controller.shared.protocol.link_events import (
        Connected,
        Delivered,
        Lost,
        Missed,
        Received,
        Refused,
        Stale,
    )
    from controller.shared.protocol.messages import Command as CommandMessage
    from controller.shared.protocol.messages import ContactState, Message, Telemetry, Welcome
    from host.taps import Tap, TapError, TapUnavailableError
    from host.targets import Target, TargetOptions

__all__ = [
    "Access",
    "CommandMessage",
    "Connected",
    "ContactState",
    "Delivered",
    "Geometry",
    "Link",
    "LinkAwayError",
    "LinkError",
    "Lost",
    "Message",
    "Missed",
    "Received",
    "Refused",
    "Sensor",
    "SensorAwayError",
    "SensorError",
    "SensorOptions",
    "Signal",
    "Stale",
    "Tap",
    "TapError",
    "TapUnavailableError",
    "Target",
    "TargetOptions",
    "Telemetry",
    "Welcome",
    "names",
]

_MODULES: "Final" = {
    "controller.links.base": "Access Link LinkAwayError LinkError",
    "controller.recognition.images.scale": "Signal",
    "controller.sensors.base": "Sensor SensorOptions",
    "controller.sensors.geometry": "Geometry SensorAwayError SensorError",
    "controller.shared.plugins": "names",
    "controller.shared.protocol.link_events": "Connected Delivered Lost Missed Received Refused "
    "Stale",
    "controller.shared.protocol.messages": "CommandMessage ContactState Message Telemetry Welcome",
    "host.taps": "Tap TapError TapUnavailableError",
    "host.targets": "Target TargetOptions",
}


def __getattr__(name: str) -> "Any":
    """Import a public name."""
    from importlib import import_module

    for module, known in _MODULES.items():
        if name in known.split():
            return getattr(import_module(module), name.removesuffix("Message") or name)
    raise AttributeError(f"module 'orbtouch.plugins' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__]
