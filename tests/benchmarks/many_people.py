"""Cost of recordings of many people: measured on a few simulated ones, and multiplied open_set.

    python -m tests.benchmarks.many_people [--people N] [--minutes M] [--json]

A few sessions are simulated, written, surveyed, read as `models train` reads them, and learned
from for a few hundred steps. Times are of this process's processor, so that whatever else the
machine does is no part of them. The second table multiplies the first by N people of M minutes
each, on one core; nothing in it is measured.
"""

import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch

from controller.recordings import reader, writer
from models.data import load, splits
from models.data.augment import Symmetry
from models.data.recipe import DEFAULT
from models.data.simulate import DataSet
from models.training.gesture_task import GestureTask
from models.training.loop import prepare_torch

from .results import Results, command_line

USERS: Final = 6
MINUTES: Final = 10.0  # of each: an hour in all
STEPS: Final = 300  # of training
WARM: Final = 30  # of them are not timed


@dataclass(frozen=True, slots=True)
class Cost:
    """What an hour of recordings costs; times are processor-seconds."""

    frames: float  # in an hour
    bytes_on_disk: float  # of recordings as they are written
    bytes_in_memory: float  # of examples made of them
    survey_s: float  # to learn what kind of recordings they are
    read_s: float  # to check them, choose labels, and make examples of them
    windows: float  # to learn from
    step_ms: float  # of training, for a batch
    batch: int  # windows in it


def measure(preset: str) -> Cost:
    """Measure on simulated sessions."""
    data, hours = DataSet(minutes=MINUTES, preset=preset), USERS * MINUTES / 60.0
    with tempfile.TemporaryDirectory() as place:
        folder, written = Path(place), 0
        for user in range(USERS):
            content = writer.pack(data.session(user, 0))
            written += len(content)
            (folder / f"sub-{user:02d}_ses-01_run-01.npz").write_bytes(content)
        files = sorted(folder.iterdir())
        survey_s, _ = _spent(lambda: [reader.survey(file) for file in files])
        read_s, read = _spent(lambda: load.read([folder], DEFAULT, "auto", lambda line: None))
    examples = read.examples
    columns = ("images", "label", "touch", "ends", "session", "idle")
    size = sum(getattr(examples, name).nbytes for name in columns)
    step_s, windows = _step(read)
    return Cost(
        len(examples.label) / hours, written / hours, size / hours, survey_s / hours,
        read_s / hours, windows / hours, 1000.0 * step_s, DEFAULT.gesture.batch,
    )  # fmt: skip


def _spent(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return the processor-seconds of some work, and what it returned."""
    begun = time.process_time()
    done = work()
    return time.process_time() - begun, done


def _step(read: load.Data) -> tuple[float, int]:
    """Return the processor-seconds of a step, and how many windows an epoch goes through."""
    device = prepare_torch(0)
    split = splits.split_windows(read, "", 0)
    shape = read.examples.images.shape[1:]
    task = GestureTask(read.examples, split.windows, len(read.vocabulary.labels),
                       Symmetry.of(read.vocabulary, *shape), DEFAULT.gesture, device)  # fmt: skip
    adam = torch.optim.Adam(task.net.parameters(), fused=True)
    generator, rng = torch.Generator(device).manual_seed(0), np.random.default_rng(0)
    batches = [one for _ in range(20) for one in task.batches(rng)][:STEPS]
    begun = 0.0
    for number, batch in enumerate(batches):
        if number == WARM:
            begun = time.process_time()
        loss, _ = task.loss(batch, generator)
        adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        adam.step()
    step_s = (time.process_time() - begun) / (len(batches) - WARM)
    return step_s, task.steps() * DEFAULT.gesture.batch


def main() -> None:
    """Measure and print."""
    parser = command_line(__doc__, people=10_000, minutes=30.0, preset="nominal")
    arguments, results = parser.parse_args(), Results("many_people")
    cost, mib, gib = measure(arguments.preset), 2.0**20, 2.0**30
    hours = arguments.people * arguments.minutes / 60.0
    epoch_s = cost.windows / cost.batch * cost.step_ms / 1000.0
    measured = (
        ("frames_per_hour", cost.frames, ""),
        ("disk_per_hour", cost.bytes_on_disk / mib, "MiB"),
        ("memory_per_hour", cost.bytes_in_memory / mib, "MiB"),
        ("survey_per_hour", cost.survey_s, "cpu_s"),
        ("read_per_hour", cost.read_s, "cpu_s"),
        ("step", cost.step_ms, "cpu_ms"),
        ("epoch_per_hour", epoch_s, "cpu_s"),
    )
    multiplied = (
        ("hours_recorded", hours, "h"),
        ("disk", hours * cost.bytes_on_disk / gib, "GiB"),
        ("memory", hours * cost.bytes_in_memory / gib, "GiB"),
        ("survey", hours * cost.survey_s / 60.0, "cpu_min"),
        ("read", hours * cost.read_s / 3600.0, "cpu_h"),
        ("epoch", hours * epoch_s / 3600.0, "cpu_h"),
        ("recipe_steps", DEFAULT.gesture.steps * cost.step_ms / 60e3, "cpu_min"),
    )
    print(f"an hour of recordings, {arguments.preset}, measured on {USERS * MINUTES:.0f} minutes:")
    for name, value, unit in measured:
        results.note(name, value, unit, preset=arguments.preset)
    print(f"{arguments.people:,} people of {arguments.minutes:g} minutes, multiplied:")
    for name, value, unit in multiplied:
        results.note(name, value, unit, preset=arguments.preset)
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
