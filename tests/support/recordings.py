"""Recordings for tests: simulated ones, whose truth is known, and some of given frames."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from controller.recordings import recording
from controller.simulator.dome.faults import Fault
from controller.simulator.orb import PRESETS, OrbModel
from controller.simulator.session import TEST_SEEDS, simulate
from controller.simulator.virtual_orb import VirtualOrb

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")


def origin(rows: int = 5, columns: int = 5, **changes: Any) -> recording.Provenance:
    """Where a recording of a small orb comes from."""
    usual = recording.Provenance("virtual-1", rows, columns, 10.0, 10.0, LABELS, "", "", "0.1.0")
    return replace(usual, **changes)


def of(
    frames: Any, about: recording.Provenance | None = None, **columns: Any
) -> recording.Recording:
    """A recording of these frames, ten a second; everything else may be given by name."""
    taken = np.asarray(frames, dtype=np.float32)
    n = len(taken)
    usual = {
        **recording.unlabelled(n),
        "t": np.arange(1, n + 1) / 10.0,
        "sequence": np.arange(1, n + 1),
        "excluded": np.zeros(n, dtype=np.bool_),
        "touch": np.full((n, 2), np.nan),
    }
    for name in recording.LABELLERS:
        if name in columns:
            columns[name] = np.asarray(columns[name], dtype=np.int16)
    return recording.Recording(about or origin(*taken.shape[1:]), taken, **{**usual, **columns})


def sound(preset: str) -> OrbModel:
    """An orb of a preset on which nothing is broken by chance."""
    model = PRESETS[preset]
    return replace(model, electronics=replace(model.electronics, dead=0.0, leaky=0.0))


@cache
def played(preset: str = "nominal", seed: int = 0, minutes: float = 2.0) -> recording.Recording:
    """A session of a hand that does all gestures, with truth and button."""
    session = simulate(TEST_SEEDS.start + seed, minutes, model=sound(preset))
    return of(
        session.frames,
        origin(user="01", session="01", preset=preset, seed=TEST_SEEDS.start + seed),
        label=session.label,
        button=session.button,
        truth=recording.SimulatedTruth(session.touch, session.contact[:, :3], session.events),
    )


@cache
def broken(*faults: str, preset: str = "nominal", seconds: float = 90.0) -> recording.Recording:
    """A session on an orb with these faults: a gesture every two seconds, here and there."""
    orb = VirtualOrb(7, 10.0, model=sound(preset))
    orb.switch([Fault.parse(fault) for fault in faults])
    rng = np.random.default_rng(7)
    frames, labels = [], []
    for k in range(1, round(seconds * 10) + 1):
        if k > 30 and k % 20 == 0:
            label = LABELS[1 + k // 20 % 4]
            x, y = rng.uniform(0.2, 3.8, 2) if label == "press" else (2.0, 2.0)
            orb.perform(k, label, float(x), float(y), k / 10)
        frames.append(orb.read(k / 10))
        labels.append(LABELS.index(orb.label(k / 10)))
    return of(np.array(frames), label=labels)
