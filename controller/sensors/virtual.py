"""The virtual orb as a sensor: a simulated membrane, read and touched like a real one."""

import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from controller.protocol.messages import Contact, GroundTruth, Perform
from controller.recognition.frames import Frame
from controller.sensors.base import Geometry, SensorError, SensorOptions
from controller.simulator.faults import Fault, FaultError
from controller.simulator.gesture_file import Repertoire, load
from controller.simulator.gesture_values import GestureError
from controller.simulator.orb import NOMINAL, OrbModel
from controller.simulator.presets import PresetError, preset
from controller.simulator.virtual_orb import VirtualOrb

RATE_HZ = 10.0  # paper, section 4.1

_FIRST_S = 3.0  # the rest image is there, and somebody has read the first line
_EVERY_S = (1.8, 3.2)  # from one performance to the next


def create(options: SensorOptions, model: OrbModel | None = None) -> "Virtual":
    """Return the orb, hand and session of a seed.

    Args:
        options: What the command line says.
        model: The orb, if it is none of the presets.

    Raises:
        SensorError: The preset or a fault does not exist, or a gesture's file holds none.
    """
    try:
        model = preset(options.preset) if model is None else model
        faults = [Fault.parse(text, model.rows, model.columns) for text in options.faults]
        repertoire = load(options.gestures)
    except (PresetError, FaultError, GestureError) as error:
        raise SensorError(str(error)) from None
    return Virtual(
        options.seed,
        options.rate_hz or RATE_HZ,
        model,
        faults,
        repertoire=repertoire,
        user=_number(options.user),
        day=_number(options.day),
    )


def knows(gestures: Sequence[Path], label: str) -> bool:
    """Return whether the orb's own hand can do a gesture.

    Args:
        gestures: Files of gestures that it can do beside those that ship.
        label: Which.

    Raises:
        SensorError: A file holds no gesture.
    """
    try:
        known = load(gestures).get(label)
    except GestureError as error:
        raise SensorError(str(error)) from None
    return known is not None and not known.distractor


def _number(name: str) -> int:
    """Return a number for a name, always the same; 0 is no name."""
    return zlib.crc32(name.encode())


class Virtual:
    """A `VirtualSensor`; the same seed and the same requests give the same frames."""

    virtual = True

    def __init__(
        self,
        seed: int,
        rate_hz: float,
        model: OrbModel = NOMINAL,
        faults: Sequence[Fault] = (),
        *,
        repertoire: Repertoire | None = None,
        user: int = 0,
        day: int = 0,
    ) -> None:
        self._orb = VirtualOrb(
            seed, rate_hz, model=model, repertoire=repertoire, user=user, day=day
        )
        self._orb.switch(faults)
        model = self._orb.model
        self.geometry = Geometry(model.rows, model.columns, model.pitch_mm)
        self.rate_hz = rate_hz
        self.device_id = f"virtual-{seed}"

    @property
    def model(self) -> OrbModel:
        """The orb's constants."""
        return self._orb.model

    @property
    def skin(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What the latest scan met: true capacitances, pF, (rows, columns); fingers over rows."""
        return self._orb.skin

    def read(self, t_s: float) -> Frame:
        """Return the scan that ends at `t_s`, (rows, columns), picofarads."""
        return self._orb.read(t_s)

    def touch(self, contacts: Sequence[Contact], t_s: float) -> None:
        """Place the host's fingers: all that touch from `t_s` on."""
        self._orb.touch(contacts, t_s)

    def perform(self, number: int, label: str, x: float, y: float, t_s: float) -> None:
        """Let the orb's own hand do `label` at (x, y), grid units, from `t_s` on.

        Raises:
            SensorError: The hand does not know the label.
        """
        try:
            self._orb.perform(number, label, x, y, t_s)
        except ValueError as error:
            raise SensorError(str(error)) from None

    def button(self, t_s: float) -> str | None:
        """Return what the label button says, which the hand's owner presses with the other one."""
        return self._orb.button(t_s)

    def truths(self) -> list[GroundTruth]:
        """Return the performances that have ended since the last call."""
        return self._orb.truths()

    def label(self, t_s: float) -> str:
        """Return what the orb's own hand truly does at `t_s`: a gesture, else "null"."""
        return self._orb.label(t_s)

    def close(self) -> None:
        """Nothing is held."""


def show(
    labels: Sequence[str], geometry: Geometry, seed: int, gestures: Sequence[Path] = ()
) -> Iterator[tuple[float, Perform]]:
    """Yield (seconds, performance) without end: a hand that tries every gesture in turn.

    It is what somebody sees who starts a virtual orb without anything that touches it.
    Presses go everywhere, the gestures of the whole hand to the middle.

    Args:
        labels: What is tried, "null" first; what the hand does not know is left out.
        geometry: Of the orb.
        seed: Of the order, the places and the pauses.
        gestures: Files of gestures that it can do beside those that ship.
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
