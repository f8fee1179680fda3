"""A single finger that was felt, and has left."""

import pytest

from controller.recognition.contact import ContactEstimate
from controller.recognition.finger import FingerTracker


def felt(fingers: int, depth_mm: float) -> ContactEstimate:
    return ContactEstimate(2.0, 2.0, 0.1, depth_mm, 0.3, fingers, 0.9, 0.0, 10.0, 0.0, 0.5)


@pytest.mark.parametrize(
    ("fingers", "single"),
    [([1], True), ([1, 2], True), ([1, 1, 2], True), ([1, 2, 2], False), ([2], False), ([], False)],
)
def test_a_brief_click_is_one_finger_though_a_frame_looks_like_two(
    fingers: list[int], single: bool
) -> None:
    tracker = FingerTracker()
    tracker.step(None, begins=True)
    for number in fingers:
        tracker.step(felt(number, 6.0), begins=False)
        assert not tracker.left
    tracker.step(None, begins=False)
    assert tracker.left == single
