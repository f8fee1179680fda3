"""Hold-out of a training: sessions held out, and the windows for the paper's protocol."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from models.data import splits
from models.data.load import Data
from models.data.touch_images import Touches

SHARE: Final = 1 / 6  # of sessions or users, held out
MOST: Final = 16  # sessions held out
FEW: Final = 4  # sessions: of fewer, one would be too many to do without
BLOCKS: Final = 6  # of a session, where time is what is split by; the last one is held out
# The paper's protocol is shown on so many windows drawn at random, and not learned from.
RANDOM_SHARE: Final = 0.02
RANDOM_LEAST: Final = 500
RANDOM_MOST: Final = 0.1  # share; of very few windows fewer are taken


@dataclass(frozen=True, slots=True)
class Parts:
    """Which examples are for what, by their positions.

    Attributes:
        train: To learn from.
        check: Held out.
        random: Taken from among those to learn from, as the paper does.
        words: What is held out, where that is not what the whole split says.
    """

    train: NDArray[np.int64]
    check: NDArray[np.int64]
    random: NDArray[np.int64]
    words: str = ""


@dataclass(frozen=True, slots=True)
class Split:
    """How examples are split.

    Attributes:
        words: What was held out, a sentence.
        held: Recordings of which nothing is learned, (recordings,).
        windows: Positions in `ends`.
        group: Group of each frame, for intervals, (frames,).
        sites: Touches are held out by the taxel that is nearest, not with their recordings.
    """

    words: str
    held: NDArray[np.bool_]
    windows: Parts
    group: NDArray[np.int64]
    sites: bool = False


def split(data: Data, by: str, seed: int) -> Split:
    """Hold sessions, users or the ends of sessions out.

    Args:
        data: What there is.
        by: "session", "user" or "time"; "" is sessions where there are enough, else time. "site"
            is the same for gestures, and holds out touches by where they are.
        seed: Of the windows at random.

    Raises:
        LeakError: It would leak.
        ValueError: There is no such split, or too little to split.
    """
    if by == "site":
        return replace(split(data, "", seed), sites=True)
    chosen = splits.require(by) if by else ""
    examples = data.examples
    present = np.unique(examples.session)  # a recording without a window is none
    session, user = data.session[examples.session], data.user[examples.session]
    if not chosen:
        chosen = "session" if len(np.unique(data.session[present])) >= FEW else "time"
    if chosen == "time":
        fold = splits.by_time(
            examples.ends, examples.window, examples.session, BLOCKS, gap=examples.window
        )[-1]
        held = np.zeros(len(data.rows), dtype=np.bool_)
        words = (
            f"the last of {BLOCKS} blocks of every session is held out, a window's length apart; "
            f"{FEW} sessions or more would say more about another day"
        )
    else:
        group, groups = (session, data.session) if chosen == "session" else (user, data.user)
        names = np.unique(groups[present])
        if len(names) < 2:
            raise ValueError(f"there is only one {chosen}; record another, or use --split time")
        taken = _spread(names, min(MOST, max(1, round(SHARE * len(names)))))
        tested = np.isin(group[examples.ends], taken)
        fold = splits.Fold(chosen, np.flatnonzero(~tested), np.flatnonzero(tested))
        splits.check(fold, examples.ends, examples.window)
        held = np.isin(groups, taken)
        whose = ", ".join(_name(data, held)[:4]) + (", ..." if held.sum() > 4 else "")
        words = f"{len(taken)} of {len(names)} {chosen}s held out: {whose}"
    random = _random(len(fold.train), seed)
    return Split(
        words,
        held,
        Parts(fold.train[random.train], fold.test, fold.train[random.test]),
        examples.session.astype(np.int64),
    )


def touches(split: Split, data: Data, found: Touches, seed: int) -> Parts:
    """Return the same split of images of touches, by whole touches; or by sites if it says so.

    A touch is learned from if none of its frames is in a window held out, and held out if all
    of them are. Where one side would have none, as where places were recorded in one session
    only, the last touches of each session are held out.
    """
    examples, size = data.examples, len(data.examples.label)
    count = int(found.touch.max(initial=-1)) + 1
    if split.sites:
        held, words = _sites(found, count)
        return _parts(~held, held, found, seed, words)
    tested = _covered(examples.ends[split.windows.check], examples.window, size)
    tested |= split.held[examples.session]
    frames = np.bincount(found.touch, minlength=count)
    inside = np.bincount(found.touch, tested[found.frame].astype(np.float64), minlength=count)
    learned, held, words = inside == 0, inside == frames, ""
    if not (learned.any() and held.any()):
        held = _last(examples.session[found.frame], found.touch, count)
        learned = ~held
        words = (
            f"places are known in too few sessions to hold one out: of each, the last "
            f"{1 / SHARE:.0f}th of the touches is held out"
        )
    return _parts(learned, held, found, seed, words)


def _parts(
    learned: NDArray[np.bool_], held: NDArray[np.bool_], found: Touches, seed: int, words: str
) -> Parts:
    """Return images by what becomes of their touches, (touches,)."""
    train, check = np.flatnonzero(learned[found.touch]), np.flatnonzero(held[found.touch])
    random = _random(len(train), seed)
    return Parts(train[random.train], check, train[random.test], words)


def _sites(found: Touches, count: int) -> tuple[NDArray[np.bool_], str]:
    """Return which touches are held out, being nearest to a site of those held out, (touches,).

    Raises:
        ValueError: All touches are at one site.
    """
    place = np.zeros((count, 2))
    place[found.touch] = found.place  # of its last image, where they differ
    sites, own = np.unique(np.rint(place).astype(np.int64), axis=0, return_inverse=True)
    if len(sites) < 2:
        raise ValueError(
            "all touches are at one site; record others with: controller teach --protocol locations"
        )
    taken = _spread(np.arange(len(sites)), max(1, round(SHARE * len(sites))))
    told = ", ".join(f"({x}, {y})" for x, y in sites[taken].tolist())
    return np.isin(own.reshape(-1), taken), (
        f"places: {len(taken)} of {len(sites)} sites held out, with all touches nearest to them: "
        f"{told}"
    )


def _last(session: NDArray[np.integer], touch: NDArray[np.int64], count: int) -> NDArray[np.bool_]:
    """Return which touches are among the last of their session, (touches,)."""
    held = np.zeros(count, dtype=np.bool_)
    for name in np.unique(session):
        own = np.unique(touch[session == name])
        held[own[len(own) - int(SHARE * len(own)) :]] = True
    if not held.any() and count > 1:  # a few touches of each: of all together, then
        held[count - max(1, int(SHARE * count)) :] = True
    return held


def _random(count: int, seed: int) -> splits.Fold:
    """Return the paper's protocol, on a few."""
    share = min(RANDOM_MOST, max(RANDOM_SHARE, RANDOM_LEAST / max(1, count)))
    return splits.random_windows(count, share, np.random.default_rng((seed, 2)))


def _spread(names: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return so many names, evenly spread over the order in which they were recorded."""
    places = ((np.arange(count) + 0.5) * len(names) / count).astype(np.int64)
    return np.asarray(names[places])


def _name(data: Data, held: NDArray[np.bool_]) -> list[str]:
    paths = [Path(row.path) for row, out in zip(data.rows, held, strict=True) if out]
    return [f"{path.parent.name}/{path.stem}" for path in paths]


def _covered(ends: NDArray[np.int64], window: int, size: int) -> NDArray[np.bool_]:
    """Return which frames these windows are made of, (size,)."""
    change = np.zeros(size + 1, dtype=np.int64)
    np.add.at(change, ends - window + 1, 1)
    np.add.at(change, ends + 1, -1)
    return np.asarray(np.cumsum(change[:-1]) > 0)
