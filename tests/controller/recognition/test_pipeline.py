"""The stages joined: frames in, one command per touch out."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.recognition.debounce import DebounceSettings
from controller.recognition.images.frames import Frame, Window
from controller.recognition.pipeline import Pipeline, Step, agreed
from controller.recognition.touch_position import PositionSpread
from controller.shared.aliases import State
from tests.support.loop_bench import SHIPPED, Certain

REST: Frame = np.full((5, 5), 40.0, dtype=np.float32)


def pressed(x: int, y: int, depth: float = 0.6) -> Frame:
    frame = REST.copy()
    frame[4 - y, x] *= 1.0 - depth
    return frame


def played(pipeline: Pipeline, frames: list[Frame], start: int = 1) -> list[Step]:
    return [pipeline.step(f, k / 10, k) for k, f in enumerate(frames, start)]


def pipeline() -> Pipeline:
    return Pipeline(SHIPPED.settings, Certain(), SHIPPED.mapping)


def test_a_press_at_the_left_becomes_left_once() -> None:
    steps = played(pipeline(), [REST] * 20 + [pressed(0, 3)] * 20 + [REST] * 20)
    records = [step.command for step in steps if step.command]
    assert [(r.command, r.gesture, r.touch) for r in records] == [("left", "press", (0.0, 3.0))]
    assert 21 <= records[0].frame <= 30
    assert records[0].t_s == records[0].frame / 10
    assert records[0].probability == 1.0


@pytest.mark.parametrize(
    ("label", "command"),
    [("pinch", "drop"), ("twist_cw", "rotate_cw"), ("twist_ccw", "rotate_ccw")],
)
def test_every_other_gesture_becomes_its_command_too(label: str, command: str) -> None:
    networks = Pipeline(SHIPPED.settings, Certain(label), SHIPPED.mapping)
    steps = played(networks, [REST] * 20 + [pressed(0, 3)] * 20 + [REST] * 20)
    records = [step.command for step in steps if step.command]
    assert [(r.command, r.gesture) for r in records] == [(command, label)]


def test_frames_without_a_number_are_counted() -> None:
    frames = [REST] * 20 + [pressed(0, 3)] * 20
    own = pipeline()
    counted = [
        step.command for k, f in enumerate(frames, 1) if (step := own.step(f, k / 10)).command
    ]
    given = [step.command for step in played(pipeline(), frames) if step.command]
    assert counted == given


def test_the_gesture_is_held_until_rest() -> None:
    steps = played(pipeline(), [REST] * 20 + [pressed(0, 3)] * 20 + [REST] * 20)
    held = [step.held for step in steps]
    assert held[:20] == [""] * 20
    assert held[35] == "press"
    assert held[-1] == ""


def test_a_tap_soon_after_another_has_its_own_place() -> None:
    taps = DebounceSettings(smoothing=1.0, on=1.05, off=0.5, least=0.8)
    quick = Pipeline(replace(SHIPPED.settings, debounce=taps), Certain(), SHIPPED.mapping)
    left, right = [pressed(0, 3)] * 2, [pressed(4, 3)] * 2
    steps = played(quick, [REST] * 20 + left + [REST] * 2 + right + [REST] * 2)
    records = [step.command for step in steps if step.command]
    assert [(r.command, r.touch) for r in records] == [("left", (0.0, 3.0)), ("right", (4.0, 3.0))]


def test_a_tap_that_is_answered_late_is_where_it_was() -> None:
    slow = DebounceSettings(smoothing=0.2, on=1.05, off=0.5, least=0.8)
    tapped = Pipeline(replace(SHIPPED.settings, debounce=slow), Certain(), SHIPPED.mapping)
    steps = played(tapped, [REST] * 20 + [pressed(0, 3)] * 9 + [REST] * 8)
    answer = next(step for step in steps if step.command)
    assert answer.command is not None
    assert (answer.command.command, answer.command.touch) == ("left", (0.0, 3.0))
    assert steps[answer.frame].touch is None  # it was over two frames before


def test_what_is_as_probably_a_gesture_as_none_belongs_to_a_touch() -> None:
    class Doubtful(Certain):
        def probabilities(self, window: Window, user: str = "") -> NDArray[np.float32]:
            return np.array([0.5, 0.5, 0, 0, 0], dtype=np.float32)

    steps = played(Pipeline(SHIPPED.settings, Doubtful(), SHIPPED.mapping), [REST] * 20)
    assert [step.touch is not None for step in steps] == [step.ready for step in steps]


def test_a_new_pipeline_remembers_nothing() -> None:
    state = {name: array.tolist() for name, array in pipeline().state().items() if array.any()}
    assert state == {
        "debounce.mean": [1.0, 0.0, 0.0, 0.0, 0.0],
        "preprocess.firm": [-0.08],  # touches lower an orb's readings
    }


def test_before_the_rest_image_is_taken_everything_is_null_for_certain() -> None:
    first = played(pipeline(), [REST])[0]
    assert not first.ready
    assert first.probabilities.tolist() == [1.0, 0.0, 0.0, 0.0, 0.0]
    assert first.touch is None
    assert first.image.shape == (5, 5)


def test_the_same_touch_means_something_else_elsewhere() -> None:
    frames = [REST] * 20
    for x, y in ((0, 4), (4, 4), (2, 0)):
        frames += [pressed(x, y)] * 8 + [REST] * 12
    commands = [step.command.command for step in played(pipeline(), frames) if step.command]
    assert commands == ["left", "right", "down"]


def test_a_place_is_told_with_how_far_off_it_may_be_if_somebody_measured_it() -> None:
    rng = np.random.default_rng(2)
    frames = [
        (frame * (1.0 + 0.01 * rng.standard_normal((5, 5)))).astype(np.float32)
        for frame in [REST] * 20 + [pressed(0, 3)] * 10 + [REST] * 20
    ]
    measured = replace(SHIPPED, spread=PositionSpread(0.1, 3.0))
    steps = played(Pipeline(measured.settings, Certain(), SHIPPED.mapping), frames)
    sigmas = [step.sigma for step in steps if step.sigma is not None]
    assert [step.sigma is None for step in steps] == [step.touch is None for step in steps]
    assert 0.1 < min(sigmas) < 0.2
    unmeasured = Pipeline(replace(SHIPPED, spread=None).settings, Certain(), SHIPPED.mapping)
    assert all(step.sigma is None for step in played(unmeasured, frames))


def test_a_pipeline_goes_on_exactly_where_its_state_was_taken() -> None:
    rng = np.random.default_rng(5)
    frames = [REST] * 15 + [pressed(3, 3)] * 9 + [REST] * 15
    noisy = [(f * (1 + 0.003 * rng.standard_normal((5, 5)))).astype(np.float32) for f in frames]
    assert [step.gesture for step in played(pipeline(), noisy) if step.gesture] == ["press"]
    for cut in range(len(noisy)):
        whole, copy = pipeline(), pipeline()
        played(whole, noisy[:cut])
        copy.restore(whole.state())
        for one, other in zip(
            played(whole, noisy[cut:], cut + 1), played(copy, noisy[cut:], cut + 1), strict=True
        ):
            assert one.image.tobytes() == other.image.tobytes()
            assert one.probabilities.tobytes() == other.probabilities.tobytes()
            assert (one.touch, one.held, one.command) == (other.touch, other.held, other.command)


def test_a_state_is_taken_while_a_gesture_waits_for_another_one() -> None:
    waits = DebounceSettings(patient=("press",), awaited=("pinch",), patience_s=2.0)
    patient = replace(SHIPPED.settings, debounce=waits)
    whole, copy = (Pipeline(patient, Certain(), SHIPPED.mapping) for _ in range(2))
    assert not any(step.gesture for step in played(whole, [REST] * 20 + [pressed(0, 3)] * 9))
    copy.restore(whole.state())
    steps = played(copy, [REST] * 30, 30)
    assert [step.gesture for step in steps if step.gesture] == ["press"]


def test_a_state_of_something_else_is_refused() -> None:
    state = pipeline().state()
    wrong: tuple[State, ...] = (
        {},
        {**state, "extra.thing": np.zeros(1)},
        {**state, "preprocess.noise": np.ones((4, 4))},
        {**state, "preprocess.rest": np.zeros((1, 5, 5))},
        {**state, "debounce.mean": np.ones(7)},
        {**state, "debounce.held": np.array([9.0])},
    )
    for damaged in wrong:
        with pytest.raises(ValueError, match="the state"):
            pipeline().restore(damaged)


@pytest.mark.parametrize(
    ("own", "others", "shared", "both"),
    [
        ([0.1, 0.9], [0.1, 0.9], [0, 1], [0.1, 0.9]),  # they say the same
        ([0.0, 1.0], [1.0, 0.0], [0, 1], [0.5, 0.5]),  # the opposite: both are equally likely
        ([0.5, 0.5], [0.1, 0.9], [0, 1], [0.25, 0.75]),  # one has no opinion
        ([0.2, 0.3, 0.5], [], [], [0.2, 0.3, 0.5]),  # there is one alone
        ([0.1, 0.1, 0.8], [0.5, 0.5], [0, 1], [0.1, 0.1, 0.8]),  # of a taught gesture one alone
        ([0.1, 0.1, 0.8], [0.4, 0.4, 0.2], [0, 1], [0.1, 0.1, 0.8]),  # taught anew: it, too
    ],
)
def test_a_label_is_as_probable_as_two_networks_find_together(
    own: list[float], others: list[float], shared: list[int], both: list[float]
) -> None:
    one, other = (np.array(each, dtype=np.float32) for each in (own, others))
    found = agreed(one, other, np.array(shared, dtype=np.int64))
    assert found.dtype == np.float32
    assert found == pytest.approx(np.array(both), abs=1e-6)
