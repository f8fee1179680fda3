"""Speed of opening recordings, and memory of a data set in training.

    python -m tests.benchmarks.recordings [--recordings N] [--minutes M] [--repeats R] [--json]

An hour at 10 Hz is surveyed and loaded; N recordings of M minutes, and a tenth of them, are
surveyed and prepared for training. Times are medians (least ... greatest).
Each figure of memory is of a process of its own: the most that it gained over what Python, NumPy
and our modules take (Linux's VmHWM and RssAnon).
"""

import argparse
import json
import multiprocessing
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.recognition.frames import PreprocessSettings
from controller.recordings import reader, writer
from models.data.examples import Source, prepare, read_training
from models.data.simulate import DataSet

GOAL_S: Final = 1.0  # "an hour at 10 Hz opens in well under a second"
HOUR: Final = 60.0
DIFFERENT: Final = 10  # sessions that are simulated; the data set repeats them
BATCHES: Final = 50  # of random windows, drawn as training draws them
BATCH: Final = 150


def _status(field: str) -> float:
    """One of the sizes that Linux knows of this process, MiB."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith(f"{field}:"):
            return int(line.split()[1]) / 1024
    raise LookupError(field)


def timed(work: Callable[[], Any], repeats: int) -> list[float]:
    """Return the seconds of each repetition."""
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return seconds


def make(folder: Path, count: int, minutes: float) -> list[Path]:
    """Write `count` recordings of a few different sessions."""
    data = DataSet(minutes=minutes)
    contents = [writer.pack(data.session(user, 0)) for user in range(min(count, DIFFERENT))]
    paths = [folder / f"sub-{number:05d}_ses-01_run-01.npz" for number in range(count)]
    for number, path in enumerate(paths):
        path.write_bytes(contents[number % DIFFERENT])
    return paths


def train_on(paths: list[Path]) -> dict[str, float]:
    """Prepare recordings and draw windows; return seconds, frames and MiB of memory gained."""
    before, private = _status("VmHWM"), _status("RssAnon")
    start = time.perf_counter()
    recordings = read_training(paths)
    surveyed = time.perf_counter()
    examples = prepare((Source.of(one) for one in recordings), PreprocessSettings())
    prepared = time.perf_counter()
    peak = _status("VmHWM") - before
    rng = np.random.default_rng(0)
    for _ in range(BATCHES):
        examples.windows(rng.choice(examples.ends, BATCH))
    return {
        "survey_s": surveyed - start,
        "prepare_s": prepared - surveyed,
        "frames": float(len(examples.images)),
        "peak_mib": peak,
        "private_mib": _status("RssAnon") - private,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--recordings", type=int, default=1000)
    parser.add_argument("--minutes", type=float, default=1.0, help="length of each")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    if sys.platform != "linux":
        parser.error("only Linux tells how much memory a process has had")
    results: list[dict[str, Any]] = []

    def note(name: str, values: list[float], unit: str, goal: float | None = None) -> None:
        middle = float(np.median(values))
        aim = "" if goal is None else f"   goal: below {goal:g}"
        spread = f"({min(values):.4g} ... {max(values):.4g})" if len(values) > 1 else ""
        print(f"{name:34} {middle:10.4g} {unit:4} {spread}{aim}", flush=True)
        results.append({"name": name, "value": middle, "unit": unit, "goal": goal})

    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        [hour] = make(folder, 1, HOUR)
        note("hour_survey", timed(lambda: reader.survey(hour), arguments.repeats), "s", GOAL_S)
        note("hour_load", timed(lambda: reader.load(hour), arguments.repeats), "s", GOAL_S)
        hour.unlink()
        paths = make(folder, arguments.recordings, arguments.minutes)
        for count in (max(1, arguments.recordings // 10), arguments.recordings):
            # A process's memory is what it was at its worst, so each has its own.
            with multiprocessing.get_context("spawn").Pool(1) as pool:
                figures = pool.apply(train_on, (paths[:count],))
            for name, value in figures.items():
                unit = {"s": "s", "mib": "MiB"}.get(name.rpartition("_")[2], "")
                note(f"{count}_in_memory_{name}", [value], unit)
    if arguments.json:
        print(json.dumps({"benchmark": "recordings", "results": results}))


if __name__ == "__main__":
    main()
