"""Faults: each does what its name says, from the moment it is switched on until it is off."""

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.simulator.dome.faults import Fault, FaultError
from controller.simulator.orb import OrbSimulator, PresetError, preset

FRAMES = 60


def frames(*faults: str, press: bool = False, seconds: float = 6.0) -> NDArray[np.float32]:
    """Frames of an orb with these faults from its first frame on; a press in the middle of it."""
    orb = OrbSimulator(np.random.SeedSequence(4))
    orb.electronics.switch([Fault.parse(text) for text in faults])
    steps = round(seconds * 10) * orb.steps_per_frame
    depth = np.zeros((steps, 6))
    if press:
        depth[steps // 3 :, 0] = 8.0
    return orb.advance(np.zeros((steps, 6), dtype=np.complex128), depth, np.full((steps, 6), 7.0))


def reaction(picture: NDArray[np.float32]) -> NDArray[np.float64]:
    """|z - 1| of every taxel under the press."""
    return np.asarray(np.abs(picture[-10:].mean(axis=0) / picture[:15].mean(axis=0) - 1.0))


def test_a_dead_taxel_feels_nothing_and_a_leaky_one_less() -> None:
    sound, broken = reaction(frames(press=True)), reaction(frames("dead:2,2", press=True))
    leaky = reaction(frames("leaky:2,2=0.001", press=True))
    assert sound[2, 2] > 0.2
    assert broken[2, 2] < 0.05  # the finger itself loads the row
    assert 0.4 < leaky[2, 2] / sound[2, 2] < 0.8
    assert broken[2, 1] == pytest.approx(sound[2, 1], abs=0.02)


def test_an_open_lead_silences_its_line() -> None:
    row, column = frames("open_row:1").mean(axis=0), frames("open_column:4").mean(axis=0)
    assert (row[1] < 5.0).all()
    assert (np.delete(row, 1, axis=0) > 25.0).all()
    assert (column[:, 4] < 5.0).all()


def test_two_shorted_electrodes_read_their_sum_alike() -> None:
    sound, shorted = frames().mean(axis=0), frames("short_row:2").mean(axis=0)
    assert shorted[2] == pytest.approx(shorted[3], rel=0.02)
    assert (shorted[2] > 1.3 * sound[2]).all()


def test_an_air_leak_and_warmth_pull_all_taxels_along() -> None:
    sound = frames(seconds=60.0)
    leak, warm = frames("air_leak=0.2", seconds=60.0), frames("temperature=0.1", seconds=60.0)
    # The pressure falls to exp(-.2), C with its square; ghosting, which goes along, hides a part.
    assert np.exp(-0.4) < np.median(leak[-10:] / sound[-10:]) < np.exp(-0.2)
    assert 1.05 < np.median(warm[-10:] / sound[-10:]) < 1.1


def test_a_saturated_converter_clips() -> None:
    clipped = frames("saturation=0.9")
    assert clipped.max() < frames().max()
    assert (clipped == clipped.max()).mean() > 0.5


def test_mains_and_a_jittering_loop_add_noise_and_nothing_else() -> None:
    sound = frames()
    hum = frames("mains=0.05")
    # 60 Hz is six times the frame rate: most of the hum hides as an offset of each taxel.
    assert hum.std(axis=0).mean() > 1.5 * sound.std(axis=0).mean()
    assert np.abs(hum.mean(axis=0) / sound.mean(axis=0) - 1.0).max() > 0.03
    assert hum.mean() == pytest.approx(sound.mean(), rel=0.02)
    late = frames("jitter=0.03", press=True)
    assert np.isfinite(late).all()


def test_a_fault_can_be_switched_on_and_off_at_any_time() -> None:
    orb = OrbSimulator(np.random.SeedSequence(4))
    still = np.zeros((5, 6), dtype=np.complex128), np.zeros((5, 6)), np.full((5, 6), 7.0)
    fault = Fault.parse("open_row:0")
    before = orb.advance(*still)
    orb.electronics.switch([fault])
    during = orb.advance(*still)
    orb.electronics.switch([fault], on=False)
    after = orb.advance(*still)
    assert during[0, 0].max() < 5.0
    assert after[0, 0] == pytest.approx(before[0, 0], rel=0.05)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("broken", "there is no fault 'broken'; there are dead"),
        ("dead", "write dead:ROW,COLUMN"),
        ("open_row:1,2", "write open_row:NUMBER"),
        ("dead:5,0", "not on a grid of 5 rows"),
        ("short_column:4", "not on a grid of 5 rows and 5 columns"),
        ("air_leak=1.2.3", "no number"),
    ],
)
def test_a_fault_that_cannot_be_is_refused_in_one_sentence(text: str, sentence: str) -> None:
    with pytest.raises(FaultError, match=sentence):
        Fault.parse(text)


def test_an_unknown_preset_is_refused_with_the_known_ones() -> None:
    with pytest.raises(PresetError, match="nominal, paper-snr"):
        preset("noisy")
