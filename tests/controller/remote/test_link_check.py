# ruff: noqa: F811
"""A check that a host asks a running orb for: what it asks, what it finds, what it stores."""

from collections.abc import Callable
from pathlib import Path

from controller.sensors import calibration_store
from controller.shared.protocol.messages import Contact, Message
from controller.shared.protocol.teaching import Check, CheckRow, CheckStep
from tests.controller.remote.test_teacher import Orb
from tests.controller.remote.test_teacher import make as make

DEPTH_MM, RADIUS_MM = 8.0, 7.0


def checked(orb: Orb, hand: Callable[[CheckStep], tuple[Contact, ...]]) -> list[Message]:
    """Run a check; `hand` puts fingers on the dome for a step."""
    said: list[Message] = []
    fingers: tuple[Contact, ...] = ()
    orb.ask(Check(True))
    while not (said and isinstance(said[-1], CheckStep) and said[-1].step == "over"):
        for message in orb.run(0.1, *fingers):
            said.append(message)
            if isinstance(message, CheckStep):
                fingers = hand(message)
    return said


def obedient(step: CheckStep) -> tuple[Contact, ...]:
    if step.step != "press":
        return ()
    return (Contact(1, float(step.column), 4.0 - step.row, DEPTH_MM, RADIUS_MM),)


def rows(said: list[Message]) -> dict[str, CheckRow]:
    return {row.name: row for row in said if isinstance(row, CheckRow)}


def test_a_sound_orb_has_no_fault_and_is_calibrated(
    make: Callable[..., Orb],
) -> None:
    orb = make()
    said = checked(orb, obedient)
    assert {row.verdict for row in rows(said).values()} == {"good"}
    assert "9 presses were felt" in rows(said)["touches"].found
    kept = calibration_store.load(orb.device.sensor.device_id)
    assert kept is not None
    shares = [step.progress for step in said if isinstance(step, CheckStep)]
    assert shares == sorted(shares)


def test_a_lead_that_is_off_is_found(make: Callable[..., Orb]) -> None:
    said = checked(make("--fault", "open_row:2"), obedient)
    assert "row 2" in " ".join(rows(said))
    assert "FAULT" in {row.verdict for row in rows(said).values()}


def test_an_orb_that_is_touched_is_not_calibrated(make: Callable[..., Orb]) -> None:
    orb = make()
    pinch = (Contact(1, 2.0, 2.0, DEPTH_MM, RADIUS_MM),)
    said = checked(orb, lambda step: pinch if 0.1 < step.progress < 0.15 else ())
    assert rows(said)["rest"].code == "touched"
    assert calibration_store.load(orb.device.sensor.device_id) is None


def test_a_check_that_is_stopped_ends_without_a_verdict(
    make: Callable[..., Orb],
    tmp_path: Path,
) -> None:
    orb = make()
    orb.ask(Check(True))
    orb.ask(Check(False))
    said = [orb.answer()]
    while not (isinstance(said[-1], CheckStep) and said[-1].step == "over"):
        said.append(orb.answer())
    assert rows(said) == {}
