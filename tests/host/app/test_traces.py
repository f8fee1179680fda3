"""Which examples of a gesture are questioned."""

import numpy as np

from host.app.traces import Trace, doubt


def moved(places: list[int], *names: str, seconds: float = 0.4) -> Trace:
    """Return the trace of a finger in the middle row, at a column in each frame."""
    trace = Trace((), names, seconds)
    for place in places:
        felt = np.zeros((5, 5), np.float32)
        felt[2, place] = -0.4
        trace = trace.step(felt)
    return trace


SWIPE = moved([0, 1, 2, 3, 4])
OTHER = moved([4, 3, 2, 1])


def test_a_trace_is_the_way_of_the_touch_in_grid_units() -> None:
    assert SWIPE.path == ((0, 2), (1, 2), (2, 2), (3, 2), (4, 2))
    assert (SWIPE.way, OTHER.way, moved([2, 2]).way) == (4.0, 3.0, 0.0)


def test_what_the_orb_takes_for_an_older_gesture_is_questioned_unless_one_was_kept() -> None:
    press = moved([2, 2], "press")
    assert doubt("swipe", press, []) == "press"
    assert doubt("double_tap", press, [moved([2, 2], "press")]) is None
    assert doubt("double_tap", moved([2, 2], "press", "press"), []) is None  # two are no press
    assert doubt("swipe", moved([0, 4], "swipe"), []) is None


def test_what_is_shorter_than_its_siblings_is_questioned() -> None:
    assert doubt("swipe", moved([2, 2]), [SWIPE, OTHER]) == ""
    assert doubt("swipe", moved([2, 2]), [SWIPE]) is None  # one does not say what is usual
    assert doubt("swipe", moved([1, 2, 3, 4]), [SWIPE, OTHER]) is None
    assert doubt("swipe", moved([0, 2, 4], seconds=1.5), [SWIPE, OTHER]) == ""
