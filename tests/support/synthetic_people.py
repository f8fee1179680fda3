"""A data set that looks like real people's on a touch screen, and holds none of theirs.

Arrays as `docs/people.md` has them: a finger rests (tap), goes up and down (scroll) or across
(drag); each person presses as hard as they do, and lies where they like to.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROWS, COLUMNS = 9, 7
STRETCH, GAP_S, STEP_S = 26, 0.5, 0.07
TASKS = ("drag", "pause", "scroll", "tap")
DONE = (0, 2, 3)


def arrays(people: int = 4, repeats: int = 3, seed: int = 0) -> dict[str, NDArray[Any]]:
    """Return the arrays of so many people, who do each task so many times with either hand."""
    rng = np.random.default_rng(seed)
    frames, rows = [], []
    t = 1.5e9
    for person in range(people):
        strength = rng.uniform(250.0, 500.0)
        for hand in (0, 1):
            for _ in range(repeats):
                for task in DONE:
                    frames.append(_stretch(task, strength, rng))
                    times = t + STEP_S * np.arange(STRETCH)
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


def _stretch(task: int, strength: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the frames of a stretch: untouched at its ends, a finger between."""
    row, column = np.mgrid[:ROWS, :COLUMNS].astype(float)
    y, x = rng.uniform(3.0, ROWS - 4.0), rng.uniform(2.5, COLUMNS - 3.5)
    frames = rng.normal(0.0, 2.0, (STRETCH, ROWS, COLUMNS))
    way = rng.choice([-1.0, 1.0])
    for i in range(9 if task == DONE[2] else 6, STRETCH - 3):
        sway = way * 2.0 * np.sin(0.5 * (i - 6))
        at_y = y + sway * (task == DONE[1])
        at_x = x + sway * (task == DONE[0])
        square = (row - at_y) ** 2 + (column - at_x) ** 2
        frames[i] += strength * np.exp(-square / 1.6)
    return frames
