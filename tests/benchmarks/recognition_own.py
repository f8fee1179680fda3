"""A known gesture taught again, as one person does it: `controller teach --add NAME --user ID`.

    python -m tests.benchmarks.recognition_own [--bundle FILE] [--quick] [--json]

The usual simulated people are understood so well that nothing is to be gained. So others are
simulated: light ones, who touch half as deep; slow ones, who take two and a half times as long; and
hasty ones, who take two fifths of it. The gesture of which the bundle misses most on a first day is
taught on a second day from one or five examples, and the person's own network is judged on a third,
all on one orb. `own_recall` is the share of that gesture that is answered rightly; F1 and false
alarms are those of all four. `@KIND_0` is before the lesson; a lesson that the orb refuses leaves
everything as it was. Intervals are 95 %, by resampling people.
"""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller import adapt
from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.head import EVERYBODY
from controller.bundles.inference.networks import Recognizer
from controller.recordings.recording import Recording
from controller.simulator.hand.user_style import UserStyle
from controller.simulator.orb import PRESETS
from models.data.ground_truth import GroundTruth
from models.data.simulate import DataSet
from models.evaluation import bootstrap
from models.evaluation.event_counts import Tally, tally
from models.evaluation.replay import run
from models.results.evaluation import Figure

from .recognition_few import alarms, examples, f1, taught_bundle
from .results import BENCHMARK_SEED, Results, command_line, figure_row

SEED: Final = BENCHMARK_SEED + 8  # people that nothing else here sees
EXAMPLES: Final = (1, 5)
MINUTES: Final = (3.0, 1.5, 6.0)  # of the day before, of the lesson's, and of the one judged
WHO: Final = "ada"
_DEPTHS: Final = ("press_depth", "pinch_depth", "twist_depth")
_TIMES: Final = ("press_hold", "pinch_close", "twist_time")


def _scaled(style: UserStyle, names: tuple[str, ...], factor: float) -> UserStyle:
    values: dict[str, Any] = {name: factor * getattr(style, name) for name in names}
    return dataclasses.replace(style, **values)


KINDS: Final[dict[str, Callable[[UserStyle], UserStyle]]] = {
    "usual": lambda style: style,
    "light": lambda style: _scaled(style, _DEPTHS, 0.5),
    "slow": lambda style: _scaled(style, _TIMES, 2.5),
    "hasty": lambda style: _scaled(style, _TIMES, 0.4),
}


class Unusual(DataSet):
    """People of a kind that no training met."""

    __slots__ = ()

    kind = "usual"

    def style(self, user: int) -> UserStyle:
        """Return how a user of this kind touches."""
        return KINDS[type(self).kind](DataSet.style(self, user))


def people(kind: str) -> type[Unusual]:
    """Return the data sets of a kind of people."""
    return type(kind, (Unusual,), {"__slots__": (), "kind": kind})


def measure(results: Results, path: Path, preset: str, users: int) -> None:
    """Note every result of one preset."""
    loaded = bundles.read(path)
    for kind in KINDS:
        told = [_person(path, loaded, preset, kind, user) for user in range(users)]
        refused = sum(one.refused for one in told)
        print(f"{preset}, {kind}: {[one.label for one in told]}; {refused} lessons refused")
        numbers = [one.number for one in told]
        for k in (0, *EXAMPLES):
            for name, figure in _figures([one.tallies[k] for one in told], numbers).items():
                unit = "1/min" if "alarms" in name else "1"
                results.keep(figure_row(f"own_{name}@{kind}_{k}", figure, unit, preset=preset))


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What came of one person's lessons."""

    label: str  # what was taught
    number: int  # its class
    tallies: dict[int, Tally]  # what was counted on the day judged, by examples
    refused: int  # lessons that were


def _person(path: Path, loaded: Bundle, preset: str, kind: str, user: int) -> Outcome:
    """Find out what of somebody is understood worst, teach it, and judge."""
    gestures = loaded.labels[1:]

    def session(day: int, wanted: tuple[str, ...] = gestures) -> Recording:
        data = people(kind)(SEED, MINUTES[day], preset=preset, gestures=wanted, one_orb=True)
        return data.session(user, day)

    first = _count(loaded, session(0))
    number = 1 + int(np.argmin(_recall(first)))
    label = loaded.labels[number]
    judged, taught = session(2), session(1, (label,))
    rng = np.random.default_rng([SEED, user])
    shown = [
        dataclasses.replace(one, user=WHO, rotations="none", mirrored=False)
        for one, _ in examples(loaded, taught, label, rng)
    ]
    tallies, refused = {0: _count(loaded, judged)}, 0
    for k in EXAMPLES:
        try:
            tallies[k] = _count(_taught(path, shown[:k]), judged)
        except adapt.AdaptError:
            tallies[k], refused = tallies[0], refused + 1
    return Outcome(label, number, tallies, refused)


def _recall(counted: Tally) -> list[float]:
    right, every = np.diagonal(counted.answered)[1:], counted.answered[1:].sum(axis=1)
    return [float(one) for one in right / np.maximum(every, 1)]


def _count(bundle: Bundle, recording: Recording) -> Tally:
    known = GroundTruth.of(recording, bundle.labels, "own")
    return tally(run(bundle, Recognizer(bundle), recording, known), bundle.labels)


def _taught(path: Path, shown: list[adapt.Example]) -> Bundle:
    """Return a bundle whose rows for all users are the person's own."""
    made = taught_bundle(path, shown)
    return dataclasses.replace(made, taught={EVERYBODY: made.taught[WHO]})


def _figures(tallies: list[Tally], numbers: list[int]) -> dict[str, Figure]:
    rows = [one.answered[number] for one, number in zip(tallies, numbers, strict=True)]
    right = [int(row[number]) for row, number in zip(rows, numbers, strict=True)]
    recall = bootstrap.share(right, [int(row.sum()) for row in rows])
    return {"recall": recall, "f1": f1(tallies), "false_alarms_per_min": alarms(tallies)}


def main() -> None:
    parser = command_line(__doc__, bundle=bundles.default_path(), quick=False)
    parser.add_argument("--preset", choices=tuple(PRESETS), help="default: all")
    options, results = parser.parse_args(), Results("recognition_own")
    for preset in [options.preset] if options.preset else PRESETS:
        measure(results, options.bundle, preset, 1 if options.quick else 8)
    results.finish(options.json)


if __name__ == "__main__":
    main()
