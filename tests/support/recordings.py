"""Recordings for tests: simulated ones, whose truth is known, and drawn ones of any shape."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from controller.recognition.event_metric import Event
from controller.recognition.pipeline import CommandRecord
from controller.recordings.recording import (
    LABELLERS,
    UNKNOWN,
    Mark,
    Provenance,
    Recording,
    SimulatedTruth,
    unlabelled,
)
from controller.simulator.faults import Fault
from controller.simulator.orb import PRESETS, OrbModel
from controller.simulator.session import TEST_SEEDS, simulate
from controller.simulator.virtual_orb import VirtualOrb

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")


def origin(rows: int = 5, columns: int = 5, **changes: Any) -> Provenance:
    """Where a recording of a small orb comes from."""
    usual = Provenance("virtual-1", rows, columns, 10.0, 10.0, LABELS, "", "", "0.1.0")
    return replace(usual, **changes)


def of(frames: Any, about: Provenance | None = None, **columns: Any) -> Recording:
    """A recording of these frames, ten a second; everything else may be given by name."""
    taken = np.asarray(frames, dtype=np.float32)
    n = len(taken)
    usual = {
        **unlabelled(n),
        "t": np.arange(1, n + 1) / 10.0,
        "sequence": np.arange(1, n + 1),
        "excluded": np.zeros(n, dtype=np.bool_),
        "touch": np.full((n, 2), np.nan),
    }
    for name in LABELLERS:
        if name in columns:
            columns[name] = np.asarray(columns[name], dtype=np.int16)
    return Recording(about or origin(*taken.shape[1:]), taken, **{**usual, **columns})


def sound(preset: str) -> OrbModel:
    """An orb of a preset on which nothing is broken by chance."""
    model = PRESETS[preset]
    return replace(model, electronics=replace(model.electronics, dead=0.0, leaky=0.0))


@cache
def played(preset: str = "nominal", seed: int = 0, minutes: float = 2.0) -> Recording:
    """A session of a hand that does all gestures, with truth and button."""
    session = simulate(TEST_SEEDS.start + seed, minutes, model=sound(preset))
    return of(
        session.frames,
        origin(user="01", session="01", preset=preset, seed=TEST_SEEDS.start + seed),
        label=session.label,
        button=session.button,
        truth=SimulatedTruth(session.touch, session.contact[:, :3], session.events),
    )


@cache
def broken(*faults: str, preset: str = "nominal", seconds: float = 90.0) -> Recording:
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


def same(one: Recording, other: Recording) -> bool:
    """Whether two recordings are equal, bit for bit, but for the bits of a NaN."""

    def equal(a: Any, b: Any) -> bool:
        if a is None or b is None:
            return a is b
        if (a.dtype, a.shape) != (b.dtype, b.shape):
            return False
        if a.dtype.kind == "f" and (np.isnan(a) != np.isnan(b)).any():
            return False
        return bool(np.nan_to_num(a, nan=0.0).tobytes() == np.nan_to_num(b, nan=0.0).tobytes())

    columns = ("frames", "t", "sequence", *LABELLERS, "excluded", "touch", "rest")
    truths = [(r.truth.touch, r.truth.contact) if r.truth else (None, None) for r in (one, other)]
    events = [r.truth.events if r.truth else () for r in (one, other)]
    return (
        one.origin == other.origin
        and all(equal(getattr(one, name), getattr(other, name)) for name in columns)
        and (one.marks, one.commands) == (other.marks, other.commands)
        and one.state.keys() == other.state.keys()
        and all(equal(one.state[name], other.state[name]) for name in one.state)
        and all(equal(a, b) for a, b in zip(*truths, strict=True))
        and events[0] == events[1]
    )


# --- recordings of any shape ----------------------------------------------------------------------

_TEXT = st.text(max_size=12).map(lambda text: text.rstrip("\0"))  # NumPy keeps no NUL at an end
_NAME = _TEXT.filter(str.isprintable)
_NUMBER = st.floats(-1e8, 1e8)


def _rising(values: Sequence[float]) -> Any:
    return st.just(np.array(sorted(values), dtype=np.float64))


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    """Any recording that a file can hold."""
    n, rows, columns = (draw(st.integers(1, most)) for most in (6, 4, 3))
    labels = tuple(draw(st.lists(_NAME, min_size=1, max_size=4, unique=True)))
    about = origin(
        rows,
        columns,
        labels=labels,
        user=draw(_NAME),
        hardware=draw(_NAME),
        seed=draw(st.none() | st.integers(0, 2**40)),
        pitch_mm=draw(st.floats(1e-3, 1e3)),
    )

    def single(*shape: int) -> Any:
        wide = st.floats(-1e5, 1e5, width=32)
        return draw(arrays.arrays(np.float32, shape, elements=wide))

    def anywhere(kind: Any, *shape: int) -> Any:
        width = 8 * np.dtype(kind).itemsize
        elements = st.floats(width=width) if width == 64 else st.floats(width=32)
        return draw(arrays.arrays(kind, shape, elements=elements))

    times = draw(st.lists(_NUMBER, min_size=n, max_size=n, unique=True).flatmap(_rising))
    index = arrays.arrays(np.int16, n, elements=st.integers(UNKNOWN, len(labels) - 1))
    steps = draw(st.lists(st.integers(1, 2**40), min_size=n, max_size=n))
    touch = st.none() | st.tuples(_NUMBER, _NUMBER)
    command = st.builds(CommandRecord, _NUMBER, st.integers(0, 2**62), _TEXT, _NUMBER, touch, _TEXT)
    marks = draw(st.lists(st.builds(Mark, _NUMBER, _TEXT, _TEXT), max_size=3))
    event = st.builds(
        lambda onset, length, name: Event(onset, onset + length, name),
        _NUMBER, st.floats(0, 1e3), _TEXT,
    )  # fmt: skip
    truth = None
    if draw(st.booleans()):
        fingers = draw(st.integers(0, 2))
        truth = SimulatedTruth(
            anywhere(np.float32, n, 2),
            anywhere(np.float32, n, fingers, 3),
            tuple(draw(st.lists(event, max_size=2))),
        )
    state = arrays.arrays(np.float64, arrays.array_shapes(min_dims=0, min_side=0, max_side=3),
                          elements=_NUMBER)  # fmt: skip
    return of(
        single(n, rows, columns),
        about,
        t=times,
        sequence=np.cumsum(np.array(steps, dtype=np.int64)),
        **{name: draw(index) for name in LABELLERS},
        excluded=draw(arrays.arrays(np.bool_, n)),
        touch=anywhere(np.float64, n, 2),
        rest=single(rows, columns) if draw(st.booleans()) else None,
        marks=tuple(sorted(marks, key=lambda mark: mark.t_s)),
        commands=tuple(draw(st.lists(command, max_size=2))),
        state=draw(
            st.dictionaries(st.from_regex(r"[a-z.]{1,8}", fullmatch=True), state, max_size=2)
        ),
        truth=truth,
    )
