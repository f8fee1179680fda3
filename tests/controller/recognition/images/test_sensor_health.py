"""Health: what a sensor is told to lack while people play on it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.preprocess import Prepared, Preprocessor
from controller.recognition.images.sensor_health import MOST, HealthMonitor
from controller.shared.notices import Notice
from controller.shared.protocol.messages import Health
from controller.shared.protocol.packets import Decoder, encode

REST_PF = np.random.default_rng(2).normal(41.2, 2.9, (5, 5))


def idle(seconds: float, seed: int = 0) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    frames = REST_PF * (1.0 + 0.003 * rng.standard_normal((round(seconds * 10), 5, 5)))
    return frames.astype(np.float32)


class Session:
    """A preprocessor and its health."""

    def __init__(self) -> None:
        self.stage = Preprocessor(PreprocessSettings(), 5, 5)
        self.health = HealthMonitor(10.0, ratio=True)

    def feel(self, frames: NDArray[np.floating]) -> tuple[str, ...]:
        for frame in frames.astype(np.float32):
            prepared = self.stage.step(frame)
            self.health.notice(prepared)
            found = self.health.check(prepared.dead, self.stage.resting)
        return found


def test_a_sound_sensor_lacks_nothing() -> None:
    assert Session().feel(idle(20.0)) == ()


@pytest.mark.parametrize(
    ("taxels", "factor", "told"),
    [
        (np.s_[:], 0.88, "pressure down 6 %: pump (or the orb has cooled)"),
        (np.s_[3], 0.8, "row 3 has drifted by -20 %; look at its lead"),
        (np.s_[3], 3.0, "row 3 has drifted by +196 %; look at its lead"),
        (np.s_[1, 2], 1.5, "taxel row 1, column 2: drifted by +49 %; the film may be cracking"),
    ],
)
def test_falling_pressure_is_told_from_other_faults(taxels: Any, factor: float, told: str) -> None:
    end, session = np.ones((5, 5)), Session()
    end[taxels] = factor
    session.feel(idle(5.0))
    slow = np.linspace(0.0, 1.0, 1200)[:, None, None]
    assert session.feel(idle(120.0) * (1.0 + (end - 1.0) * slow)) == (told,)


def test_a_lead_that_is_off_is_named_and_one_that_crackles_is_told() -> None:
    session = Session()
    session.feel(idle(5.0))
    cut = idle(3.0)
    cut[:, :, 2] = 1.0
    assert session.feel(cut) == ("column 2: no signal, play goes on without; fasten the lead",)
    assert session.feel(idle(3.0)) == ()
    for _ in range(3):
        session.feel(cut[:3])
        found = session.feel(idle(1.0))
    assert found[0].startswith("a lead crackles")


def test_two_short_losses_of_a_lead_are_no_long_one() -> None:
    session = Session()
    session.feel(idle(5.4))
    cut = idle(0.9)
    cut[:, :, 2] = 1.0
    session.feel(cut[:6])
    session.feel(idle(0.1))
    assert session.feel(cut) == ()


def test_sentences_fit_on_the_wire() -> None:
    session = Session()
    session.feel(idle(5.0))
    slow = np.linspace(0.0, 1.0, 1800)[:, None, None]
    far = np.exp(np.random.default_rng(8).normal(-0.5, 0.8, (5, 5)))
    found = session.feel(idle(180.0) * (1.0 + (far - 1.0) * slow))
    assert 0 < len(found) <= MOST
    data = encode(Health(found), session=0, sequence=0, t_ms=0)
    [packet] = Decoder().feed(data)
    assert isinstance(packet.message, Health)
    assert all(isinstance(one, Notice) for one in packet.message.found)  # none was cut


FELT = Prepared(np.ones((5, 5), np.float32), True, 0.0, True)
OFF = np.eye(5, dtype=np.bool_)[2][:, None] & np.ones((5, 5), np.bool_)  # all of row 2


def found(frames: list[Prepared]) -> tuple[str, ...]:
    """What is found after these frames, at 10 Hz."""
    health = HealthMonitor(10.0, ratio=True)
    for prepared in frames:
        health.notice(prepared)
        lines = health.check(prepared.dead, None)
    return lines


LOST, RESTLESS = replace(FELT, lost=OFF), replace(FELT, ready=False, quiet=False)
TOUCHED, LOSS = replace(FELT, quiet=False), [replace(FELT, lost=OFF), FELT]
LONG = "something has touched the orb for 1 min; take it off"
NO_SIGNAL = "row 2: no signal, play goes on without; fasten the lead"
CRACKLES = "a lead crackles: it was off and on again several times; fasten leads and plug"
NEVER_QUIET = "no quiet second since the start; take hands and things off the orb"


@pytest.mark.parametrize(
    ("frames", "told"),
    [
        # A lead counts as off after one second; what is found is looked for once a second.
        ([FELT, *[LOST] * 9], ""),
        ([LOST] * 10, NO_SIGNAL),
        ([*[FELT] * 10, *[LOST] * 10], NO_SIGNAL),
        ([LOST] * 19, NO_SIGNAL),
        ([*[LOST] * 10, *[FELT] * 9], NO_SIGNAL),
        ([*[LOST] * 10, *[FELT] * 10], ""),
        # Three losses within thirty seconds are a crackle; two, or one for long, are none.
        ([*LOSS * 2, *[FELT] * 6], ""),
        ([*LOSS * 3, *[FELT] * 4], CRACKLES),
        ([*LOSS * 3, *[FELT] * 294], CRACKLES),  # the first one 29.9 s ago
        ([FELT, *LOSS * 2, *[FELT] * 297, *LOSS, *[FELT] * 6], ""),  # the first two 30 s
        ([*[LOST] * 9, FELT], ""),
        # A sensor that is not ready after ten seconds is never quiet.
        ([RESTLESS] * 90, ""),
        ([RESTLESS] * 100, NEVER_QUIET),
        ([FELT, *[RESTLESS] * 199], ""),
        # A hand has to stay for a minute without a pause.
        ([TOUCHED] * 590, ""),
        ([TOUCHED] * 600, LONG),
        ([TOUCHED] * 1800, "something has touched the orb for 3 min; take it off"),
        ([*[TOUCHED] * 599, FELT, *[TOUCHED] * 200], ""),
        # The rubber does not recover between quick touches, so that no frame is quiet.
        ([*[replace(TOUCHED, deviation=0.05)] * 9, replace(TOUCHED, deviation=0.01)] * 60, ""),
        ([*[replace(TOUCHED, deviation=0.05)] * 9, replace(TOUCHED, deviation=0.02)] * 60, LONG),
        ([replace(FELT, dead=OFF)] * 10,
         "row 2: no answer to touch, neighbours stand in; use Calibrate and check"),
    ],
)  # fmt: skip
def test_each_finding_has_its_limit_in_time(frames: list[Prepared], told: str) -> None:
    assert found(frames) == ((told,) if told else ())


def drifted(factor: NDArray[np.float64] | float, *, ratio: bool = True) -> tuple[str, ...]:
    """What is found once rest has become so many times what a calibration has found."""
    health = HealthMonitor(10.0, ratio=ratio, before=REST_PF)
    for _ in range(10):
        health.notice(FELT)
        lines = health.check(None, REST_PF * factor)
    return lines


@pytest.mark.parametrize(
    ("taxels", "log", "told"),
    [
        (np.s_[:], 0.079, ""),
        (np.s_[:], 0.081, "pressure up 4 %: let air out (or the orb has warmed)"),
        (np.s_[:], -0.081, "pressure down 4 %: pump (or the orb has cooled)"),
        (np.s_[:, 1], 0.119, ""),
        (np.s_[:, 1], 0.121, "column 1 has drifted by +13 %; look at its lead"),
        (np.s_[4, 0], 0.299, ""),
        (np.s_[4, 0], -0.301, "taxel row 4, column 0: drifted by -26 %; the film may be cracking"),
    ],
)
def test_a_drift_from_the_calibration_is_told_at_once(taxels: Any, log: float, told: str) -> None:
    change = np.zeros((5, 5))
    change[taxels] = log
    assert drifted(np.exp(change)) == ((told,) if told else ())
    assert drifted(np.exp(0.081), ratio=False) == ()


def test_a_line_and_a_taxel_are_told_until_they_are_at_seven_tenths() -> None:
    column, taxel = np.zeros((5, 5)), np.zeros((5, 5))
    column[:, 1], taxel[4, 0] = 0.13, 0.31
    for change in (column, taxel, np.full((5, 5), 0.085)):
        health = HealthMonitor(10.0, ratio=True, before=REST_PF)
        told = []
        for share in (0.9, 1.0, 0.9, 0.75, 0.6, 0.9):
            for _ in range(10):
                health.notice(FELT)
                lines = health.check(None, REST_PF * np.exp(share * change))
            told.append(bool(lines))
        assert told == [False, True, True, True, False, False]


def test_a_taxel_that_reads_0_at_rest_has_drifted_without_end() -> None:
    factor = np.ones((5, 5))
    factor[1, 2] = 0.0
    told = "taxel row 1, column 2: drifted by -100 %; the film may be cracking"
    assert drifted(factor) == (told,)


def test_no_more_than_eight_sentences_are_told_at_once() -> None:
    health, rest = (
        HealthMonitor(10.0, ratio=True, before=np.full((20, 20), 40.0)),
        np.full((20, 20), 40.0),
    )
    rest[:9] *= 1.2
    for _ in range(10):
        health.notice(FELT)
        lines = health.check(None, rest)
    assert [line.split(" has")[0] for line in lines] == [f"row {row}" for row in range(8)]


def test_a_sensor_that_was_never_calibrated_drifts_from_its_first_rest() -> None:
    health = HealthMonitor(10.0, ratio=True)
    for rest, lines in ((None, 0), (REST_PF, 0), (REST_PF * 0.9, 1)):
        for _ in range(10):
            health.notice(FELT)
            found = health.check(None, rest)
        assert len(found) == lines
