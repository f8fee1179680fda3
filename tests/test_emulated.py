"""Emulated hardware: a driver's picofarads are those of the skin, and faults are felt."""

import numpy as np
import pytest

pytest.importorskip("gpiozero", reason="the emulated hardware uses gpiozero's mock pins")

from controller.hardware.driver import Driver
from controller.hardware.emulated.bench import Bench
from controller.hardware.emulated.faults import KINDS, WiringFault
from controller.hardware.wiring import SCHEMES, Scheme, Wiring


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_driver_reads_what_the_skin_is(scheme: Scheme) -> None:
    bench = Bench(Wiring(scheme=scheme), seed=3)
    driver = Driver(bench.board)
    rest = np.mean([driver.frame() for _ in range(8)], axis=0)
    assert rest == pytest.approx(bench.picofarads, rel=0.05)  # nobody has measured its rows
    pressed = bench.picofarads.copy()
    pressed[2, 2] *= 0.6
    pressed[2, 3] *= 0.9
    z = pressed / bench.picofarads
    bench.touch(pressed)
    image = np.mean([driver.frame() for _ in range(8)], axis=0) / rest
    assert image == pytest.approx(z, abs=0.006)  # what the rows have cancels


@pytest.mark.parametrize("kind", KINDS)
def test_every_fault_can_be_switched_on_and_off_again(kind: str) -> None:
    place = {"taxel": ":1,3", "row": ":1", "rows": ":1", "column": ":3", "columns": ":3", "": ""}
    fault = WiringFault.parse(kind + place[KINDS[kind].place])
    bench = Bench(seed=3)
    bench.switch([fault])
    assert bench.faults == (fault,)
    bench.switch([fault], on=False)
    frame = Driver(bench.board).frame()
    assert frame == pytest.approx(bench.picofarads, rel=0.08)
