"""Simulated people for studies: their sessions, and what may differ from one day to the next."""

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from controller.simulator.orb import OrbModel
from controller.simulator.session import DATA, simulate
from controller.simulator.user_style import person
from models.data.examples import Source
from models.data.simulate import DataSet, Given

# What is drawn anew: drift and noise, and what the hand does, as on another day of the same orb;
# one of them alone; or another orb with its own.
Anew = Literal["day", "drift", "hand", "orb"]
RATE_HZ: Final = 10.0
_OTHER: Final = 77  # tag of what is drawn anew
_ORB: Final = 78  # tag of the orb
_DAYS: Final = 200  # more than anybody's
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
        shared: All of them touch one orb; else each session has an orb of its own.
    """

    preset: str
    seed: int
    minutes: float = 3.0
    gestures: tuple[str, ...] = ("twist_cw",)
    drifting: bool = True
    shared: bool = True

    def session(self, user: int, day: int, anew: Anew = "day") -> Source:
        """Return a session; others than "day" are this one but for what is drawn anew."""
        own, other = (
            np.random.SeedSequence([DATA, self.seed, *tag], spawn_key=(user, day)).spawn(5)
            for tag in ((), (_OTHER,))
        )
        orb = np.random.SeedSequence([DATA, self.seed, _ORB, *([_OTHER] if anew == "orb" else [])])
        seeds = [orb if self.shared else own[0], *(other if anew == "hand" else own)[1:]]
        number = 1 + user * _DAYS + day + (_DAYS // 2 if anew in ("drift", "orb") else 0)
        played = simulate(
            Given(seeds),
            self.minutes,
            style=person(self.seed, user),
            rate_hz=RATE_HZ,
            model=self._model(),
            inflation=_INFLATION,
            gestures=self.gestures,
            day=number if self.shared else 0,
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
