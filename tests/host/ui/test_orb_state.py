"""The orb as it is shown follows a change of its gestures."""

from controller.shared.protocol.messages import Telemetry
from controller.shared.protocol.teaching import Vocabulary
from host.ui.orb_state import OrbState
from tests.support.fake_device import welcome


def test_telemetry_of_a_new_gesture_is_shown_after_the_vocabulary() -> None:
    orb = OrbState()
    orb.connected(welcome())
    labels = (*welcome().labels, "swipe")
    shares = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    orb.described(Vocabulary(labels, (), "", True, 1, ""))
    orb.telemetry(Telemetry(1, bytes([128] * 25), shares, None, "swipe", True, 40.0), 0.0)
    for second in range(3):
        orb.advance(float(second))
    assert orb.labels == labels
    assert orb.probabilities.tolist() == [round(share, 3) for share in shares]
