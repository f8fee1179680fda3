"""Gestures of real people on a touch screen, classified by models that never saw these people.

    python -m tests.benchmarks.people PATH [--steps N] [--json]

PATH is the `frames.npz` of docs/people.md; it is imported, and its people are judged in five folds
by `models folds` as it is by default, nothing declared: CNN-3D, and trees on the touch's
trajectory.
"""

import sys
import tempfile
from pathlib import Path
from typing import Final

from controller.__main__ import main as controller
from models.data.recipe import FOLD_STEPS
from models.studies import cross_validation, fold_statistics
from models.studies.cross_validation import Request
from models.studies.fold_statistics import CrossValidation

from .results import Results, command_line, row, say

BESIDE: Final = Path(__file__).parents[2] / "docs" / "people"
FOLDS: Final = 5
BUDGET_MIN: Final = 15.0  # CPU minutes of all
AHEAD: Final = 14  # people of whom CNN-3D is to classify more windows than the trees


def imported(path: Path, folder: Path) -> Path:
    """Return a folder with the recordings that the arrays in a file become."""
    out = folder / "recordings"
    told = ["recordings", "import", str(path), str(BESIDE / "capfingerid.toml"), "--out", str(out)]
    if controller(told):
        raise ValueError(f"{path} cannot be imported; docs/people.md says what belongs there")
    return out


def results(found: CrossValidation) -> Results:
    """Return the figures as every benchmark gives them."""
    (ours, trees), gain = found.models, found.gain
    listed = [
        ("people_window_accuracy", ours.windows.value, "share", trees.windows.value),
        ("people_window_accuracy@trees", trees.windows.value, "share", None),
        ("people_window_gain", 100.0 * gain.windows.value, "points", 0.0),
        ("people_window_gain_low", 100.0 * gain.windows.low, "points", 0.0),
        ("people_ahead", gain.ahead, "people", AHEAD),
        ("people_stretch_accuracy", ours.stretches.value, "share", trees.stretches.value),
        ("people_stretch_accuracy@trees", trees.stretches.value, "share", None),
        ("people_cpu_minutes", found.cpu_minutes, "CPU-min", BUDGET_MIN),
    ]
    out = Results("people")
    out.rows = [
        row(name, value, unit, preset="capfingerid", goal=goal)
        for name, value, unit, goal in listed
    ]
    return out


def main(argv: list[str] | None = None) -> int:
    parser = command_line(__doc__, steps=FOLD_STEPS)
    parser.add_argument("path", type=Path, help="frames.npz of docs/people.md")
    asked = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as place_for:
        folder = Path(place_for)
        recordings = imported(asked.path, folder)
        request = Request(
            (recordings,), folder / "people.json", folds=FOLDS, steps=asked.steps,
            command="tests.benchmarks.people",
        )  # fmt: skip
        found = cross_validation.cross(request, say)
    print(fold_statistics.text(found))
    results(found).finish(asked.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
