"""An idle day: false alarms per hour on untouched orbs, at the shipped bundle's rate.

    python -m tests.benchmarks.idle [--hours N] [--bundle FILE] [--json]

Each hour is a session of its own, of another orb that drifts. The upper bound is that of 95 %, by
Poisson's law.
"""

from pathlib import Path
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.simulator.hand.performance import SLOTS
from controller.simulator.orb import PRESETS, OrbSimulator, preset

from .results import Results, command_line, say

SEED: Final = 930_000
MINUTES: Final = 6  # computed at once
_LN_20: Final = float(np.log(20.0))


def answers(loaded: Bundle, name: str, hour: int) -> int:
    """Return how many gestures fire in an hour without any touch."""
    seeds = np.random.SeedSequence([SEED, hour])
    simulator = OrbSimulator(seeds, loaded.rate_hz, model=preset(name))
    steps = simulator.steps_per_frame * round(MINUTES * 60 * loaded.rate_hz)
    pipeline, found = Pipeline(loaded.settings, Recognizer(loaded), loaded.mapping), 0
    for _ in range(60 // MINUTES):
        hand = np.zeros((steps, SLOTS), dtype=np.complex128)
        frames = simulator.advance(hand, np.zeros(hand.shape), np.full(hand.shape, 7.0))
        for frame in np.asarray(frames, dtype=np.float32):
            found += pipeline.step(frame, 0.0).gesture is not None
    return found


def main() -> None:
    """Print false alarms an hour, for each preset."""
    parser = command_line(__doc__, hours=24, bundle=bundles.default_path())
    arguments = parser.parse_args()
    loaded = bundles.read(Path(arguments.bundle))
    results = Results("idle")
    for name in PRESETS:
        total = 0
        for hour in range(arguments.hours):
            total += answers(loaded, name, hour)
            say(f"{name}: {total} in {hour + 1} of {arguments.hours} hours")
        most = _LN_20 if not total else total + 1.64 * np.sqrt(total) + 1.35
        results.note(
            "idle_false_alarms_per_hour", total / arguments.hours, "1/h", preset=name,
            alarms=total, at_most=float(most) / arguments.hours,
        )  # fmt: skip
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
