"""A new gesture from one, three or five examples: the few-shot rows of the recognition benchmark.

    python -m tests.benchmarks.recognition_few [--bundle FILE] [--quick] [--spans] [--json]

Four gestures that the network never saw, each taught by several people in a short session and
judged on another of the same person's, on another orb, together with the old ones. What is taught
is cut as a cue cuts it. `few_shot_K` is the event accuracy of the new gesture, `..._answered` the
share that was answered rightly, as a player meets it, `..._second_per_min` how often one is
answered again until 1.5 s after its end (after .5 s that is a false alarm, too), `..._old_loss`
what the old ones lose on the same streams, in points; F1 is that of all five together, false alarms
are beside those of the untaught bundle. Intervals are 95 %, by resampling sessions. A double tap is
answered as a press by its first tap; that is why F1 is below event accuracy.

`lesson_spans` is the share of examples of old and new gestures whose touch is found: both ends
within .15 s of the truth (from 40 % of the depth to the end of contact), or an intersection over
union of at least .7, since a slow touch has no sharp ends. `--spans` measures it alone.
"""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Final
from unittest.mock import patch

import numpy as np

from controller import adapt
from controller.adapt import few_shot
from controller.adapt.examples import touched
from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.images.preprocess import Preprocessor
from controller.recordings.recording import Recording
from controller.shared.event_metric import attach
from controller.simulator.orb import PRESETS
from models.data.ground_truth import GroundTruth
from models.data.simulate import DataSet
from models.evaluation import bootstrap
from models.evaluation.event_counts import Tally, tally
from models.evaluation.replay import Stream, run
from models.results.evaluation import Figure

from .results import BENCHMARK_SEED, Results, command_line, figure_row

KNOCK: Final = Path(__file__).parents[2] / "examples" / "knock" / "knock.toml"
NEW: Final = ("double_tap", "squeeze", "swipe", "knock")
EXAMPLES: Final = (1, 3, 5)
GOALS: Final = {1: 0.70, 3: 0.90, 5: 0.95}
ANSWERED: Final = {1: (0.88, 0.75), 3: (0.94, 0.75), 5: (0.96, 0.90)}  # by preset
SECOND_PER_MIN: Final = 0.1
SECOND_S: Final = 1.5  # after a touch, until which another right answer is a second one
EDGE_S: Final = 0.15  # greatest error of both ends of a span, or ...
OVERLAP: Final = 0.7  # ... least intersection over union
SEED: Final = BENCHMARK_SEED + 5  # people that nothing else here sees
TEACHING_MIN: Final = 1.5
LEAD_S: Final = 1.3  # of rest before a cue's go
ROWS: Final[dict[str, tuple[str, tuple[float, float] | None]]] = {
    name: row
    for k in EXAMPLES
    for name, row in {
        f"few_shot_{k}": ("1", (GOALS[k], GOALS[k])),
        f"few_shot_{k}_answered": ("1", ANSWERED[k]),
        f"few_shot_{k}_second_per_min": ("1/min", (SECOND_PER_MIN, SECOND_PER_MIN)),
        f"few_shot_{k}_old_loss": ("points", (0.5, 0.5)),
        f"few_shot_{k}_f1": ("1", None),
        f"few_shot_{k}_false_alarms_per_min": ("1/min", None),
    }.items()
} | {
    "few_shot_0_false_alarms_per_min": ("1/min", None),
    "lesson_spans": ("1", (0.95, 0.95)),
}


@dataclasses.dataclass(frozen=True, slots=True)
class Size:
    """How much is measured."""

    users: int = 10  # people, each with every gesture
    draws: int = 1  # sets of examples of each
    minutes: float = 6.0  # of the session that is judged


QUICK: Final = Size(users=1, draws=1, minutes=3.0)
Counted = tuple[Tally, int]  # of a session, and the second answers of its last label
Outcome = tuple[Counted, Counted]  # of the untaught bundle on a session, and of the taught one


def measure(path: Path, loaded: Bundle, preset: str, size: Size) -> dict[str, Figure]:
    """Return every figure of a bundle on one preset."""
    found: dict[int, list[Outcome]] = {k: [] for k in EXAMPLES}
    for label in NEW:
        for user in range(size.users):
            for k, outcome in _person(path, loaded, preset, label, user, size):
                found[k].append(outcome)
    figures: dict[str, Figure] = {}
    for k, outcomes in found.items():
        figures |= _figures(k, outcomes)
        new = " ".join(f"{name} {_of(outcomes, name):.3f}" for name in NEW)
        print(f"{preset}, {k} examples, {len(outcomes)} lessons: {new}", flush=True)
    before = [one for (one, _), _ in found[EXAMPLES[0]]]
    figures["few_shot_0_false_alarms_per_min"] = alarms(before)
    return figures | spans(loaded, preset, size)


def spans(loaded: Bundle, preset: str, size: Size) -> dict[str, Figure]:
    """Return the share of examples, by lesson, whose touch is found as the simulator made it."""
    right, every = [], []
    for label in (*loaded.labels[1:], *NEW):
        for user in range(size.users):
            lesson = _data(loaded, preset, (label,), TEACHING_MIN).session(user, 0)
            rng = np.random.default_rng([SEED, user])
            found = [_found(loaded, *one) for one in examples(loaded, lesson, label, rng)]
            right.append(sum(found))
            every.append(len(found))
        of = slice(-size.users, None)
        print(f"{preset}, spans of {label}: {sum(right[of])} of {sum(every[of])}", flush=True)
    return {"lesson_spans": bootstrap.share(right, every)}


def _found(loaded: Bundle, example: adapt.Example, truth: tuple[float, float]) -> bool:
    """Return whether an example's touch is found about where it is in truth, frames."""
    begin, end = touched(example.images, loaded.rate_hz)[-1].span
    if max(abs(begin - truth[0]), abs(end - truth[1])) <= EDGE_S * loaded.rate_hz:
        return True
    both = min(end, truth[1]) - max(begin, truth[0])
    return both >= OVERLAP * (max(end, truth[1]) - min(begin, truth[0]))


def _person(
    path: Path, loaded: Bundle, preset: str, label: str, user: int, size: Size
) -> Iterator[tuple[int, Outcome]]:
    """Let one person teach one gesture, from few examples and more, and judge each time."""
    labels = (*loaded.labels, label)
    lesson = _data(loaded, preset, (label,), TEACHING_MIN).session(user, 0)
    judged = _data(loaded, preset, labels[1:], size.minutes).session(user, 1)
    known = GroundTruth.of(judged, labels, f"{label} {user + 1}")

    def count(bundle: Bundle) -> Counted:
        stream = run(bundle, Recognizer(bundle), judged, known)
        return tally(stream, labels), _second(stream, label)

    before = count(loaded)
    rng = np.random.default_rng([SEED, user])
    shown = [one for one, _ in examples(loaded, lesson, label, rng)]
    for k in EXAMPLES:
        for draw in range(size.draws):
            some = shown[draw * k : draw * k + k]
            if len(some) == k:
                with patch.object(few_shot, "LEAST_KEPT", 0.0):  # what is lost is measured here
                    taught = taught_bundle(path, some)
                yield k, (before, count(taught))


def _second(stream: Stream, label: str) -> int:
    """Return how often a gesture is answered again until `SECOND_S` after its touch."""
    owners = attach(stream.truth.events, stream.answers, SECOND_S)
    right = [
        owner
        for answer, owner in zip(stream.answers, owners, strict=True)
        if owner >= 0 and answer.kind == stream.truth.events[owner].kind == label
    ]
    return len(right) - len(set(right))


def _data(loaded: Bundle, preset: str, gestures: tuple[str, ...], minutes: float) -> DataSet:
    return DataSet(
        seed=SEED,
        minutes=minutes,
        preset=preset,
        rate_hz=loaded.rate_hz,
        rows=loaded.rows,
        columns=loaded.columns,
        pitch_mm=loaded.pitch_mm,
        gestures=gestures,
        files=(KNOCK,),
    )


def examples(
    loaded: Bundle, taught: Recording, label: str, rng: np.random.Generator
) -> Iterator[tuple[adapt.Example, tuple[float, float]]]:
    """Yield examples, each with the frames at which its touch begins and ends in truth.

    They are cut as cues cut them: a player reacts to go, and rest comes a little after.
    """
    stage = Preprocessor(loaded.preprocess, loaded.rows, loaded.columns)
    steps = [stage.step(frame) for frame in taught.frames]
    images = np.array([step.image for step in steps])
    assert taught.truth is not None
    for event in taught.truth.events:
        go_s = event.onset_s - rng.uniform(0.2, 0.7)
        rest_s = event.release_s + rng.uniform(0.3, 0.6)
        first, end = np.searchsorted(taught.t, (go_s - LEAD_S, rest_s)).tolist()
        if event.kind != label or first == 0 or not steps[first].ready:
            continue
        example = adapt.Example(label, images[first:end], rotations="all", mirrored=True)
        if example.found(loaded.rate_hz) is not None:  # else the cue would ask for it again
            edges = np.interp((event.onset_s, event.release_s), taught.t, range(len(taught.t)))
            yield example, (float(edges[0]) - first, float(edges[1]) - first)


def taught_bundle(path: Path, examples: list[adapt.Example]) -> Bundle:
    """Return the bundle that a lesson makes."""
    made = adapt.teach(path.read_bytes(), examples)
    return bundles.parse(bundles.assembled(made.manifest, made.parts))


def _figures(k: int, outcomes: list[Outcome]) -> dict[str, Figure]:
    after = [one for _, (one, _) in outcomes]
    second = [count for _, (_, count) in outcomes]
    new = [(int(t.named[-1, -1]), int(t.named[-1].sum())) for t in after]
    right_before = [int(np.trace(one.named[1:-1, 1:-1])) for (one, _), _ in outcomes]
    right_after = [int(np.trace(t.named[1:-1, 1:-1])) for t in after]
    old = [int(t.named[1:-1].sum()) for t in after]
    lost = np.array(right_before) - np.array(right_after)
    loss = bootstrap.rate(100.0 * lost, old)
    return {
        f"few_shot_{k}": bootstrap.share([n for n, _ in new], [of for _, of in new]),
        f"few_shot_{k}_answered": bootstrap.share(
            [int(t.answered[-1, -1]) for t in after], [int(t.answered[-1].sum()) for t in after]
        ),
        f"few_shot_{k}_second_per_min": bootstrap.rate(second, [t.minutes for t in after]),
        f"few_shot_{k}_old_loss": loss,
        f"few_shot_{k}_f1": f1(after),
        f"few_shot_{k}_false_alarms_per_min": alarms(after),
    }


def f1(tallies: list[Tally]) -> Figure:
    answers = [int(t.answers.sum()) for t in tallies]
    return bootstrap.f1([t.hits for t in tallies], answers, [t.events for t in tallies])


def alarms(tallies: list[Tally]) -> Figure:
    """Return false alarms a minute over sessions."""
    return bootstrap.rate([t.false_alarms for t in tallies], [t.idle_minutes for t in tallies])


def _of(outcomes: list[Outcome], label: str) -> float:
    mine = [one for _, (one, _) in outcomes if one.name.startswith(f"{label} ")]
    return float(sum(t.named[-1, -1] for t in mine) / max(1, sum(t.named[-1].sum() for t in mine)))


def main() -> None:
    parser = command_line(__doc__, bundle=bundles.default_path(), quick=False)
    parser.add_argument("--preset", choices=tuple(PRESETS), help="default: all")
    parser.add_argument("--spans", action="store_true", help="of lessons alone: a minute")
    options, results = parser.parse_args(), Results("recognition_few")
    loaded = bundles.read(options.bundle)
    for preset in [options.preset] if options.preset else PRESETS:
        size = QUICK if options.quick else Size()
        if options.spans:
            figures = spans(loaded, preset, size)
        else:
            figures = measure(options.bundle, loaded, preset, size)
        for name, figure in figures.items():
            unit, goals = ROWS[name]
            goal = None if goals is None else goals[list(PRESETS).index(preset)]
            results.keep(figure_row(name, figure, unit, preset=preset, goal=goal))
    results.finish(options.json)


if __name__ == "__main__":
    main()
