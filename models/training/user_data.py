"""Many people's gestures together: read, chosen from, joined, and cut into blocks of time."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from models.data.examples import Source, prepare
from models.data.recipe import RECIPES
from models.training.simulated_users import RATE_HZ
from models.training.user_windows import Index, Touched

WINDOW: Final = 10  # images: paper, section 4.1
BLOCKS: Final = 6  # of a session, of which the last one is left out


@dataclass(frozen=True, slots=True)
class Crowd:
    """Gestures of some sessions.

    Attributes:
        touched: Them.
        who: Output of whoever made each, 0 is a stranger, (events,).
        day: Which of their sessions, (events,).
    """

    touched: Touched
    who: Index
    day: Index

    def some(self, events: NDArray[np.bool_]) -> "Crowd":
        """Return some of them."""
        return Crowd(self.touched.some(events), self.who[events], self.day[events])


def crowd(
    sources: Iterable[tuple[Source, int, int]], labels: int = 1, *, tracked: bool = True
) -> Crowd:
    """Return the gestures of (session, output of who it is, day)."""
    rows = list(sources)
    settings = RECIPES["default" if tracked else "paper"].settings(RATE_HZ, WINDOW)
    examples = prepare((source for source, _, _ in rows), settings)
    touched = Touched.of(examples, range(1, 1 + labels))
    who = np.array([number for _, number, _ in rows], dtype=np.int64)
    day = np.array([number for _, _, number in rows], dtype=np.int64)
    return Crowd(touched, who[touched.session], day[touched.session])


def blocks(own: Crowd) -> tuple[Crowd, Crowd]:
    """Return the gestures of all blocks of time but the last, and those of the last."""
    session = own.touched.session
    late = np.zeros(len(session), dtype=np.bool_)
    for number in np.unique(session):
        events = np.flatnonzero(session == number)
        late[events[-max(1, len(events) // BLOCKS) :]] = True
    early = ~late
    edge = np.flatnonzero(late & np.roll(early, 1))  # the gesture between is nobody's
    early[edge - 1] = False
    return own.some(early), own.some(late)


def join(one: Crowd, other: Crowd) -> Crowd:
    """Return the gestures of two crowds as one."""
    a, b = one.touched, other.touched
    frames, sessions = len(a.examples.images), int(a.examples.session.max()) + 1
    examples = replace(
        a.examples,
        images=np.concatenate([a.examples.images, b.examples.images]),
        label=np.concatenate([a.examples.label, b.examples.label]),
        touch=np.concatenate([a.examples.touch, b.examples.touch]),
        ends=np.concatenate([a.examples.ends, b.examples.ends + frames]),
        session=np.concatenate([a.examples.session, b.examples.session + sessions]),
        idle=np.concatenate([a.examples.idle, b.examples.idle]),
    )
    touched = Touched(
        examples,
        np.concatenate([a.ends, b.ends + frames]),
        np.concatenate([a.event, b.event + len(a.label)]),
        np.concatenate([a.label, b.label]),
        np.concatenate([a.session, b.session + sessions]),
    )
    return Crowd(
        touched, np.concatenate([one.who, other.who]), np.concatenate([one.day, other.day])
    )
