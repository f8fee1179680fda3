"""The orb as it is shown follows its gestures, and what touches it."""

from dataclasses import replace

import pytest

from controller.shared.protocol.messages import ContactState, Telemetry
from controller.shared.protocol.teaching import Vocabulary
from host.connection.receiver import Connected, Delivered, Lost, Received, Stale
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


FINGER = ContactState(7, 2.0, 1.5, depth_mm=6.0, fingers=1)


def test_the_contact_is_the_newest_and_when_it_came() -> None:
    orb = OrbState()
    orb.observe(Connected(welcome()), 0.0)
    orb.observe(Delivered(FINGER, 700), 1.0)
    deeper = replace(FINGER, frame=8, depth_mm=9.0)
    orb.observe(Delivered(deeper, 725), 1.025)
    assert orb.contact == deeper


@pytest.mark.parametrize(
    "end", [Delivered(ContactState(7), 725), Stale(), Lost("cut"), Connected(welcome())], ids=str
)
def test_no_contact_outlasts_its_end_or_the_link(end: Received) -> None:
    orb = OrbState()
    orb.observe(Connected(welcome()), 0.0)
    orb.observe(Delivered(FINGER, 700), 1.0)
    orb.observe(end, 1.1)
    assert orb.contact is None
