"""Information that the shipped bundle's answers carry about gestures, at its own rate.

    python -m tests.benchmarks.information_bundle

The people, the days and the bounds are those of `models information` (part classifier), whose
sessions are at 10 Hz; these are at the bundle's rate.
"""

from dataclasses import astuple
from typing import Any

from controller.bundles import bundle
from controller.simulator.orb import PRESETS
from models.data.simulate import DataSet
from models.studies.information import classifier_bound, study
from models.studies.information.histogram import entropy
from models.studies.information.windows import cut

from .results import Results, command_line, say


def measure(preset: str, minutes: float) -> dict[str, Any]:
    """Return entropies and bounds for one preset, in nats."""
    rate_hz = bundle.read(bundle.default_path()).rate_hz
    data = DataSet(seed=study.SEED, minutes=minutes, preset=preset, rate_hz=rate_hz)
    windows = cut([data.session(0, day) for day in range(study.DAYS)]).every(study.STEP)
    answers = study.shipped(windows)
    if answers is None:
        raise SystemExit("the bundle does not fit the simulated sessions")
    y, _ = classifier_bound.gestures(windows, answers.log_p)
    whole = float("nan")
    return {
        "h_y": [entropy(windows.y), whole, whole],
        "h_gesture": [entropy(y), whole, whole],
        "gestures": len(y),
        "window": list(astuple(classifier_bound.window_bound(windows, answers.log_p))),
        "gesture": list(astuple(classifier_bound.gesture_bound(windows, answers))),
    }


def main() -> None:
    """Print both presets' bounds."""
    arguments = command_line(__doc__, minutes=study.MINUTES).parse_args()
    results, sets = Results("information_bundle"), {}
    for preset in PRESETS:
        sets[preset] = found = measure(preset, arguments.minutes)
        say(f"{preset}: {found['gestures']} gestures")
        results.note("gesture_nats", found["gesture"][0], "nats", preset=preset)
    results.finish(arguments.json, sets=sets)


if __name__ == "__main__":
    main()
