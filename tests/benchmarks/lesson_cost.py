"""Cost of a lesson as the window says it, and as the demo then shows it, by gesture.

    python -m tests.benchmarks.lesson_cost --bundle FILE --label squeeze [--seeds 20] [--json]

Each seed is an orb and a hand. The demo plays with the bundle; its truth judges it.
"""

import statistics
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from controller.adapt import cost
from controller.shared.event_metric import Answer, Event, attach
from host.demo.demo import Demo

from .results import Results, command_line, say

Heard = dict[str, list[float | None]]  # latency of each event by gesture, s; None: missed


def stated(path: Path, label: str, seed: int) -> Iterator[cost.Cost]:
    """Yield what the window says of the older gestures."""
    yield from (one for one in cost.measure(path, label, cost.Hand(seed)) if one.label != label)


def played(path: Path, seed: int, seconds: float) -> Heard:
    """Return what a demo shows."""
    options = ("--sensor", "virtual:quick=1", "--bundle", str(path))
    with Demo(seed, seconds, options) as demo:
        while not demo.over:
            demo.tick()
    record, heard = demo.record, Heard()
    truths = [one for one in record.truths if record.meant[one.number]]
    events = [
        Event(one.onset_ms / 1000, one.release_ms / 1000, record.meant[one.number])
        for one in truths
    ]
    answers = [Answer(ms / 1000, name) for ms, name in record.commands]
    first: dict[int, float] = {}
    for answer, owner in zip(answers, attach(events, answers), strict=True):
        if owner >= 0 and answer.kind == events[owner].kind:
            first.setdefault(owner, answer.time_s - events[owner].onset_s)
    for number, truth in enumerate(truths):
        heard.setdefault(truth.label, []).append(first.get(number))
    return heard


def main() -> None:
    """Compare, seed by seed."""
    options = command_line(
        __doc__, bundle=Path("taught.orb"), label="squeeze", first=1, seeds=20, seconds=120.0
    ).parse_args()
    said: dict[str, list[cost.Cost]] = defaultdict(list)
    shown: Heard = defaultdict(list)
    for seed in range(options.first, options.first + options.seeds):
        for one in stated(options.bundle, options.label, seed):
            said[one.label].append(one)
        for label, latencies in played(options.bundle, seed, options.seconds).items():
            shown[label] += latencies
        say(f"seed {seed}")
    results = Results("lesson_cost")
    for label, costs in said.items():
        found = [one for one in shown[label] if one is not None]
        if not found:
            continue
        hits = sum(one.now.hits for one in costs) / sum(one.of for one in costs)
        latency_s = statistics.mean(one.now.latency_s for one in costs)
        results.note(f"{label}_stated", hits, "1", latency_s=latency_s)
        share, median_s = len(found) / len(shown[label]), statistics.median(found)
        results.note(f"{label}_played", share, "1", latency_s=median_s, of=len(shown[label]))
    results.finish(options.json)


if __name__ == "__main__":
    main()
