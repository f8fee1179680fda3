"""Simulated people for studies: their sessions, and what may differ from one day to the next."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np

from controller.simulator.orb import OrbModel
from controller.simulator.session import DATA, simulate
from controller.simulator.style import person
from models.dataset import Source
from models.simulate import DataSet

# What is drawn anew: everything, as on another day; the orb with its drift and noise only; what
# the hand does, how the dome lies and its mood only.
Anew = Literal["day", "orb", "hand"]
ANEW: Final[tuple[Anew, ...]] = ("day", "orb", "hand")
RATE_HZ: Final = 10.0
_OTHER: Final = 77  # tag of what is drawn anew
_INFLATION: Final = 0.05  # as in data sets


@dataclass(frozen=True, slots=True)
class Town:
    """People who make gestures.

    Attributes:
        preset: Quality of their orbs.
        seed: Who they are.
        minutes: Of a session.
        gestures: What they make.
        drifting: Rest drifts while they play; else it stays where it is.
    """

    preset: str
    seed: int
    minutes: float = 3.0
    gestures: tuple[str, ...] = ("twist_cw",)
    drifting: bool = True

    def session(self, user: int, day: int, anew: Anew = "day") -> Source:
        """Return a session; "orb" and "hand" are a day with that alone drawn anew."""
        seed = np.random.SeedSequence([DATA, self.seed], spawn_key=(user, day))
        if anew != "day":
            other = np.random.SeedSequence([DATA, self.seed, _OTHER], spawn_key=(user, day))
            seed = _Joined(seed, other, anew)
        played = simulate(
            seed,
            self.minutes,
            style=person(self.seed, user),
            rate_hz=RATE_HZ,
            model=self._model(),
            inflation=_INFLATION,
            gestures=self.gestures,
        )
        return Source(played.frames, played.label, played.touch)

    def _model(self) -> OrbModel:
        model = DataSet(preset=self.preset).model()
        if self.drifting:
            return model
        circuit = model.electronics
        still = replace(
            circuit,
            taxel_drift=(0.0, circuit.taxel_drift[1]),
            common_drift=(0.0, circuit.common_drift[1]),
        )
        return replace(model, electronics=still)


class _Joined(np.random.SeedSequence):
    """The seeds of a session, some of them another one's."""

    def __init__(
        self, own: np.random.SeedSequence, other: np.random.SeedSequence, anew: Anew
    ) -> None:
        super().__init__(own.entropy, spawn_key=own.spawn_key)
        self._parts = own.spawn(5), other.spawn(5), anew

    def spawn(self, n_children: int) -> list[Any]:  # numpy's stub wants our own class
        """Return seeds of orb, people, order, placement and button."""
        own, other, anew = self._parts
        drawn: Sequence[bool] = [(part == 0) == (anew == "orb") for part in range(n_children)]
        return [b if fresh else a for a, b, fresh in zip(own, other, drawn, strict=True)]
