"""Gestures of real people on a touch screen, classified by models that never saw these people.

    python -m tests.benchmarks.people PATH [--steps N] [--choose] [--json]

PATH is the `frames.npz` of docs/people.md; it is imported, and its people are judged in five folds
by `models folds`: CNN-3D by our recipe, and trees on the touch's trajectory, on the same windows;
once more the same trees where taxels that are read wrongly are left out (`@mended`).
Nothing of it is kept.
"""

import shutil
import sys
import tempfile
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.__main__ import main as controller
from models.studies import cross_validation, fold_card
from models.studies.cross_validation import Request
from models.studies.fold_statistics import CrossValidation

from .results import Results, command_line, row, say

BESIDE: Final = Path(__file__).parents[2] / "docs" / "people"
STEPS: Final = 1600
WINDOW: Final = 10  # images: what the plain model is described with
FOLDS: Final = 5
BUDGET_MIN: Final = 60.0  # CPU minutes of all
NONE: Final = np.empty(0, dtype=np.int64)

Images = NDArray[np.float32]


def imported(path: Path, folder: Path) -> Path:
    """Return a folder with the recordings that the arrays in a file become."""
    out = folder / "recordings"
    told = ["recordings", "import", str(path), str(BESIDE / "capfingerid.toml"), "--out", str(out)]
    if controller(told):
        raise ValueError(f"{path} cannot be imported; docs/people.md says what belongs there")
    shutil.copy(BESIDE / "gestures.toml", out)
    return out


def results(found: CrossValidation) -> Results:
    """Return the figures as every benchmark gives them."""
    ours, plain, mended = found.models
    gain, over = found.gains
    listed = [
        ("people_window_accuracy", ours.windows.value, "share", plain.windows.value),
        ("people_window_accuracy@trajectory_trees", plain.windows.value, "share", None),
        ("people_window_accuracy@mended", mended.windows.value, "share", None),
        ("people_window_gain", 100.0 * gain.windows.value, "points", 0.0),
        ("people_window_gain_low", 100.0 * gain.windows.low, "points", 0.0),
        ("people_window_gain@mended", 100.0 * over.windows.value, "points", 0.0),
        ("people_stretch_accuracy", ours.stretches.value, "share", plain.stretches.value),
        ("people_stretch_accuracy@trajectory_trees", plain.stretches.value, "share", None),
        ("people_stretch_accuracy@mended", mended.stretches.value, "share", None),
        ("people_cpu_minutes", found.cpu_minutes, "CPU-min", BUDGET_MIN),
    ]
    out = Results("people")
    out.rows = [
        row(name, value, unit, preset="capfingerid", goal=goal)
        for name, value, unit, goal in listed
    ]
    return out


def main(argv: list[str] | None = None) -> int:
    """Judge, and print the report; with --json a line of JSON as well."""
    parser = command_line(__doc__, steps=STEPS, choose=False)
    parser.add_argument("path", type=Path, help="frames.npz of docs/people.md")
    asked = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        recordings = imported(asked.path, folder)
        request = Request(
            (recordings,), folder / "people.json", folds=FOLDS, steps=asked.steps, window=WINDOW,
            given=True, choose=asked.choose, sound=True, command="tests.benchmarks.people",
        )  # fmt: skip
        found = cross_validation.cross(request, say)
    print(fold_card.text(found))
    results(found).finish(asked.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
