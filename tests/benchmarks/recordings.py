"""Speed of opening recordings, and memory of a data set in training.

    python -m tests.benchmarks.recordings [--recordings N] [--minutes M] [--repeats R] [--json]

An hour at 10 Hz is surveyed and loaded; N recordings of M minutes, and a tenth of them, are
surveyed and prepared for training. Times are medians (least ... greatest). Memory is of a process
of its own: the most that it gained over what Python and modules take (Linux's VmHWM and RssAnon).
"""

import multiprocessing
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.recognition.images.frames import PreprocessSettings
from controller.recordings import reader, writer
from models.data.examples import Source, prepare, read_training
from models.data.simulate import DataSet
from tests.support.processes import memory_mib

from .results import Results, command_line

GOAL_S: Final = 1.0  # "an hour at 10 Hz opens in well under a second"
HOUR: Final = 60.0
DIFFERENT: Final = 10  # sessions that are simulated; the data set repeats them
BATCHES: Final = 50  # of random windows, drawn as training draws them
BATCH: Final = 150


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
    before, private = memory_mib("VmHWM"), memory_mib("RssAnon")
    start = time.perf_counter()
    recordings = read_training(paths)
    surveyed = time.perf_counter()
    examples = prepare((Source.of(one) for one in recordings), PreprocessSettings())
    prepared = time.perf_counter()
    peak = memory_mib("VmHWM") - before
    rng = np.random.default_rng(0)
    for _ in range(BATCHES):
        examples.windows(rng.choice(examples.ends, BATCH))
    return {
        "survey_s": surveyed - start,
        "prepare_s": prepared - surveyed,
        "frames": float(len(examples.images)),
        "peak_mib": peak,
        "private_mib": memory_mib("RssAnon") - private,
    }


def main() -> None:
    parser = command_line(__doc__, recordings=1000, minutes=1.0, repeats=7)
    arguments = parser.parse_args()
    if sys.platform != "linux":
        parser.error("only Linux tells how much memory a process has had")
    results = Results("recordings")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        [hour] = make(folder, 1, HOUR)
        for name, work in (("hour_survey", reader.survey), ("hour_load", reader.load)):
            seconds = timed(partial(work, hour), arguments.repeats)
            results.spread(name, seconds, "s", goal=GOAL_S)
        hour.unlink()
        paths = make(folder, arguments.recordings, arguments.minutes)
        for count in (max(1, arguments.recordings // 10), arguments.recordings):
            # A process's memory is what it was at its worst, so each has its own.
            with multiprocessing.get_context("spawn").Pool(1) as pool:
                figures = pool.apply(train_on, (paths[:count],))
            for name, value in figures.items():
                unit = {"s": "s", "mib": "MiB"}.get(name.rpartition("_")[2], "")
                results.note(f"{count}_in_memory_{name}", value, unit)
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
