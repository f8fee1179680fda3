"""Speed of the virtual orb: frames per second and core, whole sessions with hand and labels.

    python -m tests.benchmarks.simulator [--minutes N] [--repeats N] [--json]

CPU time of this process, which has one thread; median (least ... greatest) of the repetitions.
`touched` simulates only frames that a finger touches. Grids cover the paper's area, and the dome
grows where they need it; `online` asks for one frame at a time, as a host does.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.protocol.messages import Contact
from controller.simulator.hand.gesture_file import shipped
from controller.simulator.hand.performance import GESTURES
from controller.simulator.hand.session_script import SessionScript
from controller.simulator.hand.user_style import draw_style
from controller.simulator.orb import NOMINAL, PRESETS, OrbModel, OrbSimulator
from controller.simulator.session import Session, simulate
from controller.simulator.virtual_orb import VirtualOrb

from .results import Results, command_line

GOAL: Final = 10_000.0  # BENCHMARKS: at least 40 % of the frames touched
GRIDS: Final = ((5, 10.0), (10, 5.0), (20, 2.5))  # taxels along a side, pitch in mm
RATES: Final = (10.0, 20.0, 50.0, 100.0, 200.0)
ONLINE_FRAMES: Final = 300


def fps(work: Callable[[int], int], repeats: int) -> list[float]:
    """Return frames per CPU second of each repetition; `work` returns its number of frames."""
    rates = []
    for seed in range(repeats):
        start = time.process_time()
        frames = work(seed)
        rates.append(frames / (time.process_time() - start))
    return rates


def touched_share(session: Session) -> float:
    """Return the share of frames that a finger touches."""
    return float((~np.isnan(session.contact[:, :, 2])).any(axis=1).mean())


def touched_paths(model: OrbModel, minutes: float) -> tuple[NDArray[Any], ...]:
    """Return a session's finger paths without the frames that no finger touches."""
    simulator = OrbSimulator(np.random.SeedSequence(0), model=model)
    rng = np.random.default_rng(0)
    steps_hz = 1.0 / simulator.step_s
    grid = (model.rows, model.columns, model.pitch_mm)
    steps = round(600 * minutes) * simulator.steps_per_frame
    hand = SessionScript(steps, steps_hz, grid, draw_style(rng), (0.0, 0.0), shipped(), rng)
    hand.stream(GESTURES)
    frames = hand.depth_mm.reshape(-1, simulator.steps_per_frame * hand.depth_mm.shape[1])
    keep = np.repeat(frames.any(axis=1), simulator.steps_per_frame)
    return hand.point[keep], hand.depth_mm[keep], hand.radius_mm[keep]


def touched_only(model: OrbModel, paths: tuple[NDArray[Any], ...], seed: int) -> int:
    """Simulate the touched frames."""
    simulator = OrbSimulator(np.random.SeedSequence(seed), model=model)
    return len(simulator.advance(*paths))


def online(fingers: int, seed: int) -> int:
    """Ask a virtual orb for single frames while so many fingers of a host slide on it."""
    orb = VirtualOrb(seed)
    for k in range(1, ONLINE_FRAMES + 1):
        x = 2.0 + np.sin(k / 5)
        orb.touch([Contact(i, x, i + 0.5, 8.0, 7.0) for i in range(fingers)], (k - 0.5) / 10)
        orb.read(k / 10)
    return ONLINE_FRAMES


def main() -> None:
    arguments = command_line(__doc__, minutes=20.0, repeats=7).parse_args()
    minutes, repeats = arguments.minutes, arguments.repeats
    results = Results("simulator")
    note = partial(results.spread, unit="frames/s")

    def session(model: OrbModel, rate_hz: float = 10.0) -> Callable[[int], int]:
        length = minutes * 10.0 / rate_hz
        return lambda seed: len(simulate(seed, length, model=model, rate_hz=rate_hz).frames)

    warm = {preset: simulate(0, minutes, model=model) for preset, model in PRESETS.items()}
    print(f"sessions of {minutes:g} min, {repeats} repetitions; frames per CPU second")
    for preset, one in warm.items():
        share = 100.0 * touched_share(one)
        rates = fps(session(PRESETS[preset]), repeats)
        note("simulator_fps", rates, preset=preset, goal=GOAL)
        print(f"{'  frames touched':28} {preset:10} {share:9.0f} %")
        paths = touched_paths(PRESETS[preset], minutes)
        model = PRESETS[preset]
        rates = fps(lambda seed, m=model, p=paths: touched_only(m, p, seed), repeats)  # type: ignore[misc]
        note("simulator_fps_touched", rates, preset=preset)
    for side, pitch_mm in GRIDS:
        model = replace(NOMINAL, rows=side, columns=side, pitch_mm=pitch_mm)
        note(f"simulator_fps_{side}x{side}", fps(session(model), 3), preset="nominal")
    for rate_hz in RATES:
        rates = fps(session(NOMINAL, rate_hz), 3)
        note(f"simulator_fps_{rate_hz:g}hz", rates, preset="nominal")
    for fingers in (0, 1, 4):
        rates = fps(lambda seed, n=fingers: online(n, seed), repeats)  # type: ignore[misc]
        note(f"simulator_fps_online_{fingers}", rates, preset="nominal")
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
