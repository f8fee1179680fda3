"""The virtual orb as a sensor: a simulated membrane, read and touched like a real one."""

from collections.abc import Iterator, Sequence

import numpy as np

from controller.labelling.cues import NULL_LABEL, Cue, Phase
from controller.preprocess import Frame
from controller.protocol import Contact, Perform, Truth
from controller.sensors import Geometry, SensorError, SensorOptions
from controller.simulator.faults import Fault, FaultError
from controller.simulator.orb import NOMINAL, OrbModel
from controller.simulator.presets import PresetError, preset
from controller.simulator.virtual import VirtualOrb

RATE_HZ = 10.0  # paper, section 4.1

_FIRST_S = 3.0  # the rest image is there, and somebody has read the first line
_EVERY_S = (1.8, 3.2)  # from one performance to the next
_REACTION_S = (0.2, 0.6)  # from a cue to the hand's first movement


def create(options: SensorOptions) -> "Virtual":
    """Return the orb, hand and session of a seed.

    Raises:
        SensorError: The preset or a fault does not exist.
    """
    try:
        model = preset(options.preset)
        faults = [Fault.parse(text, model.rows, model.columns) for text in options.faults]
    except (PresetError, FaultError) as error:
        raise SensorError(str(error)) from None
    return Virtual(options.seed, options.rate_hz or RATE_HZ, model, faults)


class Virtual:
    """A `VirtualSensor`; the same seed and the same requests give the same frames."""

    virtual = True

    def __init__(
        self, seed: int, rate_hz: float, model: OrbModel = NOMINAL, faults: Sequence[Fault] = ()
    ) -> None:
        self._orb = VirtualOrb(seed, rate_hz, model=model)
        self._orb.switch(faults)
        model = self._orb.model
        self.geometry = Geometry(model.rows, model.columns, model.pitch_mm)
        self.rate_hz = rate_hz
        self.device_id = f"virtual-{seed}"

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

    def truths(self) -> list[Truth]:
        """Return the performances that have ended since the last call."""
        return self._orb.truths()

    def label(self, t_s: float) -> str:
        """Return what the orb's own hand truly does at `t_s`: a gesture, else "null"."""
        return self._orb.label(t_s)

    def close(self) -> None:
        """Nothing is held."""


def show(labels: Sequence[str], geometry: Geometry, seed: int) -> Iterator[tuple[float, Perform]]:
    """Yield (seconds, performance) without end: a hand that tries every gesture in turn.

    It is what somebody sees who starts a virtual orb without anything that touches it.
    Presses go everywhere, the gestures of the whole hand to the middle.
    """
    rng = np.random.default_rng([seed, len(labels)])
    now = _FIRST_S
    for number, label in enumerate(_shuffled(labels[1:], rng), 1):
        yield now, Perform(number, label, *_place(label, geometry, rng))
        now += float(rng.uniform(*_EVERY_S))


class Obedient:
    """A hand that does what cues ask for, a while after they do: people react."""

    def __init__(self, geometry: Geometry, seed: int) -> None:
        """Draw the reactions from `seed`."""
        self._rng = np.random.default_rng([seed, 1])
        self._geometry = geometry
        self._number = 0

    def obey(self, cue: Cue, t_s: float) -> tuple[float, Perform] | None:
        """Return when the hand does what, for a cue that changed at `t_s`; None: it rests."""
        if cue.phase is not Phase.GO or cue.paused or cue.label == NULL_LABEL:
            return None
        place = cue.place or _place(cue.label, self._geometry, self._rng)
        self._number += 1
        at_s = t_s + float(self._rng.uniform(*_REACTION_S))
        return at_s, Perform(self._number, cue.label, *place)


def _place(label: str, geometry: Geometry, rng: np.random.Generator) -> tuple[float, float]:
    """Return where a gesture is made: a press anywhere, those of the whole hand in the middle."""
    centre = np.array([geometry.columns - 1, geometry.rows - 1]) / 2.0
    spread = centre if label == "press" else np.zeros(2)
    x, y = centre + spread * rng.uniform(-0.9, 0.9, 2)
    return float(x), float(y)


def _shuffled(labels: Sequence[str], rng: np.random.Generator) -> Iterator[str]:
    """Yield the labels for ever; each as often as the others, presses three times as often."""
    deck = [label for label in labels for _ in range(3 if label == "press" else 1)]
    while deck:
        yield from rng.permutation(deck).tolist()
