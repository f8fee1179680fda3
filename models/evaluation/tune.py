"""Tuning of the debounce settings on labelled streams, and calibration of position errors.

The settings are searched in blocks, each over its whole grid while the others stay, until none
gets better: first when a clear gesture fires, then how noise is averaged, then what counts as a
tap, then how the evidence that is needed falls over a touch. A point is on the front if no other
is at least as good in recall, in false alarms and in latency, and better in one. Among these the
cheapest is chosen, by the costs of a lost gesture, a false alarm and a second. The cost counts F1,
not recall: a wrong answer is worse than none.
"""

import dataclasses
import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import bundle, container
from controller.bundles.bundle import Bundle
from controller.recognition.debounce import DebounceSettings, Means
from controller.recognition.debounced_stream import fire, smooth
from controller.recognition.touch_position import PositionSpread
from controller.shared import files
from controller.shared.event_metric import Answer, Score, judge
from models.evaluation.event_counts import position_errors, tally
from models.evaluation.replay import Stream
from models.evaluation.scores import position_spread
from models.results.evaluation import Point, Tuning

# Values to try of each debounce setting, and the blocks that are searched together.
_SMOOTHING: Final = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0)
_ON: Final = (0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.93, 0.95, 0.97, 0.98, 0.99, 1.05)
BLOCKS: Final[tuple[dict[str, tuple[float, ...]], ...]] = (
    {
        "smoothing": _SMOOTHING,
        "on": _ON,
        "off": (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6),
    },
    {"smoothing": _SMOOTHING, "noise": (0.0, 0.05, 0.08, 0.12, 0.2)},
    {"least": (2.0, 0.5, 0.6, 0.7, 0.8, 0.9), "brief_s": (0.0, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1)},
    {
        "on": _ON,
        "wait_s": (0.0, 0.2, 0.3, 0.4, 0.6, 0.8),
        "late": (1.0, 0.6, 0.7, 0.8, 0.9, 0.95, 0.97),
    },
)
GRID: Final = {name: values for block in BLOCKS for name, values in block.items()}
ROUNDS: Final = 3  # over all blocks at most


LOST: Final = 1.0  # cost of each per cent of F1 that is missing
ALARM: Final = 5.0  # of one false alarm in an idle minute
WAIT: Final = 1.0  # of a second of latency
LATEST_S: Final = 0.42  # greatest median latency
GOAL: Final = (
    f"cost = {LOST:g} × per cent of F1 lost + {ALARM:g} × false alarms per idle minute + {WAIT:g} "
    f"× seconds of latency; at most a median of {LATEST_S:g} s"
)


def cost(point: Point) -> float:
    """Return the cost of a point."""
    lost = LOST * 100.0 * (1.0 - point.f1)
    return lost + ALARM * point.false_alarms_per_min + WAIT * point.latency_s


def tune(labels: Sequence[str], now: DebounceSettings, streams: Sequence[Stream]) -> Tuning:
    """Replay development streams over the grids, and choose; raise ValueError without gestures.

    Args:
        labels: Those of the bundle, "null" first.
        now: Its present thresholds, which are tried as well.
        streams: Nothing that is reported is measured on them.
    """
    events = sum(len(stream.truth.events) for stream in streams)
    if not events:
        raise ValueError("there are no gestures in these recordings; tune on labelled ones")
    idle = sum(tally(stream, labels).idle_minutes for stream in streams)
    found: dict[DebounceSettings, Point] = {}
    best, least, steps = now, math.inf, 0
    for block in itertools.islice(itertools.cycle(BLOCKS), ROUNDS * len(BLOCKS)):
        named = (
            dict(zip(block, values, strict=True)) for values in itertools.product(*block.values())
        )
        grid = {dataclasses.replace(best, **some) for some in named}  # type: ignore[arg-type]
        scores = _scores(streams, labels, (grid | {now}) - set(found))
        found |= {settings: _point(settings, score, idle) for settings, score in scores.items()}
        points = list(found.values())
        edge = front(points)
        chosen = choose(edge, points, events)
        spent = cost(chosen)
        steps = 0 if spent < least - 1e-9 else steps + 1
        if spent < least:
            best, least = chosen.settings, spent
        if steps == len(BLOCKS):
            break
    before = found[now]
    return Tuning(
        sessions=len(streams),
        events=events,
        before=before,
        chosen=chosen,
        front=tuple(edge),
        tried=len(points),
    )


def front(points: Sequence[Point]) -> list[Point]:
    """Return the points with a latency that no other beats, the fastest first."""
    ranked = sorted(
        (p for p in points if np.isfinite(p.latency_s)),
        key=lambda p: (p.latency_s, -p.recall, p.false_alarms_per_min, -p.f1),
    )
    kept: list[Point] = []
    for point in ranked:  # a point that beats it is at least as fast, so it came before
        if not any(
            k.recall >= point.recall and k.false_alarms_per_min <= point.false_alarms_per_min
            for k in kept
        ):
            kept.append(point)
    return kept


def choose(edge: Sequence[Point], points: Sequence[Point], events: int) -> Point:
    """Return the cheapest point of the front that is fast enough, given the grid and its events.

    If none is, the fastest.
    Points that one event more or less would make equal count as equal; of these, the one whose
    neighbours in the grid are the cheapest on average is taken.
    """
    fast = [point for point in edge if point.latency_s <= LATEST_S + 1e-9]
    allowed = fast or edge[:1]
    least = min(map(cost, allowed)) + LOST * 100.0 / events
    places = np.array([_place(point) for point in points])
    costs = np.array([cost(point) for point in points])

    def around(point: Point) -> float:
        near = costs[(np.abs(places - _place(point)) <= 1).all(axis=1) & np.isfinite(costs)]
        return float(np.mean([cost(point), *near]))

    return min((point for point in allowed if cost(point) <= least + 1e-9), key=around)


def spread(streams: Sequence[Stream]) -> PositionSpread | None:
    """Return the position error over all frames of presses, for a `BARE` bundle; None: too few."""
    found = np.concatenate([position_errors(stream) for stream in streams])
    return position_spread(found[:, 0], found[:, 1:])


def write(
    path: Path,
    loaded: Path,
    settings: DebounceSettings,
    entry: str,
    far: PositionSpread | None = None,
) -> Bundle:
    """Write a bundle with other thresholds, card entry and position error (None: as it was)."""
    import tomli_w

    bundle.read(loaded)  # every byte of it is checked
    parts = container.unpack(files.read_bytes(loaded, container.MAX_BYTES))
    table = container.manifest(parts[container.MANIFEST])
    table["debounce"] = dataclasses.asdict(settings)
    card = table.pop("card")  # it stands last
    if far is not None:
        table["location"] = dataclasses.asdict(far)
    table["card"] = {**card, "tuned": entry}
    bundle.write(path, manifest=tomli_w.dumps(table).encode(), parts=container.content(parts))
    return bundle.read(path)


def _place(point: Point) -> NDArray[np.int64]:
    """Return the place of a point's settings in the grid, steps, (settings,)."""
    given = {name: getattr(point.settings, name) for name in GRID}
    return np.array([np.searchsorted(sorted(GRID[name]), own) for name, own in given.items()])


def _scores(
    streams: Sequence[Stream], labels: Sequence[str], grid: set[DebounceSettings]
) -> dict[DebounceSettings, Score]:
    """Return the score of each point of the grid, over all streams."""
    scores = {settings: Score() for settings in sorted(grid, key=_order)}
    for stream in streams:
        means: dict[tuple[float, float], Means] = {}
        for settings, score in scores.items():
            own = settings.smoothing, settings.noise
            if own not in means:  # one at a time, since the grid is in order
                means = {own: smooth(stream.probabilities, settings.weight(stream.idle))}
            fired = fire(
                means[own], settings, stream.truth.rate_hz, labels, stream.levels, stream.idle
            )
            answers = [Answer(float(stream.truth.t[at]), labels[kind]) for at, kind in fired]
            score.add(judge(stream.truth.events, answers))
    return scores


def _order(settings: DebounceSettings) -> tuple[object, ...]:
    return settings.smoothing, settings.noise, *dataclasses.astuple(settings)


def _point(settings: DebounceSettings, score: Score, idle_minutes: float) -> Point:
    return Point(
        settings,
        score.recall,
        score.f1,
        score.false_alarms / idle_minutes if idle_minutes else float("nan"),
        round(float(np.median(score.latencies_s)), 4) if score.latencies_s else float("nan"),
    )
