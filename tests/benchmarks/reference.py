"""Recognition of the frozen touches of the independent solver, beside the own contact model's.

    python -m tests.benchmarks.reference [--bundle FILE] [--events N] [--seed N] [--json]

`tests/reference/touches.npz` holds ln C of 310 presses, pinches and twists under two friction laws.
No training or tuning may use them. They follow each other in any order through the simulated
electronics of both presets, 31 on each orb. The own contact model then does the same touches, on
the same orbs with the same noise. A row is a gesture under a friction law: the share that is
answered rightly, and beside it answers of another name, second ones and false ones, as shares of
its events. A false answer comes more than half a second after a touch and before the next.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.shared import event_metric
from controller.shared.aliases import Array, Frames
from controller.shared.event_metric import Answer
from controller.simulator.hand.performance import SLOTS
from controller.simulator.orb import PRESETS, OrbSimulator, preset
from tests.reference.touches import RATE_HZ, Solved, read

from .results import Results, command_line, say

PHYSICS: Final = ("reference", "own")
DOMAIN: Final = 9  # a family of seeds of its own
LEAD_S: Final = 3.0  # the rest image is found
PAUSE_S: Final = (0.9, 1.6)  # from one touch to the next
PER_ORB: Final = 31  # touches
PITCH_MM: Final = 10.0
PLACES_GOAL: Final = 1.2  # error of positions as a share of the own model's


@dataclass(slots=True)
class Tally:
    """Outcomes of touches of one kind."""

    events: int = 0
    right: int = 0
    wrong: int = 0  # answers of another name
    twice: int = 0  # right answers again
    false: int = 0  # answers between touches
    latencies_s: list[float] = field(default_factory=list)  # of right answers, from onset
    errors: list[float] = field(default_factory=list)  # of presses' positions, grid units

    def __iadd__(self, other: "Tally") -> "Tally":
        """Add the outcomes of others."""
        self.events += other.events
        self.right += other.right
        self.wrong += other.wrong
        self.twice += other.twice
        self.false += other.false
        self.latencies_s += other.latencies_s
        self.errors += other.errors
        return self

    def shares(self) -> dict[str, float | int]:
        """Return all but the share of right answers, with the latency's median in seconds."""
        count = max(1, self.events)
        late = round(median(self.latencies_s), 4) if self.latencies_s else float("nan")
        shares = {name: getattr(self, name) / count for name in ("wrong", "twice", "false")}
        return {"events": self.events, **shares, "latency_s": late}


def session(
    touches: Sequence[Solved], physics: str, name: str, seed: Sequence[int], rate_hz: float
) -> tuple[Frames, list[float]]:
    """Return frames of touches on one orb, and when each touch begins, seconds."""
    rng, now, begins = np.random.default_rng([DOMAIN, *seed]), LEAD_S, []
    for touch in touches:
        begins.append(now)
        now += touch.event.end_s + rng.uniform(*PAUSE_S)
    simulator = OrbSimulator(np.random.SeedSequence([DOMAIN, *seed]), rate_hz, model=preset(name))
    steps = int(now * rate_hz) * simulator.steps_per_frame
    time_s = np.asarray(np.arange(1, steps + 1) * simulator.step_s, dtype=np.float64)
    point = np.zeros((len(time_s), SLOTS), dtype=np.complex128)
    depth, radius = np.zeros(point.shape), np.full(point.shape, 7.0)
    log_c = np.zeros((len(time_s), simulator.model.rows * simulator.model.columns))
    for touch, begin in zip(touches, begins, strict=True):
        event = touch.event
        part = slice(*np.searchsorted(time_s, (begin, begin + event.end_s)).tolist())
        fingers = slice(len(event.keys))
        point[part, fingers], depth[part, fingers] = event.tracks(time_s[part] - begin)
        radius[part] = event.radius_mm
        log_c[part] = _between(touch.log_c.astype(np.float64), (time_s[part] - begin) * RATE_HZ)
    if physics == "own":
        return simulator.advance(point, depth, radius), begins
    return simulator.electronics.scan(log_c, point, depth), begins


def measure(
    loaded: Bundle, touches: Sequence[Solved], physics: str, name: str, seed: Sequence[int]
) -> Iterator[tuple[Solved, Tally]]:
    """Yield each touch with its outcome, all of them on one orb, by the device's pipeline."""
    frames, begins = session(touches, physics, name, seed, loaded.rate_hz)
    pipeline, answers = Pipeline(loaded.settings, Recognizer(loaded), loaded.mapping), []
    time_s = np.arange(1, len(frames) + 1) / loaded.rate_hz
    places = np.full((len(frames), 2), np.nan)
    for number, (frame, now) in enumerate(zip(frames, time_s.tolist(), strict=True)):
        step = pipeline.step(frame, now)
        if step.touch is not None:
            places[number] = step.touch
        if step.gesture is not None:
            answers.append(Answer(now, step.gesture))
    events = [
        event_metric.Event(begin + one.event.onset_s, begin + one.event.end_s, one.event.label)
        for one, begin in zip(touches, begins, strict=True)
    ]
    owners = event_metric.attach(events, answers)
    ends = [*(event.onset_s for event in events[1:]), time_s[-1] + 1.0]
    for number, (touch, event, end) in enumerate(zip(touches, events, ends, strict=True)):
        own = [a for a, owner in zip(answers, owners, strict=True) if owner == number]
        right = [answer for answer in own if answer.kind == event.kind]
        stray = [
            answer
            for answer, owner in zip(answers, owners, strict=True)
            if owner < 0 and event.onset_s <= answer.time_s < end
        ]
        tally = Tally(1, min(1, len(right)), len(own) - len(right), max(0, len(right) - 1))
        tally.false = len(stray)
        tally.latencies_s = [answer.time_s - event.onset_s for answer in right[:1]]
        during = places[(time_s >= event.onset_s) & (time_s <= event.release_s)]
        located = during[np.isfinite(during[:, 0])]
        if event.kind == "press" and len(located):
            middle = touch.event.middle / PITCH_MM
            true = (middle.real + (loaded.columns - 1) / 2, middle.imag + (loaded.rows - 1) / 2)
            tally.errors = [float(np.abs(located[-1] - true).mean())]
        yield touch, tally


def main() -> None:
    """Print the rows of both presets and physics, and the ratio of their positions' errors."""
    parser = command_line(__doc__, events=0, seed=1, bundle=Path())
    options, results = parser.parse_args(), Results("reference")
    path = bundles.default_path() if options.bundle == Path() else options.bundle
    loaded, touches = bundles.read(path), read()
    order = np.random.default_rng([DOMAIN, options.seed]).permutation(len(touches)).tolist()
    order = order[: options.events or None]
    for name in PRESETS:
        errors = {}
        for physics in PHYSICS:
            total, kinds = Tally(), dict[str, Tally]()
            for start in range(0, len(order), PER_ORB):
                some = [touches[number] for number in order[start : start + PER_ORB]]
                for touch, one in measure(loaded, some, physics, name, (options.seed, start)):
                    total += one
                    kinds.setdefault(f"{touch.event.label}@{touch.event.law}", Tally())
                    kinds[f"{touch.event.label}@{touch.event.law}"] += one
            for kind, tally in [("events", total), *sorted(kinds.items())]:
                shares = tally.shares()
                goal = 0.98 if physics == "reference" and tally is total else None
                results.note(
                    f"{kind} ({physics})", tally.right / max(1, tally.events), "1",
                    preset=name, goal=goal, **shares,
                )  # fmt: skip
                say("    " + ", ".join(f"{key} {value:.4g}" for key, value in shares.items()))
            errors[physics] = float(np.mean(total.errors)) if total.errors else float("nan")
            results.note(f"location_error ({physics})", errors[physics], "grid", preset=name)
        ratio = errors["reference"] / errors["own"]
        results.note("location_error_ratio", ratio, "1", preset=name, goal=PLACES_GOAL)
    results.finish(options.json, bundle=str(path))


def _between(log_c: Array, place: Array) -> Array:
    """Interpolate stored frames, (frames, taxels), at places between them, (steps,)."""
    low = np.minimum(place.astype(np.int64), len(log_c) - 2)
    share = (place - low)[:, None]
    return np.asarray(log_c[low] * (1.0 - share) + log_c[low + 1] * share)


if __name__ == "__main__":
    main()
