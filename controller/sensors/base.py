"""Sensors, one file each, found by name: `controller.sensors.base.NAME` with `create(options)`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from controller.errors import TroubleError, UserError
from controller.protocol.messages import Contact, GroundTruth
from controller.recognition.frames import Frame

if TYPE_CHECKING:
    from controller.bundles.bundle import Bundle
    from controller.recordings.recording import Recording


REPLAY = "replay"


class SensorError(UserError, ValueError):
    """The sensor cannot be used; the message says why, in one sentence."""


class SensorAwayError(SensorError, TroubleError):
    """The sensor gives no frame now, and may again: it is worth asking for the next one."""


@dataclass(frozen=True, slots=True)
class Geometry:
    """The grid of taxels; the pitch is the distance of two."""

    rows: int
    columns: int
    pitch_mm: float


@dataclass(frozen=True, slots=True)
class SensorOptions:
    """What the command line says about the sensor; each takes what concerns it.

    Attributes:
        rate_hz: Scans per second; None: the sensor's own.
        seed: Which orb and hand are simulated.
        path: The recording to replay.
        preset: Quality of the virtual orb.
        faults: What is broken on it.
        gestures: Files of further gestures that its own hand can do.
        user: Who its hand is; "" the first one.
        day: Which of their sessions, by a name; "" the first one.
        wiring: How a real or emulated orb is wired; None: as docs/hardware.md draws it.
    """

    rate_hz: float | None = None
    seed: int = 1
    path: Path | None = None
    preset: str = "nominal"
    faults: tuple[str, ...] = ()
    gestures: tuple[Path, ...] = ()
    user: str = ""
    day: str = ""
    wiring: Path | None = None


class Sensor(Protocol):
    """Whatever frames come from."""

    @property
    def geometry(self) -> Geometry:
        """The grid of taxels."""

    @property
    def rate_hz(self) -> float:
        """Scans per second."""

    @property
    def device_id(self) -> str:
        """Serial number."""

    @property
    def virtual(self) -> bool:
        """Whether it is a `VirtualSensor`."""

    def read(self, t_s: float) -> Frame:
        """Return the scan that ends at `t_s`, (rows, columns), picofarads.

        Raises:
            SensorAwayError: There is none now.
            SensorError: There will be none any more.
        """

    def button(self, t_s: float) -> str | None:
        """Return what its label button says at `t_s`, the time of the latest scan.

        None: it has no button. "null": the button is up. A label: it is down, and says which. "":
        it is down, and what it means is said elsewhere.
        """

    def close(self) -> None:
        """Release what the sensor holds."""


@runtime_checkable
class VirtualSensor(Sensor, Protocol):
    """A simulated sensor, which a host may touch. Times never go back."""

    def touch(self, contacts: Sequence[Contact], t_s: float) -> None:
        """Place the host's fingers: all that touch from `t_s` on."""

    def perform(self, number: int, label: str, x: float, y: float, t_s: float) -> None:
        """Let its own hand do `label` at (x, y), grid units, from `t_s` on.

        Raises:
            SensorError: The hand does not know the label.
        """

    def truths(self) -> list[GroundTruth]:
        """Return the performances that have ended since the last call."""

    def label(self, t_s: float) -> str:
        """Return what its own hand truly does at `t_s`: a gesture, else "null"."""


@runtime_checkable
class RecordedSensor(Sensor, Protocol):
    """A recording, read again."""

    @property
    def source(self) -> Recording:
        """What was recorded."""

    def schedule(self) -> Iterator[tuple[int, float]]:
        """Yield (number, seconds) of every frame."""

    def refuse_misfit(self, bundle: Bundle) -> None:
        """Raise RecordingError if the bundle is for another sensor."""


_NO_SENSORS = ("base", "calibration_store")  # modules of this package


def names() -> list[str]:
    """Return the names of all sensors for --sensor: not `REPLAY`, which needs a recording."""
    files = Path(__file__).parent.iterdir()
    found = {file.stem for file in files if file.suffix == ".py" and file.name[0] != "_"}
    return sorted(found - {REPLAY, *_NO_SENSORS})


def load(name: str, options: SensorOptions) -> Sensor:
    """Return the sensor of this name, ready to be read.

    Raises:
        SensorError: There is no such sensor, or it cannot be used.
    """
    if name not in (*names(), REPLAY):
        raise SensorError(f"there is no sensor {name!r}; there are {', '.join(names())}")
    sensor: Sensor = import_module(f"{__package__}.{name}").create(options)
    return sensor
