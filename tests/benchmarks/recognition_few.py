"""A new gesture from one, three or five examples: the few-shot rows of the recognition benchmark.

    python -m tests.benchmarks.recognition_few [--bundle FILE] [--quick] [--json]

Four gestures that the network never saw, each taught by several people in a short session and
judged on another of the same person's, on another orb, together with the old ones. What is taught
is cut as a cue cuts it. `few_shot_K` is the event accuracy of the new gesture, `..._answered` the
share that was answered rightly, as a player meets it, `..._old_loss` what
the old ones lose on the same streams, in points; F1 is that of all five together, false alarms are
beside those of the untaught bundle. Intervals are 95 %, by resampling sessions. A double tap is
answered as a press by its first tap; that is why F1 is below event accuracy.
"""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Final
from unittest.mock import patch

import numpy as np

from controller import adapt
from controller.adapt import few_shot
from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.recognition.images.preprocess import Preprocessor
from controller.recordings.recording import Recording
from controller.simulator.orb import PRESETS
from models.data.ground_truth import GroundTruth
from models.data.simulate import BENCHMARK_SEED, DataSet
from models.evaluation import bootstrap
from models.evaluation.event_counts import Tally, tally
from models.evaluation.replay import Batched, debounced_stream, network_inputs
from models.results.evaluation import Figure

from .results import Results, command_line, figure_row

KNOCK: Final = Path(__file__).parents[2] / "examples" / "knock" / "knock.toml"
NEW: Final = ("double_tap", "squeeze", "swipe", "knock")
EXAMPLES: Final = (1, 3, 5)
GOALS: Final = {1: 0.70, 3: 0.90, 5: 0.95}
SEED: Final = BENCHMARK_SEED + 5  # people that nothing else here sees
TEACHING_MIN: Final = 1.5
LEAD_S: Final = 1.3  # of rest before a cue's go
ROWS: Final[dict[str, tuple[str, tuple[float, float] | None]]] = {
    name: row
    for k in EXAMPLES
    for name, row in {
        f"few_shot_{k}": ("1", (GOALS[k], GOALS[k])),
        f"few_shot_{k}_answered": ("1", None),
        f"few_shot_{k}_old_loss": ("points", (0.5, 0.5)),
        f"few_shot_{k}_f1": ("1", None),
        f"few_shot_{k}_false_alarms_per_min": ("1/min", None),
    }.items()
} | {"few_shot_0_false_alarms_per_min": ("1/min", None)}


@dataclasses.dataclass(frozen=True, slots=True)
class Size:
    """How much is measured."""

    users: int = 10  # people, each with every gesture
    draws: int = 1  # sets of examples of each
    minutes: float = 6.0  # of the session that is judged


QUICK: Final = Size(users=1, draws=1, minutes=3.0)
Outcome = tuple[Tally, Tally]  # of the untaught bundle on a session, and of the taught one


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
    before = [one for one, _ in found[EXAMPLES[0]]]
    figures["few_shot_0_false_alarms_per_min"] = alarms(before)
    return figures


def _person(
    path: Path, loaded: Bundle, preset: str, label: str, user: int, size: Size
) -> Iterator[tuple[int, Outcome]]:
    """Let one person teach one gesture, from few examples and more, and judge each time."""
    labels = (*loaded.labels, label)
    lesson = _data(loaded, preset, (label,), TEACHING_MIN).session(user, 0)
    judged = _data(loaded, preset, labels[1:], size.minutes).session(user, 1)
    known = GroundTruth.of(judged, labels, f"{label} {user + 1}")
    inputs = network_inputs(judged.frames, loaded.preprocess)

    def count(bundle: Bundle) -> Tally:
        answers = Batched(bundle).probabilities(inputs.windows)
        more = np.zeros((len(answers), len(labels) - answers.shape[1]), dtype=np.float32)
        answers = np.concatenate([answers, more], axis=1)
        return tally(debounced_stream(known, inputs, answers, labels, bundle.debounce), labels)

    before = count(loaded)
    rng = np.random.default_rng([SEED, user])
    shown = list(examples(loaded, lesson, label, rng))
    for k in EXAMPLES:
        for draw in range(size.draws):
            some = shown[draw * k : draw * k + k]
            if len(some) == k:
                with patch.object(few_shot, "LEAST_KEPT", 0.0):  # what is lost is measured here
                    taught = taught_bundle(path, some)
                yield k, (before, count(taught))


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
) -> Iterator[adapt.Example]:
    """Yield examples as cues cut them: who is told go reacts, and rest comes a little after."""
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
            yield example


def taught_bundle(path: Path, examples: list[adapt.Example]) -> Bundle:
    """Return the bundle that a lesson makes."""
    made = adapt.teach(path.read_bytes(), examples)
    return bundles.parse(bundles.assembled(made.manifest, made.parts))


def _figures(k: int, outcomes: list[Outcome]) -> dict[str, Figure]:
    after = [one for _, one in outcomes]
    new = [(int(t.named[-1, -1]), int(t.named[-1].sum())) for t in after]
    right_before = [int(np.trace(one.named[1:-1, 1:-1])) for one, _ in outcomes]
    right_after = [int(np.trace(t.named[1:-1, 1:-1])) for t in after]
    old = [int(t.named[1:-1].sum()) for t in after]
    lost = np.array(right_before) - np.array(right_after)
    loss = bootstrap.rate(100.0 * lost, old)
    return {
        f"few_shot_{k}": bootstrap.share([n for n, _ in new], [of for _, of in new]),
        f"few_shot_{k}_answered": bootstrap.share(
            [int(t.answered[-1, -1]) for t in after], [int(t.answered[-1].sum()) for t in after]
        ),
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
    mine = [one for _, one in outcomes if one.name.startswith(f"{label} ")]
    return float(sum(t.named[-1, -1] for t in mine) / max(1, sum(t.named[-1].sum() for t in mine)))


def main() -> None:
    parser = command_line(__doc__, bundle=bundles.default_path(), quick=False)
    parser.add_argument("--preset", choices=tuple(PRESETS), help="default: all")
    options, results = parser.parse_args(), Results("recognition_few")
    loaded = bundles.read(options.bundle)
    for preset in [options.preset] if options.preset else PRESETS:
        figures = measure(options.bundle, loaded, preset, QUICK if options.quick else Size())
        for name, figure in figures.items():
            unit, goals = ROWS[name]
            goal = None if goals is None else goals[list(PRESETS).index(preset)]
            results.keep(figure_row(name, figure, unit, preset=preset, goal=goal))
    results.finish(options.json)


if __name__ == "__main__":
    main()
