"""Base classes, values and errors of packages that add a sensor, link, target or tap.

A package names a module in an entry point; the module has `create`:

    group             create                      returns
    orbtouch.sensors  create(options, rate_hz)    Sensor; the module has `Options`, too
    orbtouch.links    create(url, welcome, access)  Link
    orbtouch.targets  create(options)             Target
    orbtouch.taps     create(address)             Tap

What is listed in `__all__` keeps its names and meanings, as in `orbtouch`. Those of the host are
imported at their first use, so a sensor needs no pygame.
"""

from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
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


def __getattr__(name: str) -> Any:
    """Import a public name of the host."""
    from importlib import import_module

    if name not in __all__:
        raise AttributeError(f"module 'orbtouch.plugins' has no attribute {name!r}")
    return getattr(import_module("host.taps" if name.startswith("Tap") else "host.targets"), name)
