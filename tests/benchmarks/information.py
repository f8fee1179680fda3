"""Section 6 on simulated sessions: does a preset carry what the paper's recordings carried?

    python -m tests.benchmarks.information [--seeds N] [--json]

For each preset and seed: two class-block sessions of one user, 34,795 frames, button labels,
z = C / C0 with C0 the mean of the first ten seconds, 25 bins, scaled for each sensor and gesture
on its own as in the paper. That scaling hangs on single outliers: `clipped` says what becomes of
the figures when one frame in a thousand is cut off at either end of each sensor and gesture.
"""

import argparse
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.simulator.presets import PRESETS
from controller.simulator.session import TEST_SEEDS, simulate
from models.information.histogram import (
    PAPER_FRAMES,
    PAPER_H_Z,
    PAPER_INFORMATION,
    PAPER_STATIC,
    histogram_statistics,
)

MINUTES = 29.2  # two such sessions hold the paper's frames
REST_FRAMES = 100  # paper, section 4.1: the first ten seconds
OUTLIERS = 0.001


def recorded(preset: str, seed: int) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """Return z, (PAPER_FRAMES, taxels), and the button's labels of one user's two sessions."""
    signals, labels = [], []
    for run in range(2):
        session = simulate(
            TEST_SEEDS.start + 10 * seed + run,
            MINUTES,
            user=seed,
            model=PRESETS[preset],
            protocol="blocks",
        )
        z = session.frames / session.frames[:REST_FRAMES].mean(axis=0)
        signals.append(z.reshape(len(z), -1).astype(np.float64))
        labels.append(session.button)
    return np.concatenate(signals)[:PAPER_FRAMES], np.concatenate(labels)[:PAPER_FRAMES]


def clip(z: NDArray[np.float64], y: NDArray[np.int8]) -> NDArray[np.float64]:
    """Cut the outliers of each sensor and gesture off."""
    out = z.copy()
    for label in np.unique(y):
        group = y == label
        out[group] = np.clip(z[group], *np.quantile(z[group], [OUTLIERS, 1 - OUTLIERS], axis=0))
    return out


def measure(preset: str, seed: int) -> dict[str, float]:
    """Return the figures of one seed, nats."""
    z, y = recorded(preset, seed)
    paper = histogram_statistics(z, y)
    together = histogram_statistics(z, y, scaling="global")
    clipped = histogram_statistics(clip(z, y), y)
    return {
        "p_static": float((y == 0).mean()),
        "h_y": paper.h_y,
        "h_z": float(paper.h_z.mean()),
        "information": float(paper.information.mean()),
        "information_global": float(together.information.mean()),
        "h_z_clipped": float(clipped.h_z.mean()),
        "information_clipped": float(clipped.information.mean()),
    }


GOALS = {"p_static": PAPER_STATIC, "h_z": PAPER_H_Z, "information": PAPER_INFORMATION}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    results: list[dict[str, Any]] = []
    for preset in PRESETS:
        rows = [measure(preset, seed) for seed in range(arguments.seeds)]
        print(f"\n{preset}: mean (least ... greatest) of {arguments.seeds} seeds, nats")
        for name in rows[0]:
            values = np.array([row[name] for row in rows])
            goal = GOALS.get(name)
            aim = f"   paper: {goal:g}" if goal is not None else ""
            spread = f"({values.min():.3f} ... {values.max():.3f})"
            print(f"  {name:20} {values.mean():6.3f} {spread}{aim}")
            result = {"name": name, "preset": preset, "value": float(values.mean())}
            results.append({**result, "unit": "1" if name == "p_static" else "nats", "goal": goal})
    if arguments.json:
        print(json.dumps({"benchmark": "information", "results": results}))


if __name__ == "__main__":
    main()
