"""Recognition of an orb behind its driver, beside the virtual orb's own read-out.

python -m tests.benchmarks.driver [--minutes 8] [--seeds 2] [--json]

The same orb, the same hand, the same gestures at the same times, with brushes and resting fingers
in between, are read three ways: by the virtual orb's read-out, which the bundle was trained on, and
by the driver on emulated hardware, in both schemes.
"""

from collections.abc import Iterator, Sequence
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.sensors import base as sensors
from controller.shared.event_metric import Answer, Event, Score, judge
from controller.simulator.hand.performance import DISTRACTORS

from .results import Results, command_line

PRESETS: Final = ("nominal", "paper-snr")
WAYS: Final = ("virtual", "column", "taxel")
FIRST_SEED: Final = 900_400  # no training accepts it


def script(
    labels: tuple[str, ...], seed: int, minutes: float
) -> Iterator[tuple[float, str, float, float]]:
    """Yield (seconds, label, x, y): gestures and, one in four, touches that are none."""
    rng, now = np.random.default_rng(seed), 3.0
    while now < 60.0 * minutes - 4.0:
        stray = rng.random() < 0.25
        label = str(rng.choice(DISTRACTORS if stray else labels[1:]))
        spread = 1.8 if label == "press" or stray else 0.2
        x, y = 2.0 + spread * rng.uniform(-1.0, 1.0, 2)
        yield now, label, float(x), float(y)
        now += float(rng.uniform(2.2, 3.6))


def play(way: str, preset: str, seed: int, minutes: float, folder: Path) -> Score:
    """Let a hand play for a while, and return how well it was recognised."""
    bundle = bundles.read(bundles.default_path())
    wiring = folder / "taxel.toml"
    if not wiring.exists():
        text = (files("controller.sensors.hardware") / "default.toml").read_text(encoding="utf-8")
        wiring.write_text(text.replace('scheme = "column"', 'scheme = "taxel"'))
    sensor = sensors.load(
        "virtual" if way == "virtual" else "emulated", bundle.rate_hz,
        seed=seed, preset=preset, wiring=wiring if way == "taxel" else None,
    )  # fmt: skip
    pipeline = Pipeline(bundle.settings, Recognizer(bundle), bundle.mapping)
    wishes = list(script(bundle.labels, seed, minutes))
    events, answers, number = [], [], 0
    for k in range(1, round(60 * bundle.rate_hz * minutes) + 1):
        now = k / bundle.rate_hz
        while number < len(wishes) and wishes[number][0] <= now:
            at, label, x, y = wishes[number]
            number += 1
            sensor.perform(number, label, x, y, at)
        step = pipeline.step(sensor.read(now), now, k)
        events += [
            Event(t.onset_ms / 1000, t.release_ms / 1000, t.label)
            for t in sensor.truths()
            if t.label in bundle.labels
        ]
        if step.gesture is not None:
            answers.append(Answer(now, step.gesture))
    sensor.close()
    return judge(events, answers)


def measure(presets: Sequence[str], ways: Sequence[str], minutes: float, seeds: int) -> Results:
    results = Results("driver")
    with TemporaryDirectory() as folder:
        for preset in presets:
            for way in ways:
                total = Score()
                for seed in range(FIRST_SEED, FIRST_SEED + seeds):
                    total.add(play(way, preset, seed, minutes, Path(folder)))
                late = float(np.median(total.latencies_s)) if total.latencies_s else float("nan")
                print(
                    f"{preset:10} {way:10} {total.intended:5d} events, hits {total.hits}, wrong "
                    f"{total.wrong}, missed {total.missed}, false {total.false_alarms}, twice "
                    f"{total.duplicates}",
                    flush=True,
                )
                f1, late = round(total.f1, 5), round(late, 3)
                events = total.intended
                results.note(f"events_f1@{way}", f1, "1", preset=preset, events=events)
                results.note(f"latency@{way}", late, "s", preset=preset)
    return results


def main() -> None:
    parser = command_line(__doc__, minutes=8.0, seeds=2)
    parser.add_argument("--presets", nargs="+", choices=PRESETS, default=PRESETS)
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    options = parser.parse_args()
    found = measure(options.presets, options.ways, options.minutes, options.seeds)
    found.finish(options.json)


if __name__ == "__main__":
    main()
