"""The kept waveforms are what ngspice makes of their orbs, and what its circuit says of wirings."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from tests.reference import circuits, spice, waveforms

pytestmark = pytest.mark.skipif(
    shutil.which("ngspice") is None, reason="ngspice is not installed (a Debian package)"
)


def test_the_first_orb_comes_out_as_it_was_kept() -> None:
    data = np.load(waveforms.FILE)
    parts = spice.draw(np.random.default_rng(2018))
    assert data["picofarads"][0, 0] == pytest.approx(parts.taxels_pf, rel=1e-6)
    kept = data["column"][0, 0] * waveforms.STEP_V
    assert waveforms.held(parts, "column") == pytest.approx(kept, abs=2e-4)


def test_a_lone_capacitor_divides_and_bleeds_as_it_must() -> None:
    # All but one taxel are gone, so the formula is a school's.
    taxels = np.full((5, 5), 1e-6)
    taxels[circuits.ROW, circuits.COLUMN] = 41.2
    parts = replace(circuits.CIRCUITS["R_m to ground, 100 pF (ours)"], taxels_pf=taxels)
    on_row_pf = 41.2 + 100.0 + 18.0 + 5.0 + parts.input_pf
    for slot_s in circuits.SLOTS_S:
        bled = np.exp(-slot_s / (50e6 * on_row_pf * 1e-12))
        shared = on_row_pf / (on_row_pf + parts.sample_pf)
        volts = spice.SUPPLY_V * 41.2 / on_row_pf * bled * shared
        assert circuits.seen(parts, slot_s) == pytest.approx(volts, rel=0.01)


def test_fifty_megohms_before_a_converter_want_a_follower_and_ours_none() -> None:
    bare = circuits.CIRCUITS["R_m before the converter"]
    ours = circuits.CIRCUITS["R_m to ground, 100 pF (ours)"]
    slot_s = circuits.SLOTS_S[0]

    def remembered(parts: spice.Parts) -> float:
        """How much of the last reading is in this one."""
        return (circuits.seen(parts, slot_s, 0.5) - circuits.seen(parts, slot_s)) / 0.5

    assert remembered(bare) > 0.6
    assert remembered(replace(bare, buffered=True)) < 0.01
    assert remembered(ours) < 0.07
