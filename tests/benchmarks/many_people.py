"""Cost of recordings of many people: measured on a few simulated ones, and multiplied up.

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
MIB: Final = 2.0**20


def measure(preset: str) -> tuple[dict[str, float], float]:
    """Return what an hour costs (frames, MiB, processor-seconds), and a step, milliseconds."""
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
    costs = {
        "frames": len(examples.label), "disk": written / MIB, "memory": size / MIB,
        "survey": survey_s, "read": read_s,
        "epoch": windows / DEFAULT.gesture.batch * step_s,
    }  # fmt: skip
    return {name: cost / hours for name, cost in costs.items()}, 1000.0 * step_s


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
    parser = command_line(__doc__, people=10_000, minutes=30.0, preset="nominal")
    arguments, results = parser.parse_args(), Results("many_people")
    cost, step_ms = measure(arguments.preset)
    hours = arguments.people * arguments.minutes / 60.0
    units = {"frames": "", "disk": "MiB", "memory": "MiB"}
    measured = [(f"{name}_per_hour", each, units.get(name, "cpu_s")) for name, each in cost.items()]
    measured.insert(-1, ("step", step_ms, "cpu_ms"))
    multiplied = (
        ("hours_recorded", hours, "h"),
        ("disk", hours * cost["disk"] / 1024.0, "GiB"),
        ("memory", hours * cost["memory"] / 1024.0, "GiB"),
        ("survey", hours * cost["survey"] / 60.0, "cpu_min"),
        ("read", hours * cost["read"] / 3600.0, "cpu_h"),
        ("epoch", hours * cost["epoch"] / 3600.0, "cpu_h"),
        ("recipe_steps", DEFAULT.gesture.steps * step_ms / 60e3, "cpu_min"),
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
