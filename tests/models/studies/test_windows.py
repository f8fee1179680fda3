"""Windows and their events, and intervals that resample events."""

import numpy as np
import pytest

from models.evaluation.bootstrap import event_gain, event_mean
from models.studies.information.windows import as_the_paper, cut, event_numbers
from tests.support.recordings import of, origin, played


def test_windows_are_the_devices_and_know_their_session_and_event() -> None:
    windows = cut([played(seed=0), played(seed=1)])
    assert windows.x.shape[1:] == (10, 25)
    assert set(windows.session) == {0, 1}
    assert abs(windows.x[windows.y == 0]).mean() < 0.6 * abs(windows.x[windows.y > 0]).mean()
    for event in np.unique(windows.event)[:50]:
        own = windows.event == event
        assert len(set(windows.y[own])) == len(set(windows.session[own])) == 1


def test_an_unclear_frame_parts_no_event_and_a_pause_does() -> None:
    y = np.array([0, 1, 1, 1, 0, 0, 0])
    session = np.array([0, 0, 0, 0, 0, 0, 1])
    frame = np.array([5, 6, 8, 14, 15, 16, 0])
    assert event_numbers(y, session, frame).tolist() == [0, 1, 1, 2, 3, 3, 4]


def test_the_paper_takes_all_frames_the_first_ten_seconds_and_the_button() -> None:
    recording = played()
    z, y = as_the_paper([recording])
    assert z.shape == (len(recording.frames), 25)
    assert z[:100].mean(axis=0) == pytest.approx(1.0)
    assert y.tolist() == recording.button.tolist()


def test_sensors_of_two_kinds_are_not_mixed() -> None:
    small = of(np.ones((50, 2, 2)), origin(2, 2), label=np.zeros(50))
    with pytest.raises(ValueError, match="one kind"):
        cut([played(), small])


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
