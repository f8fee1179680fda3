"""The kept waveforms are what ngspice makes of their orbs, and its circuit is sound."""

import shutil

import numpy as np
import pytest

from tests.reference import spice, waveforms

pytestmark = pytest.mark.skipif(
    shutil.which("ngspice") is None, reason="ngspice is not installed (a Debian package)"
)


def test_the_first_orb_comes_out_as_it_was_kept() -> None:
    data = np.load(waveforms.FILE)
    parts = spice.draw(np.random.default_rng(2018))
    assert data["picofarads"][0, 0] == pytest.approx(parts.taxels_pf, rel=1e-6)
    kept = data["column"][0, 0] * waveforms.STEP_V
    assert waveforms.held(parts, "column") == pytest.approx(kept, abs=2e-4)


@pytest.mark.parametrize("slot_s", [0.0001, 0.0024])  # the driver's settling time, and the paper's
def test_a_lone_capacitor_divides_and_bleeds_as_it_must(slot_s: float) -> None:
    # All but one taxel are gone, so the formula is a school's.
    taxels = np.full((5, 5), 1e-6)
    taxels[2, 2] = 41.2
    parts = spice.Parts(
        taxels, film_ohm=np.full(10, 1000.0), stray_pf=np.full(10, 18.0), row_pf=np.full(5, 100.0),
        bleed_ohm=np.full(5, 50e6), leak_a=np.zeros(5), gate_pf=0.0,
    )  # fmt: skip
    line, rise = spice.Timeline(), 50e-6
    end = rise + slot_s + 50e-6
    for row in range(5):
        line.close(f"g{row}", 0.0, rise - 15e-6 if row == 2 else end)
    line.close("c2", rise, end)
    line.close("s2", rise + slot_s, rise + slot_s + spice.SAMPLE_S)
    times, seen = spice.run(spice.netlist(parts, line), ["adc"])
    on_row_pf = 41.2 + 100.0 + 18.0 + 5.0 + parts.input_pf
    bled = np.exp(-slot_s / (50e6 * on_row_pf * 1e-12))
    shared = on_row_pf / (on_row_pf + parts.sample_pf)
    volts = spice.SUPPLY_V * 41.2 / on_row_pf * bled * shared
    read = spice.at(times, seen, np.array([rise + slot_s + 3e-6]))[0, 0]
    assert read == pytest.approx(volts, rel=0.01)
