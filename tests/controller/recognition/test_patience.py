"""An older gesture waits for a taught one that begins like it, and only then."""

import numpy as np

from controller.recognition import debounced_stream
from controller.recognition.debounce import DebounceSettings, Probabilities
from controller.recognition.debounced_stream import LONGEST_S, patient

LABELS = ("null", "press", "pinch", "double_tap")
NULL, PRESS, PINCH, DOUBLE_TAP = range(4)
EAGER = DebounceSettings(smoothing=1.0, on=0.9, off=0.5)
RATE_HZ = 40.0


def stream(*spans: tuple[int, int]) -> Probabilities:
    """Probabilities that are sure of one class after the other, (class, frames)."""
    kinds = np.concatenate([np.full(frames, kind) for kind, frames in spans])
    return np.asarray(np.eye(len(LABELS), dtype=np.float32)[kinds])


def test_a_press_waits_for_a_double_tap_as_long_as_the_examples_take() -> None:
    examples = [stream((NULL, 9), (PRESS, 4), (NULL, gap), (DOUBLE_TAP, 5)) for gap in (4, 8, 6)]
    found = patient(EAGER, LABELS, "double_tap", examples, RATE_HZ)
    assert (found.patient, found.awaited) == (("press",), ("double_tap",))
    assert found.patience_s == debounced_stream._WAIT_FACTOR * (4 + 8) / RATE_HZ


def test_nobody_waits_for_a_gesture_that_is_told_apart_at_once() -> None:
    examples = [stream((NULL, 9), (DOUBLE_TAP, 9))] * 3
    assert patient(EAGER, LABELS, "double_tap", examples, RATE_HZ) == EAGER


def test_one_odd_stream_of_twelve_makes_nobody_wait() -> None:
    odd, usual = stream((PINCH, 5), (DOUBLE_TAP, 5)), stream((DOUBLE_TAP, 9))
    assert patient(EAGER, LABELS, "double_tap", [odd, *[usual] * 11], RATE_HZ) == EAGER


def test_waiting_has_a_bound_and_is_kept_by_the_next_lesson() -> None:
    slow = [stream((PRESS, 4), (NULL, 60), (DOUBLE_TAP, 5))]
    found = patient(EAGER, LABELS, "double_tap", slow, RATE_HZ)
    assert found.patience_s == LONGEST_S
    again = patient(found, LABELS, "double_tap", [stream((DOUBLE_TAP, 9))], RATE_HZ)
    assert again == found
