"""One gesture per touch."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from controller.recognition.debounce import Debouncer, DebounceSettings
from controller.recognition.debounced_stream import fire, smooth

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")
NULL, PRESS, PINCH = range(3)


def sure(label: int, probability: float = 0.97) -> NDArray[np.float64]:
    """Probabilities that are nearly sure of one label."""
    rest = (1.0 - probability) / (len(LABELS) - 1)
    return np.array([probability if i == label else rest for i in range(len(LABELS))])


def fired(stream: list[int]) -> list[tuple[int, str]]:
    """(frame, label) of everything that fires."""
    stage = Debouncer(LABELS, DebounceSettings(smoothing=0.4, on=0.8, off=0.35))
    steps = ((i, stage.step(sure(label))) for i, label in enumerate(stream))
    return [(i, label) for i, label in steps if label is not None]


TOUCH, REST = [PRESS] * 6, [NULL] * 6


@pytest.mark.parametrize(
    ("stream", "expected"),
    [
        *(([NULL] * 5 + [label] * 40, [(8, LABELS[label])]) for label in range(1, len(LABELS))),
        (TOUCH + REST + [PINCH] * 6, [(3, "press"), (15, "pinch")]),
        ((TOUCH + REST) * 3, [(3, "press"), (15, "press"), (27, "press")]),
        (([PINCH] * 2 + REST) * 5, []),  # a flicker of two frames
        (TOUCH + [PINCH] * 10, [(3, "press")]),  # changing its mind during a touch
    ],
)
def test_four_sure_frames_fire_once(stream: list[int], expected: list[tuple[int, str]]) -> None:
    assert fired(stream) == expected


def test_as_many_probabilities_as_labels_are_expected() -> None:
    stage = Debouncer(LABELS, DebounceSettings())
    with pytest.raises(ValueError, match="5 labels"):
        stage.step(np.ones(4) / 4)


@given(st.lists(st.integers(0, len(LABELS) - 1), max_size=80))
def test_between_two_gestures_there_is_always_rest(stream: list[int]) -> None:
    frames = [i for i, _ in fired(stream)]
    for first, second in itertools.pairwise(frames):
        assert NULL in stream[first:second]


@given(st.lists(st.integers(0, len(LABELS) - 1), min_size=2, max_size=60), st.data())
def test_a_restored_debouncer_continues_exactly(stream: list[int], data: st.DataObject) -> None:
    cut = data.draw(st.integers(0, len(stream)))
    chosen = DebounceSettings(lifted=0.5, slow=("twist_cw",), slow_s=0.3)
    whole, before, after = (Debouncer(LABELS, chosen) for _ in range(3))

    def play(stage: Debouncer, labels: list[int]) -> list[tuple[str | None, str]]:
        steps = (stage.step(sure(label), level=float(label % 3)) for label in labels)
        return [(fired, stage.held) for fired in steps]

    expected = play(whole, stream)
    play(before, stream[:cut])
    state = before.state()
    kept = {name: array.copy() for name, array in state.items()}
    after.restore(state)
    assert after.held == before.held
    assert play(after, stream[cut:]) == expected[cut:]
    for name, array in kept.items():  # the state that was given stays as it is
        np.testing.assert_array_equal(state[name], array)


@pytest.mark.parametrize(("idle", "frames"), [(0.0, 1), (0.1, 3), (0.3, 6)])
def test_a_noisier_sensor_is_averaged_for_longer(idle: float, frames: int) -> None:
    stage = Debouncer(LABELS, DebounceSettings(smoothing=1.0, on=0.8, noise=0.1))
    steps = [stage.step(sure(PRESS, 0.999), idle) for _ in range(10)]
    assert steps.index("press") == frames - 1


TAPS = DebounceSettings(smoothing=1.0, on=0.98, off=0.45, least=0.8, brief_s=0.05)


def taps(probability: float, frames: int, chosen: DebounceSettings = TAPS) -> list[tuple[int, str]]:
    """(frame, label) of what fires at 40 Hz for a press of a probability, with rest around it."""
    stage = Debouncer(LABELS, chosen, rate_hz=40.0)
    stream = [sure(NULL)] * 5 + [sure(PRESS, probability)] * frames + [sure(NULL)] * 5
    steps = ((i, stage.step(newest)) for i, newest in enumerate(stream))
    return [(i, label) for i, label in steps if label is not None]


def test_clear_evidence_fires_at_once() -> None:
    assert taps(0.99, 20) == [(5, "press")]


def test_a_tap_too_short_to_be_clear_fires_when_it_ends() -> None:
    assert taps(0.9, 3) == [(8, "press")]


def test_a_tap_is_told_with_its_greatest_probability() -> None:
    stage = Debouncer(LABELS, TAPS, rate_hz=40.0)
    told = []
    for newest in [sure(PRESS, 0.9)] * 3 + [sure(NULL)] * 2:
        stage.step(newest)
        told.append(round(stage.tapped, 3))
    assert told == [0.0, 0.0, 0.0, 0.9, 0.0]


@pytest.mark.parametrize(("probability", "frames"), [(0.7, 3), (0.9, 2), (0.5, 20)])
def test_a_touch_that_was_hardly_one_fires_nothing(probability: float, frames: int) -> None:
    assert taps(probability, frames) == []


def test_waiting_has_a_bound() -> None:
    bounded = replace(TAPS, wait_s=0.2, late=0.9)
    assert taps(0.9, 20, bounded) == [(5 + 7, "press")]
    assert taps(0.94, 20, bounded) == [(5 + 3, "press")]  # halfway
    assert taps(0.9, 20) == [(25, "press")]


def test_two_taps_a_tenth_of_a_second_apart_are_two() -> None:
    stage = Debouncer(LABELS, TAPS, rate_hz=40.0)
    tap, rest = [sure(PRESS, 0.99)] * 3, [sure(NULL)] * 4
    assert [stage.step(newest) for newest in (tap + rest) * 2].count("press") == 2


PATIENT = replace(TAPS, patient=("press",), awaited=("pinch",), patience_s=0.2)  # 8 frames
TAP, PAUSE, PINCHED = [PRESS] * 4, [NULL] * 4, [PINCH] * 4


@pytest.mark.parametrize(
    ("stream", "expected"),
    [
        (TAP + [NULL] * 20, [(8, "press")]),  # nothing follows
        (TAP + PAUSE + PINCHED + [NULL] * 20, [(8, "pinch")]),  # as a double tap after its first
        (TAP + PINCHED + [NULL] * 20, [(4, "pinch")]),  # as a swipe after it came down
        (TAP + PAUSE + TAP + [NULL] * 20, [(8, "press"), (16, "press")]),  # two are two
        ([PRESS] * 30 + [NULL] * 9, [(8, "press")]),  # held
        (PINCHED + PAUSE + TAP + [NULL] * 9, [(0, "pinch"), (16, "press")]),
    ],
)
def test_a_patient_gesture_waits_for_one_that_begins_like_it(
    stream: list[int], expected: list[tuple[int, str]]
) -> None:
    stage = Debouncer(LABELS, PATIENT, rate_hz=40.0)
    steps = ((i, stage.step(sure(label, 0.99))) for i, label in enumerate(stream))
    assert [(i, label) for i, label in steps if label is not None] == expected


def test_a_gesture_that_another_waited_for_may_wait_itself_from_its_end_on() -> None:
    both = replace(PATIENT, patient=("press", "pinch"), awaited=("pinch", "twist_cw"))
    stage = Debouncer(LABELS, both, rate_hz=40.0)
    stream = [PRESS] * 7 + [PINCH] * 18 + [NULL] * 25
    steps = [stage.step(sure(label, 0.99)) for label in stream]
    assert [(i, label) for i, label in enumerate(steps) if label] == [(25 + 8, "pinch")]


def leveled(
    stream: list[int], levels: list[float], chosen: DebounceSettings, probability: float = 0.99
) -> tuple[list[tuple[int, str]], list[str]]:
    """(frame, label) of what fires at 40 Hz, and what is held after each frame."""
    stage, found, held = Debouncer(LABELS, chosen, rate_hz=40.0), [], []
    for frame, (label, level) in enumerate(zip(stream, levels, strict=True)):
        if (one := stage.step(sure(label, probability), level=level)) is not None:
            found.append((frame, one))
        held.append(stage.held)
    return found, held


@pytest.mark.parametrize(("after", "expected"), [(0.1, [(13, "press")]), (0.9, [])])
def test_a_touch_in_which_the_network_changes_its_mind_is_no_tap(
    after: float, expected: list[tuple[int, str]]
) -> None:
    """An elbow looks like a finger at first; a finger that leaves takes its level with it."""
    levels = [0.0] * 10 + [1.0] * 3 + [after] * 20
    stream = [NULL] * 10 + [PRESS] * 3 + [NULL] * 20
    assert leveled(stream, levels, replace(TAPS, lifted=0.5), 0.9)[0] == expected


@pytest.mark.parametrize(
    ("second", "uneven", "answers"),
    [
        ([0.0, 0.5, 0.0], [0.0, 0.3, 0.0], 2),  # another tap
        ([0.0, 0.2, 0.0], [0.0, 0.0, 0.0], 1),  # pressure moves all taxels alike
        ([0.2, 0.2, 0.0], [0.2, 0.2, 0.0], 1),  # the same finger slides off the dome
    ],
)
def test_a_tap_is_a_finger_that_has_come_since_the_last_answer(
    second: list[float], uneven: list[float], answers: int
) -> None:
    stage, found = Debouncer(LABELS, replace(TAPS, lifted=0.5), rate_hz=40.0), []
    levels = [(0.0, 0.0, NULL)] * 10 + [(0.5, 0.3, PRESS)] * 3
    for level, one, label in zip(second, uneven, (NULL, PRESS, NULL), strict=True):
        levels += [(level, one, label)] * (4 if label else 10)
    for level, one, label in levels:
        fired = stage.step(sure(label, 0.9), level=level, uneven=one)
        found += [] if fired is None else [fired]
    assert found == ["press"] * answers


@pytest.mark.parametrize(
    ("idle", "brisk", "expected"),
    [
        pytest.param(0.003, ("press",), [22], id="after .4 s"),
        pytest.param(0.003, (), [], id="of a gesture that is not brisk"),
        pytest.param(0.06, ("press",), [], id="on a noisy sensor"),
    ],
)
def test_less_is_needed_of_a_finger_that_lands_slowly_and_stays(
    idle: float, brisk: tuple[str, ...], expected: list[int]
) -> None:
    slowly = replace(TAPS, on=1.05, late=0.93, wait_s=0.2, least=0.5, noise=0.15, brisk=brisk)
    stage = Debouncer(LABELS, slowly, rate_hz=40.0)
    stream = [sure(NULL)] * 5 + [sure(PRESS, 0.85)] * 40
    assert [n for n, newest in enumerate(stream) if stage.step(newest, idle)] == expected


def test_a_finger_that_stays_and_is_doubted_for_a_moment_is_answered_once() -> None:
    wary = replace(TAPS, on=1.05, late=0.98, wait_s=0.2, lifted=0.5)
    stream = [NULL] * 10 + [PRESS] * 20 + [NULL] * 4 + [PRESS] * 4 + [NULL] * 20
    stays = [0.0] * 10 + [1.0] * 28 + [0.0] * 20
    assert leveled(stream, stays, wary)[0] == [(16, "press")]
    taps = [*stays[:30], *[0.1] * 4, *stays[34:]]
    assert leveled(stream, taps, wary)[0] == [(16, "press"), (38, "press")]


@pytest.mark.parametrize(("doubted", "expected"), [(10, [(20, "press")]), (40, [])])
def test_a_brisk_gesture_is_answered_soon_after_its_landing_or_never(
    doubted: int, expected: list[tuple[int, str]]
) -> None:
    """A hand that has rested on the dome for a second is no press, whatever it looks like."""
    brisk = replace(TAPS, lifted=0.5, brisk=("press",), landed_s=0.5)
    stream = [NULL] * (10 + doubted) + [PRESS] * 20 + [NULL] * 10
    levels = [0.0] * 10 + [1.0] * (doubted + 20) + [0.0] * 10
    assert leveled(stream, levels, brisk)[0] == expected


def test_another_contact_ends_the_touch_and_what_it_had_not_been_sure_of_is_answered() -> None:
    unsure = replace(TAPS, on=1.05, late=0.98, wait_s=0.2, lifted=0.5, brisk=("press",))
    for label, expected in ((PINCH, "pinch"), (PRESS, None)):
        stage = Debouncer(LABELS, unsure, rate_hz=40.0)
        for level in (0.0, *[1.0] * 10):
            assert stage.step(sure(label if level else NULL, 0.9), level=level) is None
        assert stage.restart() == expected
        pressed = [stage.step(sure(PRESS, 0.99), level=0.5) for _ in range(20)]
        assert [one for one in pressed if one] == ["press"]


def test_a_slow_gesture_waits_until_it_is_sure_or_its_touch_ends() -> None:
    slow = replace(TAPS, slow=("twist_cw",), slow_s=0.3)
    turn = LABELS.index("twist_cw")
    level = [0.0] * 10 + [1.0] * 30 + [0.0] * 10
    long, _ = leveled([NULL] * 10 + [turn] * 30 + [NULL] * 10, level, slow)
    assert long == [(10 + 11, "twist_cw")]  # in the frame in which 0.3 s are over
    back, _ = leveled([NULL] * 10 + [turn] * 8 + [turn + 1] * 22 + [NULL] * 10, level, slow)
    assert back == [(18, "twist_ccw")]
    short, _ = leveled([NULL] * 10 + [turn] * 6 + [NULL] * 34, level[:16] + [0.0] * 34, slow)
    assert short == [(16, "twist_cw")]


def test_a_gesture_is_held_while_its_contact_lasts_and_another_may_begin_in_it() -> None:
    stream = [NULL] * 10 + [PINCH] * 10 + [NULL] * 10 + [PRESS] * 10 + [NULL] * 20
    levels = [0.0] * 10 + [1.0] * 20 + [1.8] * 10 + [1.0] * 10 + [0.1] * 10
    found, held = leveled(stream, levels, replace(TAPS, lifted=0.5))
    assert found == [(10, "pinch"), (30, "press")]
    assert held[10:30] == ["pinch"] * 20  # its fingers lie still
    assert held[30:40] == ["press"] * 10
    assert held[40:] == [""] * 20
    assert not any(leveled(stream, levels, TAPS)[1][11 + 10 : 30])  # any end of a touch is one


def test_pressure_that_changed_meanwhile_does_not_hold_a_gesture() -> None:
    """All taxels moved alike while a finger pressed: the level stays when it has left."""
    stage, held = Debouncer(LABELS, replace(TAPS, lifted=0.5), rate_hz=40.0), []
    for label, level, uneven in (
        [(NULL, 0.0, 0.0)] * 10 + [(PRESS, 1.0, 0.8)] * 9 + [(NULL, 0.5, 0.0)] * 5
    ):
        stage.step(sure(label, 0.99), level=level, uneven=uneven)
        held.append(stage.held)
    assert held == [""] * 10 + ["press"] * 9 + [""] * 5


SHARE = st.floats(0.01, 1.0)


@settings(deadline=None)
@given(
    arrays.arrays(np.float32, (40, 4), elements=st.floats(0.0, 1.0, width=32)),
    st.builds(
        DebounceSettings, SHARE, SHARE, SHARE,
        wait_s=st.sampled_from([0.0, 0.2, 1.0]), late=SHARE,
        least=st.sampled_from([2.0, 0.4, 0.7]), brief_s=st.sampled_from([0.0, 0.1, 0.3]),
        noise=st.sampled_from([0.0, 0.1]),
        patient=st.sampled_from([(), ("press",)]), awaited=st.sampled_from([(), ("pinch",)]),
        patience_s=st.sampled_from([0.2, 0.5]), lifted=st.sampled_from([2.0, 0.5]),
        slow=st.sampled_from([(), ("pinch", "twist_cw")]), slow_s=st.sampled_from([0.2, 0.5]),
        brisk=st.sampled_from([(), ("press",)]), landed_s=st.sampled_from([0.3, 0.85]),
    ),
    arrays.arrays(np.float64, 40, elements=st.floats(0.0, 0.2)),
    arrays.arrays(np.float64, 40, elements=st.floats(0.0, 1.0)),
)  # fmt: skip
def test_a_whole_recording_fires_what_the_debouncer_fires_frame_by_frame(
    weights: NDArray[np.float32],
    chosen: DebounceSettings,
    idle: NDArray[np.float64],
    levels: NDArray[np.float64],
) -> None:
    probabilities = (weights + 1e-3) / (weights + 1e-3).sum(axis=1, keepdims=True)
    stage = Debouncer(LABELS[:4], chosen)
    seen = enumerate(zip(probabilities, idle, levels, strict=True))
    steps = [(frame, stage.step(*newest)) for frame, newest in seen]
    means = smooth(probabilities, chosen.weight(idle))
    at_once = fire(means, chosen, labels=LABELS[:4], levels=levels, idle=idle)
    assert [(frame, LABELS[label]) for frame, label in at_once] == [s for s in steps if s[1]]
