"""A data set that looks like real people's on a touch screen, and holds none of theirs.

Arrays as `docs/people.md` has them: a finger rests (tap), goes up and down (scroll) or across
(drag); each person presses as hard as they do, and lies where they like to.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROWS, COLUMNS = 9, 7
STRETCH, GAP_S, STEP_S = 26, 0.5, 0.07
TASKS = ("drag", "pause", "scroll", "tap")
DONE = (0, 2, 3)


@dataclass(frozen=True)
class Manner:
    """A person's way to touch."""

    strength: float  # counts
    tempo: float = 1.0  # relative
    touches: int = 1  # in a stretch, all under one label
    reach: float = 2.0  # of a stroke, taxels each way
    slant: float = 0.0  # of strokes, radians
    width: float = 1.6  # of a finger, square taxels

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> "Manner":
        """Draw a person: strength within a factor of four, several touches in a label."""
        return cls(
            strength=150.0 * 4.0 ** rng.uniform(),
            tempo=rng.uniform(0.7, 1.6),
            touches=int(rng.integers(2, 5)),
            reach=rng.uniform(0.7, 2.2),
            slant=rng.uniform(-0.5, 0.5),
            width=rng.uniform(1.0, 2.5),
        )


def arrays(
    people: int = 4, repeats: int = 3, seed: int = 0, varied: bool = False
) -> dict[str, NDArray[Any]]:
    """Return the arrays of so many people, who do each task so many times with either hand.

    `varied` people differ as real ones do: see `Manner`.
    """
    rng = np.random.default_rng(seed)
    frames, rows = [], []
    t = 1.5e9
    for person in range(people):
        manner = Manner.drawn(rng) if varied else Manner(rng.uniform(250.0, 500.0))
        for hand in (0, 1):
            for _ in range(repeats):
                for task in DONE:
                    made = _stretch(task, manner, rng)
                    frames.append(made)
                    times = t + STEP_S * np.arange(len(made))
                    times[7] = times[6]  # some are read twice
                    t = float(times[-1]) + GAP_S
                    rows += [(time, person, hand, task) for time in times.tolist()]
    column = np.array(rows)
    return {
        "frames": np.concatenate(frames).astype(np.int16),
        "t": column[:, 0],
        "subject": column[:, 1].astype(np.int8),
        "hand": column[:, 2].astype(np.int8),
        "hand_names": np.array(["left", "right"]),
        "finger": np.zeros(len(column), dtype=np.int8),
        "finger_names": np.array(["thumb"]),
        "task": column[:, 3].astype(np.int8),
    }


def write(path: Path, **asked: Any) -> None:
    made: dict[str, Any] = arrays(**asked)
    np.savez_compressed(path, **made)


def _stretch(task: int, manner: Manner, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the frames of a stretch: touches by a finger, untouched before, between and after."""
    each = [_touch(task, manner, rng) for _ in range(manner.touches)]
    frames = np.concatenate(each)
    return frames + rng.normal(0.0, 2.0, frames.shape)


def _touch(task: int, manner: Manner, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the frames of one touch: untouched at its ends, a finger between."""
    row, column = np.mgrid[:ROWS, :COLUMNS].astype(float)
    y, x = rng.uniform(3.0, ROWS - 4.0), rng.uniform(2.5, COLUMNS - 3.5)
    length = round(STRETCH / manner.tempo)
    frames = np.zeros((length, ROWS, COLUMNS))
    way = rng.choice([-1.0, 1.0]) * manner.reach
    for i in range(round((9 if task == DONE[2] else 6) / manner.tempo), length - 3):
        sway = way * np.sin(0.5 * (manner.tempo * i - 6))
        along, across = sway * np.cos(manner.slant), sway * np.sin(manner.slant)
        at_y = y + along * (task == DONE[1]) + across * (task == DONE[0])
        at_x = x + along * (task == DONE[0]) - across * (task == DONE[1])
        square = (row - at_y) ** 2 + (column - at_x) ** 2
        frames[i] = manner.strength * np.exp(-square / manner.width)
    return frames
