"""Base class of sensors, and the sensors by name: `controller.sensors.NAME` with `create`.

A module of a sensor has `Options`, a dataclass derived from `SensorOptions`, and
`create(options, rate_hz)`, which returns a `Sensor`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, get_args, get_origin, get_type_hints

from controller.recognition.images.frames import Frame
from controller.recognition.images.scale import SKIN, Signal
from controller.sensors.geometry import Geometry, SensorError
from controller.shared import plugins
from controller.shared.notices import notice
from controller.shared.protocol.messages import Contact, GroundTruth

if TYPE_CHECKING:
    import argparse

    from controller.recordings.recording import Recording
    from controller.sensors.hardware.description import Description
    from controller.sensors.hardware.driver import Driver


REPLAY = "replay"  # a sensor that needs a recording


@dataclass(frozen=True)
class SensorOptions:
    """Base class of a sensor's options: int, float, text, path, or tuple of texts or paths."""

    simulated: ClassVar[bool] = False  # whether its sensor is virtual


class Sensor:
    """A source of frames; abilities that a sensor may lack have defaults.

    Attributes:
        geometry: The grid of taxels.
        rate_hz: Scans per second.
        device_id: Serial number.
        virtual: Whether it is simulated, so that a host may touch it.
        hardware: Description for recordings, such as "orb".
        signal: Unit and sign of its readings.
        preset: Quality of a simulated sensor; "" for a real one.
        seed: Seed of a simulated sensor.
        driver: The driver of a sensor on a board, real or emulated.
        source: The recording that is read again.
        description: The description of a sensor that has one.
    """

    geometry: Geometry
    rate_hz: float
    device_id: str
    virtual: bool = False
    hardware: str = ""
    signal: Signal = SKIN
    preset: str = ""
    seed: int | None = None
    driver: Driver | None = None
    source: Recording | None = None
    description: Description | None = None

    def read(self, t_s: float) -> Frame:
        """Return the scan that ends at `t_s`, (rows, columns), in its unit; times never decrease.

        Raises SensorAwayError if there is none now, SensorError if there will be none any more.
        """
        raise NotImplementedError

    def button(self, t_s: float) -> str | None:
        """Return the button at `t_s`: None (there is none), "null" (up), "" (down), or a label."""
        return None

    def close(self) -> None:
        """Release what the sensor holds."""

    # --- virtual sensors ----------------------------------------------------------------------

    def touch(self, contacts: Sequence[Contact], t_s: float) -> None:
        """Place the host's fingers: all that touch from `t_s` on."""

    def perform(self, number: int, label: str, x: float, y: float, t_s: float) -> None:
        """Let the simulated hand do `label` at (x, y), grid units; SensorError if it cannot."""
        raise SensorError("this sensor has no simulated hand")

    def inject(self, kind: str, row: int, column: int) -> None:
        """Give the sensor this fault and no other, "" none; SensorError if it cannot have it."""
        raise SensorError(notice("only_virtual"))

    def truths(self) -> list[GroundTruth]:
        """Return the performances that have ended since the last call."""
        return []

    def label(self, t_s: float) -> str:
        """Return the true label of the simulated hand at `t_s`: a gesture, else "null"."""
        return "null"


_NO_SENSORS = ("base", "calibration_store", "geometry")  # modules of this package


def names() -> list[str]:
    """Return the names of all sensors for --sensor: not `REPLAY`, which needs a recording."""
    files = Path(__file__).parent.iterdir()
    found = {file.stem for file in files if file.suffix == ".py" and file.name[0] != "_"}
    return sorted(found - {REPLAY, *_NO_SENSORS})


def add_option(grammar: argparse.ArgumentParser, purpose: str) -> None:
    """Add --sensor, whose help begins with its purpose; it takes options of the sensor."""
    text = (
        f"{purpose}: {', '.join(names())}, with options of its own, such as "
        "virtual:seed=7,fault=dead:2,3 or lines:wiring=FILE, a description of the sensor or of "
        "what hangs on which pin: orbtouch docs sensors, orbtouch docs hardware (default: virtual)"
    )
    grammar.add_argument("--sensor", metavar="NAME[:KEY=VALUE,...]", default="virtual", help=text)


def module_of(spec: str) -> Any:
    """Return the module of NAME:KEY=VALUE,..., of this or another package, or raise SensorError."""
    name = spec.partition(":")[0]
    if name in (*names(), REPLAY):
        return import_module(f"{__package__}.{name}")
    found = plugins.find("sensors", name)
    if found is None:
        known = ", ".join((*names(), *plugins.names("sensors")))
        raise SensorError(f"there is no sensor {name!r}; there are {known}")
    return found


def options(spec: str, **given: object) -> SensorOptions:
    """Return the options in NAME:KEY=VALUE,KEY=VALUE; one that is a tuple may come repeatedly.

    `given` has values of others; what the sensor has no option for, and what is None, is left out.

    Raises:
        SensorError: There is no such sensor, or an option cannot be used.
    """
    name, kind = spec.partition(":")[0], module_of(spec).Options
    hints = {key: hint for key, hint in get_type_hints(kind).items() if key != "simulated"}
    values: dict[str, Any] = {}
    for pair in re.split(r",(?=\w+=)", spec.partition(":")[2]):
        key, _, text = pair.partition("=")
        if pair and key not in hints:
            known = ", ".join(hints) or "none"
            raise SensorError(f"--sensor {name} has no option {key!r}; it has {known}")
        if pair:
            values[key] = _converted(hints[key], text, values.get(key, ()), f"{name}:{pair}")
    left = {key: value for key, value in given.items() if key in hints and value is not None}
    made: SensorOptions = kind(**{**left, **values})
    return made


def load(spec: str, rate_hz: float | None = None, **given: object) -> Sensor:
    """Return a sensor, ready to be read, at a rate or its own; the rest is as of `options`."""
    chosen = options(spec, **given)
    sensor: Sensor = module_of(spec).create(chosen, rate_hz)
    return sensor


def _converted(hint: Any, text: str, before: tuple[Any, ...], where: str) -> Any:
    """Return an option's value of the type `hint`; that of a tuple is appended to those before."""
    kind = (get_args(hint) or (hint,))[0]
    try:
        value = kind(text)
    except ValueError:
        raise SensorError(f"--sensor {where} needs a value of the type {kind.__name__}") from None
    return (*before, value) if get_origin(hint) is tuple else value
