"""The ghost hand makes every gesture so that the shipped networks recognise it."""

import math

import pytest

from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.simulator.virtual_orb import VirtualOrb
from host.app.screens.learn import Step, steps
from host.ui import ghost
from host.ui.pointer_input import DomeArea
from tests.support.app_window import shipped_gestures

RATE_HZ = 40.0  # of the virtual orb that the application starts
SHIPPED = bundle.read(bundle.default_path(RATE_HZ))
PAD = DomeArea()
STEPS = steps(shipped_gestures(), PAD)
REST_S = 2.0  # in which the rest image is taken
ROUNDS = 3


def understood(step: Step) -> list[tuple[str, str]]:
    """Return the gestures and commands that the virtual orb makes of a ghost's showings."""
    orb = VirtualOrb(90_002, RATE_HZ)
    pipeline = Pipeline(SHIPPED.settings, Recognizer(SHIPPED), SHIPPED.mapping)
    found = []
    moments = range(round((REST_S + ROUNDS * ghost.PERIOD_S) * 60))
    for moment in moments:
        now_s = moment / 60
        if now_s >= REST_S:
            shown_s = now_s - REST_S
            orb.touch(ghost.contacts(step.label, step.place, shown_s, PAD), now_s)
    for frame in range(1, round(len(moments) / 60 * RATE_HZ)):
        at_s = frame / RATE_HZ
        result = pipeline.step(orb.read(at_s), at_s, frame)
        if result.command is not None:
            found.append((result.command.gesture, result.command.command))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS, ids=[step.command for step in STEPS])
def test_the_orb_understands_every_gesture_that_the_ghost_shows(step: Step) -> None:
    assert understood(step) == [(step.label, step.command)] * ROUNDS


def test_a_ghost_comes_down_makes_the_gesture_leaves_and_begins_again() -> None:
    assert ghost.contacts("press", (0.8, 2.7), 0.0, PAD) == ()
    (coming,) = ghost.contacts("press", (0.8, 2.7), 0.5, PAD)
    (down,) = ghost.contacts("press", (0.8, 2.7), 0.9, PAD)
    assert 0 < coming.depth_mm < down.depth_mm
    assert (down.x, down.y) == (0.8, 2.7)
    assert ghost.contacts("press", (0.8, 2.7), 2.0, PAD) == ()
    assert ghost.contacts("press", (0.8, 2.7), 0.9 + ghost.PERIOD_S, PAD) == (down,)


def test_the_fingers_of_a_pinch_close_and_those_of_a_twist_turn_about_the_middle() -> None:
    apart = [
        math.dist((one.x, one.y), (other.x, other.y))
        for at_s in (0.6, 0.8, 1.2)
        for one, other in [ghost.contacts("pinch", PAD.centre, at_s, PAD)]
    ]
    assert apart[0] > apart[1] > apart[2]
    first, last = (ghost.contacts("twist_cw", PAD.centre, at_s, PAD)[0] for at_s in (0.61, 1.39))
    turned = [math.atan2(one.y - PAD.centre[1], one.x - PAD.centre[0]) for one in (first, last)]
    assert math.degrees(turned[1] - turned[0]) % 360 > 180  # clockwise


def test_a_gesture_of_ones_own_has_no_ghost() -> None:
    assert ghost.contacts("knock", PAD.centre, 1.0, PAD) == ()
