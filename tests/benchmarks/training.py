"""Cost of training: CPU-seconds of the default recipe at the rate of the bundle that ships.

    python -m tests.benchmarks.training [--seeds N] [--people N] [--minutes M] [--quick] [--json]

So many people of each preset are simulated, read and learned from, as by `models train`; ten more
of each are judged with the thresholds of the bundle that ships. `training` is that of all networks,
the judging of held-out sessions included. Figures are medians over seeds of the training.
"""

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray

from controller.bundles import bundle
from controller.recordings import reader
from models.data import load, splits, touch_images
from models.data.examples import recording_files
from models.data.ground_truth import GroundTruth
from models.data.load import Data
from models.data.recipe import DEFAULT
from models.data.simulate import DataSet, generate
from models.evaluation.evaluate import summarise
from models.evaluation.event_counts import Tally, tally
from models.evaluation.replay import debounced_stream, network_inputs
from models.training.gesture_task import train_gestures
from models.training.location_task import train_locations
from models.training.loop import TrainingJob, batched, prepare_torch
from models.training.networks import Network

from .results import Results, command_line, say

GOALS_S: Final = {"simulating": 120.0, "training": 80.0}
UNITS: Final = {
    "events_f1": "1",
    "false_alarms_per_min": "1/min",
    "latency": "s",
    "frame_accuracy": "1",
    "location_error": "grid",
}
SEED: Final = 61  # of the people; those who are judged have another
PRESETS: Final = ("nominal", "paper-snr")
JUDGED: Final = 10  # people of each preset
QUICK: Final = 0.2  # share of turns with several quick gestures
T = TypeVar("T")


@dataclass(slots=True)
class Found:
    """Figures by name and preset, one for each seed."""

    rows: dict[tuple[str, str], list[float]] = field(default_factory=dict)

    def add(self, value: float, name: str, preset: str = "") -> None:
        self.rows.setdefault((name, preset), []).append(value)

    def timed(self, name: str, work: Callable[[], T]) -> T:
        """Do some work, and note its CPU-seconds."""
        begun = time.process_time()
        made = work()
        self.add(time.process_time() - begun, name)
        return made


def simulated(folder: Path, seed: int, people: int, minutes: float) -> list[Path]:
    """Simulate people of each preset, and return their folders."""
    for preset in PRESETS:
        data = DataSet(seed=seed, minutes=minutes, preset=preset, rate_hz=40.0, quick=QUICK)
        generate(data, folder / preset, people, 1, 1, lambda _: None)
    return [folder / preset for preset in PRESETS]


def answers(net: Network, inputs: NDArray[np.float32]) -> torch.Tensor:
    """Return a network's answers to inputs (n, ...), (n, outputs)."""
    return batched(net, lambda some: torch.from_numpy(inputs[some]), np.arange(len(inputs)))


def judge(net: Network, data: Data, folder: Path) -> list[Tally]:
    """Return counts of each recording in a folder, with the thresholds of the shipped bundle."""
    labels, tallies = data.vocabulary.labels, []
    debounce = bundle.read(bundle.default_path(data.settings.rate_hz)).debounce
    for path in recording_files([folder]):
        recording = reader.load(path)
        truth = GroundTruth.of(recording, labels, path.stem, "auto")
        inputs = network_inputs(recording.frames, data.settings)
        outputs = torch.softmax(answers(net, inputs.windows), dim=1).numpy()
        tallies.append(tally(debounced_stream(truth, inputs, outputs, labels, debounce), labels))
    return tallies


def place_errors(net: Network, data: Data) -> dict[str, float]:
    """Return the mean error of a touch's last image by preset, grid units."""
    found = touch_images.find(data.examples, DEFAULT.averaged, 0)
    inputs, corners = DEFAULT.location.touch.of(found.images[found.last])
    error = np.abs(answers(net, inputs).numpy() + corners - found.place[found.last]).mean(axis=1)
    session = data.examples.session[found.frame[found.last]]
    preset = np.array([Path(row.path).parent.name for row in data.rows])[session]
    return {name: float(error[preset == name].mean()) for name in PRESETS}


def measure(folder: Path, people: int, minutes: float, seeds: int) -> Found:
    """Simulate, read, train and judge; return every figure."""
    found = Found()
    paths = found.timed("simulating", lambda: simulated(folder / "train", SEED, people, minutes))
    judged = simulated(folder / "judged", SEED + 1, JUDGED, minutes)
    data = found.timed("reading", lambda: load.read(paths, DEFAULT, "auto", say))
    others = load.read(judged, DEFAULT, "auto", say)
    touches = touch_images.find(data.examples, DEFAULT.averaged, 0)
    for seed in range(seeds):
        device = prepare_torch(seed)
        split = splits.split_windows(data, "", seed)
        job = TrainingJob(data, split, DEFAULT, seed, device, None)
        begun = time.process_time()
        _, gestures = found.timed("gestures", partial(train_gestures, job))
        _, places = found.timed("places", partial(train_locations, job, touches))
        found.add(time.process_time() - begun, "training")
        for preset, path in zip(PRESETS, judged, strict=True):
            result = summarise(preset, data.vocabulary.labels, judge(gestures, data, path))
            found.add(result.f1.value, "events_f1", preset)
            found.add(result.false_alarms_per_min.value, "false_alarms_per_min", preset)
            found.add(result.latency_s.value, "latency", preset)
            found.add(result.frame_accuracy.value, "frame_accuracy", preset)
        for preset, error in place_errors(places, others).items():
            found.add(error, "location_error", preset)
    return found


def main(argv: list[str] | None = None) -> int:
    asked = command_line(__doc__, seeds=2, people=30, minutes=6.0, quick=False).parse_args(argv)
    if asked.quick:
        asked.seeds, asked.people, asked.minutes = 1, 3, 2.0
    with tempfile.TemporaryDirectory() as folder:
        found = measure(Path(folder), asked.people, asked.minutes, asked.seeds)
    results = Results("training")
    for (name, preset), values in found.rows.items():
        unit, goal = UNITS.get(name, "CPU-s"), GOALS_S.get(name)
        results.note(name, statistics.median(values), unit, preset=preset, goal=goal)
    results.finish(asked.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
