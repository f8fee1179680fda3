"""Simulated users for studies: their sessions, and what may differ from one day to the next."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from controller.simulator.session import DATA
from models.data import touch_images
from models.data.examples import Examples, Source, prepare
from models.data.recipe import RECIPES
from models.data.simulate import ORB, DataSet, Given
from models.training.user_task import UserGestures
from tests.support.recordings import drifting

# What another session differs in: in all that another day of the same orb does, in drift and noise
# alone, in the hand alone, or in the orb with its drift and noise.
Change = Literal["day", "drift", "hand", "orb"]
RATE_HZ: Final = 10.0
WINDOW: Final = 10  # images: paper, section 4.1
_OTHER: Final = 77  # tag of the seeds of what is changed
_DAYS: Final = 200  # more sessions than any user has


@dataclass(frozen=True, slots=True)
class SimulatedUsers:
    """Users who make gestures."""

    preset: str  # quality of their orbs
    seed: int  # of users and sessions
    minutes: float = 3.0  # of a session
    gestures: tuple[str, ...] = ("twist_cw",)  # labels of the gestures that they make
    drifting: bool = True  # the baseline drifts; else it stays where it is
    shared: bool = True  # all of them touch one orb; else each session has an orb of its own

    def session(self, user: int, day: int, change: Change = "day") -> Source:
        """Return a session; changes other than "day" are of this session."""
        own, other = (
            np.random.SeedSequence([DATA, self.seed, *tag], spawn_key=(user, day)).spawn(5)
            for tag in ((), (_OTHER,))
        )
        orb = np.random.SeedSequence([DATA, self.seed, ORB, *([_OTHER] if change == "orb" else [])])
        seeds = [orb if self.shared else own[0], *(other if change == "hand" else own)[1:]]
        number = 1 + user * _DAYS + day + (_DAYS // 2 if change in ("drift", "orb") else 0)
        data = DataSet(self.seed, self.minutes, preset=self.preset, gestures=self.gestures)
        model = data.model()
        if not self.drifting:
            model = drifting(model, 0.0)
        played = data.played(Given(seeds), user, number if self.shared else 0, model)
        return Source(played.frames, played.label, played.touch)


def prepare_users(
    sessions: Iterable[tuple[Source, int, int]], labels: int = 1, *, tracked: bool = True
) -> UserGestures:
    """Return the gestures of sessions, each with the output for its user, and its day."""
    rows = list(sessions)
    settings = RECIPES["default" if tracked else "paper"].settings(RATE_HZ, WINDOW)
    examples = prepare((source for source, _, _ in rows), settings)
    user, day = [number for _, number, _ in rows], [number for _, _, number in rows]
    return UserGestures.of(examples, range(1, 1 + labels), user, day)


def last_block(own: UserGestures) -> tuple[UserGestures, UserGestures]:
    """Return the gestures of all blocks of time but the last of each session, and of the last."""
    late = touch_images.last_events(own.session)
    early = ~late
    edge = np.flatnonzero(late & np.roll(early, 1))  # the gesture between belongs to neither
    early[edge - 1] = False
    return own.some(early), own.some(late)


def joined(one: UserGestures, other: UserGestures) -> UserGestures:
    """Return the gestures of two groups of recordings."""
    frames, sessions = len(one.examples.images), int(one.examples.session.max()) + 1
    moved = replace(
        other.examples, ends=other.examples.ends + frames, session=other.examples.session + sessions
    )
    pairs = {
        name: (getattr(one, name), getattr(other, name)) for name in UserGestures.__slots__[1:]
    }
    shift = {"ends": frames, "event": len(one.label), "session": sessions}
    return UserGestures(
        Examples.joined([one.examples, moved]),
        **{n: np.concatenate([a, b + shift.get(n, 0)]) for n, (a, b) in pairs.items()},
    )
