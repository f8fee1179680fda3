"""The virtual orb as a sensor: a simulated membrane, read and touched like a real one."""

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from controller.sensors.base import Sensor, SensorOptions
from controller.sensors.geometry import RATE_HZ, Geometry, SensorError
from controller.shared.protocol.messages import Perform
from controller.simulator.dome.faults import Fault, FaultError
from controller.simulator.hand.gesture import GestureError
from controller.simulator.hand.gesture_file import Repertoire, load
from controller.simulator.orb import OrbModel, PresetError, preset
from controller.simulator.virtual_orb import VirtualOrb

_FIRST_S = 3.0  # the rest image is there, and somebody has read the first line
_EVERY_S = (1.8, 3.2)  # from one performance to the next


@dataclass(frozen=True)
class Options(SensorOptions):
    """Options of a virtual orb."""

    simulated: ClassVar[bool] = True
    seed: int = 1  # which orb and hand are simulated, 32 bits
    preset: str = "nominal"  # quality of the orb
    fault: tuple[str, ...] = ()  # faults of the orb: controller/simulator/dome/faults.py
    gestures: tuple[Path, ...] = ()  # files of further gestures of its hand
    user: str = ""  # user whose hand it is; "" the first one
    day: str = ""  # name of one of their sessions; "" the first one
    quick: int = 0  # 1: the hand is as quick as in fast play, where a gesture has such a form


def create(options: Options, rate_hz: float | None = None) -> "Virtual":
    """Return the orb, hand and session of a seed, or raise SensorError."""
    return Virtual(options, rate_hz or RATE_HZ)


def knows(gestures: Sequence[Path], label: str) -> bool:
    """Return whether the orb's own hand can do a gesture; SensorError if a file holds none."""
    try:
        known = load(gestures).get(label)
    except GestureError as error:
        raise SensorError(str(error)) from None
    return known is not None and known.usual


class Virtual(VirtualOrb, Sensor):
    """A simulated orb; the same seed and the same requests give the same frames."""

    virtual = True

    def __init__(
        self, options: Options, rate_hz: float = RATE_HZ, model: OrbModel | None = None
    ) -> None:
        """Build the orb of the options, or raise SensorError; a `model` replaces the preset's."""
        if not 0 <= options.seed < 2**32:
            raise SensorError(f"the seed {options.seed} must be from 0 to {2**32 - 1}")
        try:
            model = model or preset(options.preset)
            faults = [Fault.parse(text, model.rows, model.columns) for text in options.fault]
            repertoire = load(options.gestures)
        except (PresetError, FaultError, GestureError) as error:
            raise SensorError(str(error)) from None
        user, day = (zlib.crc32(name.encode()) for name in (options.user, options.day))
        super().__init__(
            options.seed, rate_hz, model=model, repertoire=repertoire, user=user, day=day
        )
        self._faults = tuple(faults)
        self.switch(faults)
        self.geometry = Geometry(model.rows, model.columns, model.pitch_mm)
        self.seed, self.device_id = options.seed, f"virtual-{options.seed}"
        self.quick, self.preset = bool(options.quick), options.preset
        self.hardware = " ".join(["virtual orb", *options.fault])

    def inject(self, kind: str, row: int, column: int) -> None:
        """Give the orb this fault and no other, "" none; SensorError if there is no such fault."""
        grid = self.geometry.rows, self.geometry.columns
        place = {"taxel": f":{row},{column}", "row": f":{row}", "column": f":{column}"}
        kinds = Fault.kinds
        where = place.get(kinds[kind].place.removesuffix("s"), "") if kind in kinds else ""
        try:
            faults = (Fault.parse(kind + where, *grid),) if kind else ()
        except FaultError as error:
            raise SensorError(str(error)) from None
        self.switch(self._faults, on=False)
        self.switch(faults)
        self._faults = faults

    def perform(self, number: int, label: str, x: float, y: float, t_s: float) -> None:
        """Let the orb's own hand do `label` at (x, y), grid units; SensorError if it cannot."""
        try:
            super().perform(number, label, x, y, t_s)
        except ValueError as error:
            raise SensorError(str(error)) from None


def show(
    labels: Sequence[str], geometry: Geometry, seed: int, gestures: Sequence[Path] = ()
) -> Iterator[tuple[float, Perform]]:
    """Yield (seconds, performance) without end: a hand that tries every gesture in turn.

    Of the labels, "null" first, what the hand does not know is left out; the seed draws the order,
    places and pauses. Presses go everywhere, the gestures of the whole hand to the middle.
    """
    repertoire = load(gestures)
    known = [label for label in labels[1:] if label in repertoire]
    rng = np.random.default_rng([seed, len(labels)])
    now = _FIRST_S
    for number, label in enumerate(_shuffled(known, repertoire, rng), 1):
        yield now, Perform(number, label, *place(label, geometry, repertoire, rng))
        now += float(rng.uniform(*_EVERY_S))


def place(
    label: str, geometry: Geometry, repertoire: Repertoire, rng: np.random.Generator
) -> tuple[float, float]:
    """Return where a gesture is made: a press anywhere, those of the whole hand in the middle."""
    centre = np.array([geometry.columns - 1, geometry.rows - 1]) / 2.0
    spread = centre if _anywhere(label, repertoire) else np.zeros(2)
    x, y = centre + spread * rng.uniform(-0.9, 0.9, 2)
    return float(x), float(y)


def _anywhere(label: str, repertoire: Repertoire) -> bool:
    return label in repertoire and repertoire[label].place == "anywhere"


def _shuffled(
    labels: Sequence[str], repertoire: Repertoire, rng: np.random.Generator
) -> Iterator[str]:
    """Yield the labels for ever; each as often as the others, presses three times as often."""
    deck = [label for label in labels for _ in range(3 if _anywhere(label, repertoire) else 1)]
    while deck:
        yield from rng.permutation(deck).tolist()
