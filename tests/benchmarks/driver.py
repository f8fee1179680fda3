"""Recognition of an orb behind its driver, beside the virtual orb's own read-out.

python -m tests.benchmarks.driver [--minutes 8] [--seeds 2] [--json]

The same orb, the same hand, the same gestures at the same times, with brushes and resting fingers
in between, are read three ways: by the virtual orb's read-out, which the bundle was trained on, and
by the driver on emulated hardware, in both schemes. In `unplugged` the membrane's plug is pulled
for five seconds of every thirty; only gestures that it does not cut into count, and what comes
while it is out, or in the second after, counts as a false alarm.
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
from controller.sensors.emulated import Emulated
from controller.sensors.geometry import SensorAwayError
from controller.sensors.hardware.emulated.circuit import WiringFault
from controller.shared.event_metric import Answer, Event, Score, judge
from controller.simulator.hand.performance import DISTRACTORS

from .results import Results, command_line

PRESETS: Final = ("nominal", "paper-snr")
WAYS: Final = ("virtual", "column", "taxel", "unplugged")
FIRST_SEED: Final = 900_400  # no training accepts it
_OUT_S: Final = (12.0, 17.0, 30.0)  # the plug is out from, until, of so many
_AFTER_S: Final = 1.0  # a gesture must keep away from the plug by this much

Told = tuple[list[Event], list[Answer]]  # true gestures, and answers


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


def play(way: str, preset: str, seed: int, minutes: float, folder: Path) -> Told:
    """Let a hand play for a while, and return what was recognised."""
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
        if way == "unplugged" and isinstance(sensor, Emulated):
            pull = _OUT_S[0] <= now % _OUT_S[2] < _OUT_S[1]
            sensor.bench.switch([WiringFault("unplugged")], on=pull)
        try:
            step = pipeline.step(sensor.read(now), now, k)
        except SensorAwayError:
            continue
        finally:
            events += [
                Event(t.onset_ms / 1000, t.release_ms / 1000, t.label)
                for t in sensor.truths()
                if t.label in bundle.labels
            ]
        if step.gesture is not None:
            answers.append(Answer(now, step.gesture))
    sensor.close()
    return events, answers


def score(way: str, told: Told) -> Score:
    """Return how well it was recognised; what the plug cuts into is left out."""
    events, answers = told
    if way != "unplugged":
        return judge(events, answers)
    cut = [event for event in events if _cut(event)]
    answers = [
        answer
        for answer in answers
        if not any(
            e.onset_s <= answer.time_s <= e.release_s + 0.5 and answer.kind == e.kind for e in cut
        )
    ]
    return judge([event for event in events if not _cut(event)], answers)


def _cut(event: Event) -> bool:
    """Return whether the plug is out during a gesture, or just before or after it."""
    for turn in range(int(event.onset_s // _OUT_S[2]) - 1, int(event.release_s // _OUT_S[2]) + 2):
        start, end = (turn * _OUT_S[2] + edge for edge in _OUT_S[:2])
        if event.onset_s < end + _AFTER_S and event.release_s > start - _AFTER_S:
            return True
    return False


def measure(presets: Sequence[str], ways: Sequence[str], minutes: float, seeds: int) -> Results:
    results = Results("driver")
    with TemporaryDirectory() as folder:
        for preset in presets:
            for way in ways:
                total = Score()
                for seed in range(FIRST_SEED, FIRST_SEED + seeds):
                    total.add(score(way, play(way, preset, seed, minutes, Path(folder))))
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
