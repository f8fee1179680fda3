"""Splits that cannot leak: by session, by user, or by blocks of time with gaps between them.

Windows slide by one frame, so neighbours share nine of ten. Split at random, nearly every window
of the test set has its twin in the training set, and the score says how well a network
remembers. The paper states no split (docs/paper.md); `random_windows` shows what that is worth,
and nothing chooses it for anything else.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.int64]

SPLITS: Final = ("session", "user", "time", "site")
RANDOM: Final = ("windows", "random")  # what somebody may ask for, and is told why not


class LeakError(ValueError):
    """A test window shares frames with a training window."""


@dataclass(frozen=True, slots=True)
class Fold:
    """One way to train on some windows and test on others.

    Attributes:
        name: What is tested.
        train: Positions of the training windows in `ends`.
        test: Positions of the test windows.
    """

    name: str
    train: Index
    test: Index


def by_group(ends: Index, window: int, group: NDArray[np.integer], folds: int = 0) -> list[Fold]:
    """Test on whole groups, sessions or users, each once.

    Args:
        ends: Last frame of each window, (windows,).
        window: Frames in a window.
        group: Session or user of each frame.
        folds: How many; 0: one for each group.

    Raises:
        ValueError: There are fewer than two groups.
    """
    of = group[ends]
    names = np.unique(of)
    if len(names) < 2:
        raise ValueError("there is only one to split by; record another, or split by time")
    parts = [[name] for name in names.tolist()] if not folds else np.array_split(names, folds)
    made = []
    for part in parts:
        tested = np.isin(of, part)
        title = ", ".join(str(name) for name in part)
        made.append(_fold(title, ends, window, ~tested, tested))
    return made


def by_time(
    ends: Index, window: int, session: NDArray[np.integer], blocks: int = 5, gap: int = 0
) -> list[Fold]:
    """Cut every session into blocks of equal length, and test on each block once.

    Args:
        ends: Last frame of each window, (windows,).
        window: Frames in a window.
        session: Session of each frame.
        blocks: Of a session; 2 or more.
        gap: Frames between the last one trained on and the first one tested on.
    """
    if blocks < 2:
        raise ValueError(f"{blocks} block is no split; cut sessions into 2 or more")
    block = np.empty(len(session), dtype=np.int64)
    for name in np.unique(session):
        frames = np.flatnonzero(session == name)
        block[frames] = np.arange(len(frames)) * blocks // len(frames)
    made = []
    for tested in range(blocks):
        test_frame = block == tested
        near = _reach(test_frame, gap)  # frames too close to the test block to be learned from
        touches_test = _windows_with(near, ends, window)
        inside = ~_windows_with(~test_frame, ends, window)
        made.append(_fold(f"block {tested + 1}", ends, window, ~touches_test, inside))
    return made


def random_windows(count: int, share: float, rng: np.random.Generator) -> Fold:
    """Return the paper's protocol: windows at random. It leaks; its score is for comparison."""
    tested = np.zeros(count, dtype=np.bool_)
    tested[rng.choice(count, max(1, round(share * count)), replace=False)] = True
    return Fold("random windows", np.flatnonzero(~tested), np.flatnonzero(tested))


def require(name: str) -> str:
    """Return the name of a split that somebody asked for.

    Raises:
        LeakError: It would leak.
        ValueError: There is no such split.
    """
    if name in RANDOM:
        raise LeakError(
            "windows at random share frames between training and test, and the score would be "
            f"that of memory; split by {', '.join(SPLITS)}"
        )
    if name not in SPLITS:
        raise ValueError(f"there is no split by {name!r}; there are {', '.join(SPLITS)}")
    return name


def check(fold: Fold, ends: Index, window: int) -> None:
    """Refuse a fold that leaks.

    Raises:
        LeakError: A frame is in a training window and in a test window.
    """
    size = int(ends.max(initial=0)) + 1
    both = _covered(ends[fold.train], window, size) & _covered(ends[fold.test], window, size)
    if both.any():
        raise LeakError(
            f"the split {fold.name!r} has {int(both.sum())} frames on both sides; "
            "leave a gap of a window between them"
        )


def _fold(
    name: str, ends: Index, window: int, train: NDArray[np.bool_], test: NDArray[np.bool_]
) -> Fold:
    fold = Fold(name, np.flatnonzero(train), np.flatnonzero(test))
    check(fold, ends, window)
    return fold


def _covered(ends: Index, window: int, size: int) -> NDArray[np.bool_]:
    """Return which frames the windows are made of, (size,)."""
    change = np.zeros(size + 1, dtype=np.int64)
    np.add.at(change, ends - window + 1, 1)
    np.add.at(change, ends + 1, -1)
    return np.asarray(np.cumsum(change[:-1]) > 0)


def _windows_with(marked: NDArray[np.bool_], ends: Index, window: int) -> NDArray[np.bool_]:
    """Return which windows have a marked frame, (windows,)."""
    total = np.concatenate([[0], np.cumsum(marked)])
    return np.asarray(total[ends + 1] > total[ends - window + 1])


def _reach(marked: NDArray[np.bool_], gap: int) -> NDArray[np.bool_]:
    """Return the frames within `gap` of a marked one."""
    total = np.concatenate([[0], np.cumsum(marked)])
    index = np.arange(len(marked))
    low, high = np.maximum(index - gap, 0), np.minimum(index + gap + 1, len(marked))
    return np.asarray(total[high] > total[low])
