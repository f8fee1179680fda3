"""Gestures of real people on a touch screen, classified by models that never saw these people.

    python -m tests.benchmarks.people PATH [--steps N] [--why] [--json]

PATH is the `frames.npz` of docs/people.md; it is imported, and its people are judged in five folds
by `models folds` as it is by default, nothing declared: CNN-3D, and trees on the touch's
trajectory. `--why` adds what CNN-3D gets right of the first fold's people, after a quarter of the
steps, where it sees:

    whole       everything
    place       one round spot for each image, as strong as the touch and where its centroid was
    look        images moved to the middle of the grid
    one_image   the last image of a window only
"""

import math
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.__main__ import main as controller
from controller.shared.aliases import Images
from models.data import load, splits
from models.data.augment import Symmetry
from models.data.examples import Examples
from models.data.recipe import DEFAULT, FOLD_STEPS
from models.data.splits import Parts
from models.studies import cross_validation, fold_statistics
from models.studies.cross_validation import Request
from models.studies.fold_statistics import CrossValidation
from models.training.gesture_task import GestureTask
from models.training.loop import fit, prepare_torch

from .results import Results, command_line, row, say

BESIDE: Final = Path(__file__).parents[2] / "docs" / "people"
WINDOW: Final = 10  # images, of `--why`
FOLDS: Final = 5
BUDGET_MIN: Final = 15.0  # CPU minutes of all
AHEAD: Final = 14  # people of whom CNN-3D is to classify more windows than the trees
NONE: Final = np.empty(0, dtype=np.int64)


def imported(path: Path, folder: Path) -> Path:
    """Return a folder with the recordings that the arrays in a file become."""
    out = folder / "recordings"
    told = ["recordings", "import", str(path), str(BESIDE / "capfingerid.toml"), "--out", str(out)]
    if controller(told):
        raise ValueError(f"{path} cannot be imported; docs/people.md says what belongs there")
    return out


def place(images: Images) -> Images:
    """Return images of one round spot each, where the touch's centroid was."""
    felt, x, y = _centroid(images)
    row, column = np.mgrid[: images.shape[1], : images.shape[2]]
    square = (row - y[:, None, None]) ** 2 + (column - x[:, None, None]) ** 2
    spot = np.exp(-square / 2.0) / (2.0 * math.pi)
    return np.asarray(1.0 + spot * felt.sum(axis=(1, 2))[:, None, None], dtype=np.float32)


def look(images: Images) -> Images:
    """Return images moved so that the touch's centroid is in the middle of the grid."""
    _, x, y = _centroid(images)
    _, rows, columns = images.shape
    down, right = np.rint(rows // 2 - y).astype(int), np.rint(columns // 2 - x).astype(int)
    moved = np.ones_like(images)
    row, column = np.mgrid[:rows, :columns]
    for i in range(len(images)):
        of_row, of_column = row - down[i], column - right[i]
        inside = (of_row >= 0) & (of_row < rows) & (of_column >= 0) & (of_column < columns)
        moved[i][inside] = images[i][of_row[inside], of_column[inside]]
    return moved


def why(folder: Path, steps: int, say: Callable[[str], None]) -> dict[str, float]:
    """Return the share of the first fold's windows named rightly, by what is left to see."""
    device = prepare_torch(0)
    recipe = replace(DEFAULT, repair=False)
    data = load.read([folder], recipe, "auto", lambda _: None, window=WINDOW)
    examples = data.examples
    fold = splits.by_group(examples.ends, WINDOW, data.user[examples.session], FOLDS)[0]
    whole = replace(recipe.gesture.augmentation, dropout=0.0, electrode=0.0)
    course = replace(
        recipe.gesture, steps=steps, limits=(1, cross_validation.MOST_EPOCHS), keep_best=False,
        patience=0.0, augmentation=whole,
    )  # fmt: skip
    symmetry = Symmetry.of(data.vocabulary, *examples.images.shape[1:])
    found = {}
    seen: dict[str, Callable[[Images], Images]] = {
        "whole": lambda images: images, "place": place, "look": look,
        "one_image": lambda images: images,
    }  # fmt: skip
    for name, change in seen.items():
        torch.manual_seed(0)
        altered = replace(examples, images=change(examples.images))
        kind = _Still if name == "one_image" else GestureTask
        parts = Parts(fold.train, NONE, NONE)
        lesson = kind(altered, parts, len(data.vocabulary.labels), symmetry, course, device)
        fit(lesson, 0)
        logits, label = lesson.answers(examples.ends[fold.test])
        found[name] = float((logits.argmax(dim=1) == label).float().mean())
        say(f"{name}: {found[name]:.4f}")
    return found


class _Still(GestureTask):
    """Windows that stand still: their last image, over and over."""

    def __init__(self, examples: Examples, *rest: Any) -> None:
        super().__init__(examples, *rest)
        self._steps = torch.zeros_like(self._steps)


def results(found: CrossValidation, left: dict[str, float]) -> Results:
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
        *((f"people_seen_{name}", value, "share", None) for name, value in left.items()),
    ]
    out = Results("people")
    out.rows = [
        row(name, value, unit, preset="capfingerid", goal=goal)
        for name, value, unit, goal in listed
    ]
    return out


def main(argv: list[str] | None = None) -> int:
    parser = command_line(__doc__, steps=FOLD_STEPS, why=False)
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
        left = why(recordings, max(1, asked.steps // 4), say) if asked.why else {}
    print(fold_statistics.text(found))
    for name, value in left.items():
        print(f"of the first fold, seen {name}: {value:.3f}")
    results(found, left).finish(asked.json)
    return 0


def _centroid(images: Images) -> tuple[Images, NDArray[np.float64], NDArray[np.float64]]:
    """Return what is felt, and where on average, taxels from the upper left."""
    felt = np.maximum(images - 1.0, 0.0)
    felt[felt < 0.1 * felt.max(axis=(1, 2), keepdims=True)] = 0.0
    some = np.maximum(felt.sum(axis=(1, 2)), 1e-9)
    row, column = np.mgrid[: images.shape[1], : images.shape[2]]
    return felt, (felt * column).sum(axis=(1, 2)) / some, (felt * row).sum(axis=(1, 2)) / some


if __name__ == "__main__":
    sys.exit(main())
