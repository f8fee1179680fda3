"""Gather CapFingerId's text files into the one file of arrays that docs/people.md is about.

    python -m tests.benchmarks.people_gather CapFingerId/data frames.npz [--frames N]

A line is `person;hand;finger;task;-1;seconds,nanoseconds,405 counts,`. Of each person, hand, finger
and task the first N frames are taken; pauses and lines that are cut off are left out, and a count
that is missing is 0.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

ROWS, COLUMNS = 27, 15
FRAMES: Final = 700
TASKS: Final = ("DRAG", "PAUSE", "SCROLL", "TAP")
FINGERS: Final = ("index", "little", "middle", "ring", "thumb")
HANDS: Final = ("left", "right")
MISSING: Final = ("", "-")

Counts = NDArray[np.int16]  # (27, 15), above the untouched level


Line = tuple[int, int, int, int, float, Counts]  # person, hand, finger, task, seconds, counts


def parse(line: str) -> Line | None:
    """Return what a line tells; None: it is cut off, or none."""
    try:
        person, hand, finger, task, _, rest = line.strip().split(";")
        second, nano, *counts = rest.removesuffix(",").split(",")
        if len(counts) != ROWS * COLUMNS:
            return None
        values = [0 if count in MISSING else int(count) for count in counts]
        image = np.array(values, dtype=np.int16).reshape(ROWS, COLUMNS)
        what = HANDS.index(hand), FINGERS.index(finger), TASKS.index(task)
        return int(person), *what, int(second) + int(nano) * 1e-9, image
    except ValueError:
        return None


def first(lines: Iterable[str], frames: int) -> Iterator[Line]:
    """Yield the first so many frames of each person, hand, finger and task, pauses left out."""
    seen: Counter[tuple[int, int, int, int]] = Counter()
    for line in lines:
        one = parse(line)
        if one is None or TASKS[one[3]] == "PAUSE":
            continue
        seen[one[:4]] += 1
        if seen[one[:4]] <= frames:
            yield one


def main(argv: list[str] | None = None) -> int:
    """Gather all files of a folder."""
    parser = argparse.ArgumentParser(description="CapFingerId's text files into one .npz.")
    parser.add_argument("data", type=Path, help="folder of CapMatrix_*.txt")
    parser.add_argument("out", type=Path, help="file to write: frames.npz")
    parser.add_argument("--frames", type=int, default=FRAMES, help=f"of each (default: {FRAMES})")
    asked = parser.parse_args(argv)
    files = sorted(asked.data.glob("CapMatrix_*.txt"))
    if not files:
        print(f"{asked.data} has no CapMatrix_*.txt; name CapFingerId's data folder",
              file=sys.stderr)  # fmt: skip
        return 2
    found: list[Line] = []
    for path in files:
        with path.open(encoding="ascii", errors="replace") as file:
            found += first(file, asked.frames)
    person, hand, finger, task, t_s, counts = zip(*found, strict=True)
    narrow = {"subject": person, "task": task, "finger": finger, "hand": hand}
    arrays: dict[str, Any] = {
        "frames": np.stack(counts),
        "t": np.array(t_s),
        "task_names": np.array(TASKS),
        "finger_names": np.array(FINGERS),
        "hand_names": np.array(HANDS),
        **{name: np.array(column, dtype=np.int8) for name, column in narrow.items()},
    }
    np.savez_compressed(asked.out, **arrays)
    print(f"{asked.out}: {len(found)} frames of {len(files)} files")
    return 0


if __name__ == "__main__":
    sys.exit(main())
