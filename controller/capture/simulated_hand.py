"""Simulated hand of the virtual orb that follows cues, for sessions without a user."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from controller.sensors.geometry import Geometry
from controller.sensors.virtual import place
from controller.shared.cues import NULL_LABEL, Cue, Phase
from controller.shared.protocol.messages import Perform
from controller.simulator.hand.gesture_file import load

_REACTION_S: Final = (0.2, 0.6)  # from a cue to the hand's first movement


class CuedHand:
    """A simulated hand that follows cues with a reaction time."""

    def __init__(
        self,
        geometry: Geometry,
        seed: int,
        gestures: Sequence[Path] = (),
        strays: Sequence[str] = (),
    ) -> None:
        """Prepare a hand with files of gestures, besides the shipped ones.

        `strays` are its movements during cues without a gesture; none if empty.
        """
        self._rng = np.random.default_rng([seed, 1])
        self._geometry, self._repertoire = geometry, load(gestures)
        self._strays = strays
        self._number = 0

    def obey(self, cue: Cue, t_s: float) -> tuple[float, Perform] | None:
        """Return time and gesture of the hand for a cue that changed at `t_s`; None: it rests."""
        if cue.phase is not Phase.GO:
            return None
        label = cue.label
        if label == NULL_LABEL:
            if not self._strays:
                return None
            label = str(self._rng.choice(self._strays))
        at = cue.place or place(label, self._geometry, self._repertoire, self._rng)
        self._number += 1
        at_s = t_s + float(self._rng.uniform(*_REACTION_S))
        return at_s, Perform(self._number, label, *at)
