"""Sessions of nothing but presses: on the taxels, as in section 4.2 of the paper, or anywhere."""

from typing import Final

import numpy as np

from controller.simulator.gesture_file import shipped
from controller.simulator.orb import OrbSimulator
from controller.simulator.session import LABELS
from controller.simulator.session_script import SessionScript
from controller.simulator.user_style import person
from models.data.examples import Source
from models.data.simulate import DataSet

RATE_HZ: Final = 10.0  # paper, section 4.1
_FAMILY: Final = 5  # of seeds, of these sessions only
_CHUNK: Final = 600  # frames simulated at once


def pressing(
    preset: str, seed: int, user: int, day: int, minutes: float, *, on_sites: bool
) -> Source:
    """Return a session of nothing but presses.

    Args:
        preset: Quality of the orb.
        seed: Of the users.
        user: From 0.
        day: Which of the user's sessions, from 0.
        minutes: Its length.
        on_sites: The taxels are pressed, and each press is labelled with the taxel that was aimed
            at; else any place, and it is labelled with where the finger truly is.
    """
    model = DataSet(preset=preset).model()
    orb, order = np.random.SeedSequence([_FAMILY, seed], spawn_key=(user, day, on_sites)).spawn(2)
    simulator = OrbSimulator(orb, RATE_HZ, model=model)
    each = simulator.steps_per_frame
    frames = round(minutes * 60 * RATE_HZ)
    hand = (_Sites if on_sites else SessionScript)(
        frames * each, RATE_HZ * each, (model.rows, model.columns, model.pitch_mm),
        person(seed, user), (0.0, 0.0), shipped(), np.random.default_rng(order),
    )  # fmt: skip
    hand.stream(("press",))
    scans = [
        simulator.advance(hand.point[at], hand.depth_mm[at], hand.radius_mm[at])
        for at in (slice(i * each, (i + _CHUNK) * each) for i in range(0, frames, _CHUNK))
    ]
    time_s = (np.arange(frames) + 1.0) / RATE_HZ
    label, _ = hand.truth(time_s.astype(np.float64), LABELS)
    place = hand.contact(each)[:, 0, :2]
    place[label != LABELS.index("press")] = np.nan
    return Source(np.concatenate(scans), label, np.rint(place) if on_sites else place)


class _Sites(SessionScript):
    """A hand that aims at the taxels, as in section 4.2."""

    def _place(self, kind: str) -> tuple[float, float]:
        x, y = super()._place(kind)
        return float(np.rint(x)), float(np.rint(y))
