"""Hold-out rules: by session, by user, or by blocks of time; none of them leaks.

Windows slide by one frame, so neighbours share nine of ten. Split at random, nearly every window
of the test set has its twin in the training set, and the score is that of memory. The paper states
no split (docs/paper.md); `random_windows` measures what that is worth, and nothing else uses it.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from controller.shared.aliases import Index, Mask
from models.data.load import Data

SPLITS: Final = ("session", "user", "time")
RANDOM: Final = ("windows", "random")  # refused, with the reason
SHARE: Final = 1 / 6  # of sessions, users or sites, held out
MOST: Final = 16  # sessions held out
FEW: Final = 4  # sessions: of fewer, one would be too many to do without
BLOCKS: Final = 6  # of a session, if time is split; the last one is held out
CHOICE_PARTS: Final = 3  # parts of the people, or sessions, by which a choice is judged
# The paper's protocol is measured on so many windows drawn at random, which are not learned from.
RANDOM_SHARE: Final = 0.02
RANDOM_LEAST: Final = 500
_DRAW: Final = 6  # stream of random numbers that draws users, of a training's seed
RANDOM_MOST: Final = 0.1  # share; of very few windows fewer are taken


class LeakError(ValueError):
    """A test window shares frames with a training window."""


@dataclass(frozen=True, slots=True)
class Parts:
    """The parts of a training's examples, by their positions."""

    train: Index  # to learn from
    check: Index  # held out
    random: Index  # taken from among those to learn from, as the paper does
    words: str = ""  # the rule, if it is another one than the whole split's


@dataclass(frozen=True, slots=True)
class Split:
    """Split of a training's examples."""

    words: str  # the rule, a sentence
    held: Mask  # recordings held out as a whole, (recordings,)
    windows: Parts  # positions in `ends`


# --- folds of windows -----------------------------------------------------------------------------


def last_blocks(ends: Index, window: int, session: NDArray[np.integer]) -> tuple[Mask, Mask]:
    """Return which windows train, and which test, (windows,), by the session of frames (frames,).

    The last of `BLOCKS` blocks of each session is tested on, a window after training.
    """
    last = np.zeros(len(session), dtype=np.bool_)
    for name in np.unique(session):
        frames = np.flatnonzero(session == name)
        last[frames[-(len(frames) // BLOCKS) :]] = len(frames) >= BLOCKS
    return ~_windows_near(last, ends, window, gap=window), ~_windows_near(~last, ends, window)


def random_windows(count: int, share: float, rng: np.random.Generator) -> Mask:
    """Return which windows the paper's protocol tests on, (count,): it leaks, for comparison."""
    tested = np.zeros(count, dtype=np.bool_)
    tested[rng.choice(count, max(1, round(share * count)), replace=False)] = True
    return tested


def require(name: str) -> str:
    """Return the name of a split; LeakError if it would leak, ValueError if there is none."""
    if name in RANDOM:
        raise LeakError(
            "windows at random share frames between training and test, and the score would be "
            f"that of memory; split by {', '.join(SPLITS)}"
        )
    if name not in SPLITS:
        raise ValueError(f"there is no split by {name!r}; there are {', '.join(SPLITS)}")
    return name


def check(train: Mask, test: Mask, ends: Index, window: int) -> None:
    """Raise LeakError if a frame is in a window that trains and in one that tests, (windows,)."""
    size = int(ends.max(initial=0)) + 1
    both = covered(ends[train], window, size) & covered(ends[test], window, size)
    if both.any():
        raise LeakError(
            f"a split has {int(both.sum())} frames on both sides; leave a gap of a window between "
            "them"
        )


# --- hold-out of a training -----------------------------------------------------------------------


def split_windows(data: Data, by: str, seed: int) -> Split:
    """Hold sessions, users or the ends of sessions out; "": sessions if there are enough.

    LeakError if it would leak, ValueError if there is no such split, or too little to split.
    """
    examples = data.examples
    present = np.unique(examples.session)  # recordings that have a window
    many = len(np.unique(data.session[present])) >= FEW
    chosen = require(by) if by else "session" if many else "time"
    held = np.zeros(len(data.rows), dtype=np.bool_)
    if chosen == "time":
        train, test = last_blocks(examples.ends, examples.window, examples.session)
        words = (
            f"the last of {BLOCKS} blocks of every session is held out, a window's length apart; "
            f"{FEW} sessions or more would say more about another day"
        )
    else:
        groups = data.session if chosen == "session" else data.user
        names = np.unique(groups[present])
        if len(names) < 2:
            raise ValueError(f"there is only one {chosen}; record another, or use --split time")
        taken = spread(names, min(MOST, max(1, round(SHARE * len(names)))))
        held = np.isin(groups, taken)
        test = held[examples.session[examples.ends]]
        train = ~test
        paths = [Path(row.path) for row, out in zip(data.rows, held, strict=True) if out]
        listed = ", ".join(f"{path.parent.name}/{path.stem}" for path in paths[:4])
        more = ", ..." if len(paths) > 4 else ""
        words = f"{len(taken)} of {len(names)} {chosen}s held out: {listed}{more}"
    check(train, test, examples.ends, examples.window)
    return Split(words, held, parts_of(np.flatnonzero(train), np.flatnonzero(test), seed))


def undivided(count: int, seed: int) -> Parts:
    """Return parts of so many examples, to learn from and at random; none is held out."""
    whole = np.arange(count)
    return parts_of(whole, whole[:0], seed)


def choice_folds(data: Data, train: Index) -> list[tuple[Index, Index]]:
    """Return the folds by which a choice is judged: positions to learn from, and held out.

    Each person among the training examples, (n,), is held out once; where there are fewer people
    than `CHOICE_PARTS`, each session; where there are fewer of both, there is no fold.
    """
    recording = data.examples.session[data.examples.ends[train]]
    for groups in (data.user, data.session):
        names, number = np.unique(groups[recording], return_inverse=True)
        if len(names) >= CHOICE_PARTS:
            part = number % CHOICE_PARTS
            return [(train[part != one], train[part == one]) for one in range(CHOICE_PARTS)]
    return []


# --- hold-out of recordings ----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class HoldOut:
    """Hold-out of whole users or sessions."""

    by: Literal["user", "session"] = "user"
    # number of folds, each group being held out in one of them; 0: `hold` counts
    folds: int = field(default=0, metadata={"range": (2, 1000)})
    # number of groups held out, evenly spread
    hold: int = field(default=0, metadata={"range": (1, 10_000)})

    def held(self, user: Index, session: Index, fold: int = 0) -> Mask:
        """Return which recordings are held out, (recordings,), by user and session of each.

        Folds are numbered from 0.
        """
        group = user if self.by == "user" else session
        names = np.unique(group)
        if len(names) < max(2, self.folds, self.hold + 1):
            wanted = f"{self.folds} folds" if self.folds else f"{self.hold} held out"
            raise ValueError(
                f"there are {len(names)} {self.by}s, too few for {wanted}; record more, or hold "
                "out fewer"
            )
        parts = np.array_split(names, self.folds) if self.folds else [spread(names, self.hold)]
        return np.isin(group, parts[fold])


def learned(user: Index, session: Index, held: Mask, users: int, sessions: int, seed: int) -> Mask:
    """Return which recordings are learned from, (recordings,): first sessions of drawn users.

    User and rising session are of each recording; 0 users or sessions: all. Fewer users are a
    subset of more. ValueError if there are fewer.
    """
    left = np.unique(user[~held])
    advice = "beside the held-out ones; record more, or learn from fewer"
    if users > len(left):
        raise ValueError(
            f"{users} users to learn from are wanted, and {len(left)} are left {advice}"
        )
    drawn = np.random.default_rng((seed, _DRAW)).permutation(left)[: users or len(left)]
    chosen = ~held & np.isin(user, drawn)
    for one in drawn if sessions else ():
        own = np.unique(session[chosen & (user == one)])
        if len(own) < sessions:
            wanted = f"{sessions} sessions of each user to learn from are wanted"
            raise ValueError(f"{wanted}, and of one {len(own)} are left {advice}")
        chosen &= (user != one) | np.isin(session, own[:sessions])
    return chosen


# --- parts of the rules ---------------------------------------------------------------------------


def parts_of(train: Index, test: Index, seed: int) -> Parts:
    """Return the parts of training (n,) and test examples (m,), a few of the former at random."""
    share = min(RANDOM_MOST, max(RANDOM_SHARE, RANDOM_LEAST / max(1, len(train))))
    random = random_windows(len(train), share, np.random.default_rng((seed, 2)))
    return Parts(train[~random], test, train[random])


def spread(names: Index, count: int) -> Index:
    """Return so many of the names (groups,), evenly spread over them, (count,)."""
    return np.asarray(names[((np.arange(count) + 0.5) * len(names) / count).astype(np.int64)])


def covered(ends: Index, window: int, size: int) -> Mask:
    """Return which frames the windows are made of, (size,)."""
    change = np.zeros(size + 1, dtype=np.int64)
    np.add.at(change, ends - window + 1, 1)
    np.add.at(change, ends + 1, -1)
    return np.asarray(np.cumsum(change[:-1]) > 0)


def _windows_near(marked: Mask, ends: Index, window: int, gap: int = 0) -> Mask:
    """Return which windows have a marked frame, or one within a gap of them, (windows,)."""
    total = np.concatenate([[0], np.cumsum(marked)])
    last, first = np.minimum(ends + gap, len(marked) - 1), np.maximum(ends - window + 1 - gap, 0)
    return np.asarray(total[last + 1] > total[first])
