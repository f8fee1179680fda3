"""Whole simulated sessions: a hand at play for minutes, with the truth beside every frame."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.events import Event
from controller.simulator.hand import (
    DISTRACTORS,
    GESTURES,
    MECHANICS_HZ,
    SLOTS,
    draw_mood,
    draw_style,
    perform,
)
from controller.simulator.orb import NOMINAL, OrbModel, OrbSimulator

LABELS: Final = ("null", *GESTURES)
TRAINING: Final = 0  # the domain of seeds that only training may use
EVALUATION: Final = 3  # sessions whose seeds training never saw
_LEAD_S: Final = 3.0  # quiet time before the first event
_DISTRACTED: Final = 0.22  # share of contacts that are no gestures


@dataclass(frozen=True, slots=True)
class Session:
    """One simulated session.

    Attributes:
        frames: Scans, float32 (frames, rows, columns), pF.
        time_s: End of each scan, (frames,).
        label: Index into `LABELS` of what truly happens, (frames,).
        touch: Where the finger of a press truly is, grid units, NaN otherwise, (frames, 2).
        events: True gestures in order.
        event: Index into `events` per frame, -1 between them, (frames,).
        distractors: (onset, release) of contacts that are no gestures.
    """

    frames: NDArray[np.float32]
    time_s: NDArray[np.float64]
    label: NDArray[np.int8]
    touch: NDArray[np.float32]
    events: tuple[Event, ...]
    event: NDArray[np.int32]
    distractors: tuple[tuple[float, float], ...]


def simulate(
    seed: int,
    minutes: float,
    *,
    domain: int = TRAINING,
    user: int | None = None,
    pointer: bool = False,
    rate_hz: float = 10.0,
    model: OrbModel = NOMINAL,
) -> Session:
    """Simulate one session: an orb, a user, and a mixed stream of gestures and distractors.

    Args:
        seed: Which session (orb, drift, order of events).
        minutes: Its length.
        domain: Family of seeds.
        user: Which user; by default the session's own.
        pointer: The touches are a pointer's on a screen, not a hand's.
        rate_hz: Frames per second.
        model: The orb's constants.
    """
    orb, people, order = np.random.SeedSequence([domain, seed]).spawn(3)
    if user is not None:
        people = np.random.SeedSequence([domain, 1_000_000 + user])
    rng = np.random.default_rng(order)
    style = draw_mood(draw_style(np.random.default_rng(people)), rng)
    style = replace(style, pointer=pointer)
    frames = round(minutes * 60 * rate_hz)
    simulator = OrbSimulator(orb, rate_hz, model=model)
    per_frame = simulator.steps_per_frame
    steps = frames * per_frame
    point = np.zeros((steps, SLOTS), dtype=np.complex128)
    depth, radius = np.zeros((steps, SLOTS)), np.full((steps, SLOTS), 7.0)
    time_s = np.asarray((np.arange(frames) + 1.0) / rate_hz, dtype=np.float64)
    label, event = np.zeros(frames, dtype=np.int8), np.full(frames, -1, dtype=np.int32)
    touch = np.full((frames, 2), np.nan, dtype=np.float32)
    events: list[Event] = []
    distractors: list[tuple[float, float]] = []
    now = _LEAD_S
    while True:
        kind = str(rng.choice(GESTURES if rng.random() > _DISTRACTED else DISTRACTORS))
        done = perform(kind, _place(kind, rng), style, rng)
        first = round(now * MECHANICS_HZ)
        last = first + len(done.point)
        if last + MECHANICS_HZ > steps:
            break
        point[first:last], depth[first:last] = done.point, done.depth_mm
        radius[first:last] = done.radius_mm
        start = first / MECHANICS_HZ
        onset, release = start + done.onset_s, start + done.release_s
        during = slice(*np.searchsorted(time_s, (onset, release)))
        if kind in GESTURES:
            label[during], event[during] = LABELS.index(kind), len(events)
            events.append(Event(onset, release, kind))
            if kind == "press":
                at = np.clip(np.rint(time_s[during] * MECHANICS_HZ).astype(int) - 1, 0, steps - 1)
                touch[during, 0] = point[at, 0].real / model.pitch_mm + (model.columns - 1) / 2
                touch[during, 1] = point[at, 0].imag / model.pitch_mm + (model.rows - 1) / 2
        else:
            distractors.append((onset, release))
        now = start + len(done.point) / MECHANICS_HZ + _pause(rng)
    return Session(
        simulator.advance(point, depth, radius),
        time_s,
        label,
        touch,
        tuple(events),
        event,
        tuple(distractors),
    )


def _place(kind: str, rng: np.random.Generator) -> tuple[float, float]:
    """Where an event is meant to be, grid units: presses anywhere, the others near the middle."""
    if kind in ("press", "brush", "rest"):
        return float(rng.uniform(0.0, 4.0)), float(rng.uniform(0.0, 4.0))
    x, y = 2.0 + rng.normal(0.0, 0.25, 2)
    return float(x), float(y)


def _pause(rng: np.random.Generator) -> float:
    """Time until the next event: mostly brisk play, now and then a long look, seconds."""
    return float(rng.uniform(3.0, 7.0) if rng.random() < 0.12 else rng.uniform(0.35, 1.5))
