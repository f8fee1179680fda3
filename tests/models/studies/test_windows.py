"""Windows, their events, and sensors that are poorer than they were."""

import numpy as np
import pytest

from models.evaluation.bootstrap import event_gain, event_mean
from models.studies.information import scaling
from models.studies.information.windows import as_the_paper, events, take
from tests.support.recordings import of, origin, played


def test_windows_are_the_devices_and_know_their_session_and_event() -> None:
    taken = take([played(seed=0), played(seed=1)])
    assert taken.x.shape[1:] == (10, 25)
    assert set(taken.session) == {0, 1}
    assert abs(taken.x[taken.y == 0]).mean() < 0.6 * abs(taken.x[taken.y > 0]).mean()
    for event in np.unique(taken.event)[:50]:
        own = taken.event == event
        assert len(set(taken.y[own])) == len(set(taken.session[own])) == 1
    pressed = np.isfinite(taken.place[:, 0])
    assert set(taken.y[pressed]) == {taken.labels.index("press")}


def test_an_unclear_frame_parts_no_event_and_a_pause_does() -> None:
    y = np.array([0, 1, 1, 1, 0, 0, 0])
    session = np.array([0, 0, 0, 0, 0, 0, 1])
    frame = np.array([5, 6, 8, 14, 15, 16, 0])
    assert events(y, session, frame).tolist() == [0, 1, 1, 2, 3, 3, 4]


def test_the_paper_takes_all_frames_the_first_ten_seconds_and_the_button() -> None:
    recording = played()
    z, y = as_the_paper([recording])
    assert z.shape == (len(recording.frames), 25)
    assert z[:100].mean(axis=0) == pytest.approx(1.0)
    assert y.tolist() == recording.button.tolist()


def test_sensors_of_two_kinds_are_not_mixed() -> None:
    small = of(np.ones((50, 2, 2)), origin(2, 2), label=np.zeros(50))
    with pytest.raises(ValueError, match="one kind"):
        take([played(), small])


def test_twelve_bits_are_what_the_orb_has_and_fewer_are_coarser() -> None:
    recording = played()
    assert scaling.coarser(recording, 12).frames == pytest.approx(recording.frames, abs=1e-4)
    fine, coarse = (len(np.unique(scaling.coarser(recording, bits).frames)) for bits in (8, 5))
    assert coarse < fine < len(np.unique(recording.frames))


def test_a_converter_of_another_sensor_divides_its_range() -> None:
    frames = np.linspace(-3.0, 9.0, 400).reshape(100, 2, 2)
    other = of(frames, origin(2, 2, unit="counts"), label=np.zeros(100))
    levels = np.unique(scaling.coarser(other, 2).frames)
    assert levels.tolist() == [-3.0, 1.0, 5.0, 9.0]


def test_every_second_frame_is_half_the_rate() -> None:
    recording = played()
    half = scaling.slower(recording, 2)
    assert half.origin.rate_hz == 5.0
    assert half.rate_hz == pytest.approx(5.0)
    assert half.frames.tobytes() == recording.frames[1::2].tobytes()
    assert take([half]).x.shape[1] == 5  # a second, as before


def test_fewer_taxels_are_evenly_spread() -> None:
    taken = take([played()])
    nine = scaling.taxels(taken, 3)
    assert nine.grid == (3, 3)
    chosen = [0, 2, 4, 10, 12, 14, 20, 22, 24]
    assert nine.x.tobytes() == np.ascontiguousarray(taken.x[:, :, chosen]).tobytes()
    assert scaling.taxels(taken, 5).x.tobytes() == taken.x.tobytes()


def test_intervals_know_that_windows_of_one_touch_are_nearly_one() -> None:
    rng = np.random.default_rng(0)
    touch = np.repeat(np.arange(50), 20)
    part = rng.normal(size=50)[touch] + 1.0
    by_touch, by_window = event_mean(part, touch), event_mean(part, np.arange(1000))
    assert by_touch.value == by_window.value
    assert by_touch.high - by_touch.low > 3 * (by_window.high - by_window.low)


def test_who_is_always_sure_and_right_knows_all_of_the_label() -> None:
    y = np.arange(300) % 3
    found = event_gain(np.zeros(300), y, np.arange(300))
    assert found.value == pytest.approx(np.log(3))
    assert found.low <= found.value
    part = np.where(np.arange(300) < 150, 0.0, np.nan)  # what was not tested does not count
    assert event_gain(part, y, np.arange(300)).value == pytest.approx(np.log(3))
