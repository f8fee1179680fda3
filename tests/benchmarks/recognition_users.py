"""Identification of ten people: the rows `user_...` of tests/benchmarks/recognition.py.

    python -m tests.benchmarks.recognition_users [--quick] [--retrain] [--json]

Ten simulated people whom no training accepts make the paper's gesture (twists clockwise) or any of
the four, in four enrolment sessions and two new ones of four minutes each; ten others may be
learned from as nobody, and ten more are strangers. `user_accuracy` is the share of single gestures
in the new sessions whose maker the network names, among the ten. What follows `@` is another
protocol: windows at random, a block of time left out, or a new session, learned from one session of
each, as in the paper; with the drift alone drawn anew under the same hand, with the hand alone, on
another orb, without drift, and on images whose rest stays where it was. All share one orb.
Strangers are in `user_auroc`, `user_false_accepts`, `user_right` (named rightly) and `user_wrong`
(taken for another), by gestures seen, and by enrolment sessions where they are fewer.
Intervals are 95 %, by resampling whole sessions.

Results are kept in `--cache` by what they hang on, networks and all; `--retrain` measures anew,
some ten minutes of one core for each preset.
"""

import math
import os
from pathlib import Path
from typing import Final

from controller.simulator.orb import PRESETS
from models.data.test_sessions import BENCHMARK_SEED
from models.results.evaluation import Figure
from models.training.loop import prepare_torch
from tests.benchmarks import user_study as users

from .results import Results, Row, command_line, figure_row, show

SEED: Final = BENCHMARK_SEED + 1
GOAL: Final = 0.80
KEPT: Final = "users.json"


def rows(
    preset: str, size: users.Size, cache: Path, say: users.Say, *, again: bool = False
) -> list[Row]:
    """Return the rows of one preset, measuring what is not kept yet."""
    prepare_torch(SEED)
    path = cache / ("quick-" + KEPT if size == users.QUICK else KEPT)
    found = users.measure(preset, SEED, size, path, again=again)
    one, every, drift = found["one"], found["any"], found["drift"]
    say(
        f"{preset}: {size.users} people; {one['events']} twists in {one['sessions']} new sessions, "
        f"{every['events']} gestures of any kind; {size.strangers} strangers"
    )
    most = str(size.enrolled)
    listed = [_row("user_accuracy", preset, one["enrolled"][most]["seen"]["1"], GOAL)]
    listed += [
        _row(f"user_accuracy@{count}_enrolled", preset, told["seen"]["1"])
        for count, told in one["enrolled"].items() if count != most
    ]  # fmt: skip
    listed += [
        _row(f"user_accuracy@{seen}_gestures", preset, figure)
        for seen, figure in one["enrolled"][most]["seen"].items() if seen != "1"
    ]  # fmt: skip
    listed += [
        _row(
            f"user_accuracy@any_{seen}_gestures".replace("_1_gestures", "_gesture"), preset, figure
        )
        for seen, figure in every["enrolled"][most]["seen"].items()
    ]
    for images, protocols in drift.items():
        suffix = "" if images == "tracked" else f"_{images}"
        listed += [
            _row(f"user_accuracy@1_{protocol}{suffix}", preset, figure)
            for protocol, figure in protocols.items()
        ]
    for prefix, found in (("", one), ("any_", every)):
        for count, told in found["enrolled"].items():
            suffix = "" if count == most else f"_{count}_enrolled"
            listed += [
                _row(f"user_{name}@{prefix}{opened['seen']}_gestures{suffix}", preset,
                     {"value": opened[name]})
                for opened in told["open"] for name in ("auroc", "false_accepts", "right", "wrong")
            ]  # fmt: skip
    return listed


def _row(name: str, preset: str, figure: dict[str, float], goal: float | None = None) -> Row:
    found = Figure(*(figure.get(part, math.nan) for part in ("value", "low", "high")))
    return figure_row(name, found, preset=preset, goal=goal)


def main() -> None:
    """Measure and print."""
    parser = command_line(__doc__, quick=False, retrain=False, cache=cache())
    arguments, results = parser.parse_args(), Results("recognition_users")
    size = users.QUICK if arguments.quick else users.Size()
    for preset in PRESETS:
        made = rows(preset, size, arguments.cache, print, again=arguments.retrain)
        for row in made:
            show(row)
        results.rows += made
    results.finish(arguments.json)


def cache() -> Path:
    """Return where results are kept if nobody says otherwise."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "orbtouch"


if __name__ == "__main__":
    main()
