"""Cost of training: CPU-seconds to CNN-3D's plateau.

    python -m tests.benchmarks.training [--seeds N] [--epochs N] [--minutes M] [--quick] [--json]

Three sessions of half an hour, each of another user, are learned from; frames of eight others are
judged: the share of frames named rightly, mean over the classes. The plateau is the best epoch of a
long run; what is reported is the CPU time of the shortest run that ends within 0.2 points of it.
The learning rate falls to zero, so each length is a run of its own. Judging costs nothing here.
Median over seeds.
"""

import statistics
import sys
import time
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import torch
from torch import nn

from controller.bundles import vocabulary
from controller.recognition.images.frames import PreprocessSettings
from models.data.augment import Symmetry
from models.data.examples import Examples, Source, prepare
from models.data.recipe import DEFAULT, NetworkRecipe
from models.data.simulate import DataSet
from models.data.splits import Parts
from models.results.training import Epoch
from models.training.gesture_task import GestureTask
from models.training.loop import fit, prepare_torch

from .results import Results, command_line, say

GOAL_S: Final = 15.0
WITHIN: Final = 0.002  # of the plateau
LENGTHS: Final = (8, 10, 12, 14, 16, 20, 24)  # epochs of the runs that are tried
TRAINED: Final = 3  # sessions, and users
JUDGED: Final = 8
FRAMES: Final = 80_000  # to be judged on, at least
NONE: Final = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Run:
    """One training: what it cost, and how good it was."""

    epochs: int
    cpu_s: float
    accuracy: float


def examples(seed: int, users: int, minutes: float) -> Examples:
    """Return sessions of so many users."""
    data = DataSet(seed=seed, minutes=minutes)
    sources = (Source.of(data.session(user, 0)) for user in range(users))
    return prepare(sources, PreprocessSettings())


def judge(net: nn.Module, fresh: Examples) -> float:
    """Return the share of windows named rightly, mean over the classes."""
    net.eval()
    named = []
    with torch.no_grad():
        for start in range(0, len(fresh.ends), 2000):
            windows = torch.from_numpy(fresh.windows(fresh.ends[start : start + 2000]))
            named.append(net(windows).argmax(dim=1).numpy())
    right = np.concatenate(named) == fresh.label[fresh.ends]
    label = fresh.label[fresh.ends]
    return float(np.mean([right[label == each].mean() for each in np.unique(label)]))


def ours(train: Examples, fresh: Examples, course: NetworkRecipe, seed: int) -> list[Run]:
    """Train by our recipe, and return the run after every epoch (the last one is the result)."""
    torch.manual_seed(seed)
    labels = vocabulary.shipped()
    symmetry = Symmetry.of(labels, *train.images.shape[1:])
    parts = Parts(np.arange(len(train.ends)), NONE, NONE)
    device = torch.device("cpu")
    runs: list[Run] = []
    begun, judging = time.process_time(), 0.0
    task = GestureTask(train, parts, len(labels.labels), symmetry, course, device)

    def watch(epoch: Epoch) -> None:
        nonlocal judging
        spent = time.process_time() - begun - judging
        accuracy = judge(task.net, fresh)
        judging = time.process_time() - begun - spent
        runs.append(Run(epoch.number, spent, accuracy))

    fit(task, seed, None, watch)
    return runs


def measure(minutes: float, epochs: int, seeds: int) -> dict[str, list[float]]:
    """Return the figures of every seed, by name."""
    prepare_torch(0)
    train = examples(41, TRAINED, minutes)
    fresh = examples(42, JUDGED, max(1.0, FRAMES / JUDGED / 600.0 + 0.1) if minutes > 5 else 2.0)
    say(f"{len(train.ends)} windows to learn from, {len(fresh.ends)} to be judged on")
    found: dict[str, list[float]] = {}
    for seed in range(seeds):
        course = replace(DEFAULT.gesture, epochs=epochs)
        long = ours(train, fresh, course, seed)
        plateau = max(run.accuracy for run in long)
        say(f"seed {seed}: plateau {plateau:.4f}, {long[-1].cpu_s:.0f} CPU-s for {epochs} epochs")
        tried = []
        for length in [n for n in LENGTHS if n < epochs]:
            tried.append(ours(train, fresh, replace(course, epochs=length), seed)[-1])
            say(f"  {length} epochs: {tried[-1].accuracy:.4f}, {tried[-1].cpu_s:.1f} CPU-s")
            if tried[-1].accuracy >= plateau - WITHIN:
                break
        good = [run for run in (*tried, long[-1]) if run.accuracy >= plateau - WITHIN]
        first = min(good, key=lambda run: run.cpu_s, default=long[-1])
        found.setdefault("training_cpu_s", []).append(first.cpu_s)
        found.setdefault("training_plateau", []).append(100.0 * plateau)
    return found


def main(argv: list[str] | None = None) -> int:
    parser = command_line(__doc__, seeds=3, epochs=30, minutes=29.2, quick=False)
    asked = parser.parse_args(argv)
    if asked.quick:
        asked.seeds, asked.epochs, asked.minutes = 1, 4, 3.0
    found = measure(asked.minutes, asked.epochs, asked.seeds)
    results = Results("training")
    for name, values in found.items():
        unit, goal = ("CPU-s", GOAL_S) if name == "training_cpu_s" else ("%", None)
        results.note(name, statistics.median(values), unit, preset="nominal", goal=goal)
    results.finish(asked.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
