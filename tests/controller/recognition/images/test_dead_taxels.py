"""Taxels that feel nothing: they are found, and stood in for."""

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.recognition.images.dead_taxels import ResponseMonitor, TaxelInterpolator
from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.preprocess import Preprocessor
from controller.shared.taxel_measures import noisy
from controller.simulator.dome.faults import Fault
from controller.simulator.orb import NOMINAL, preset
from controller.simulator.session import simulate
from tests.benchmarks import phantom

CENTRES = np.random.default_rng(1).uniform(-0.5, 4.5, (400, 2))


def dent(x: float, y: float) -> NDArray[np.float64]:
    """A smooth dent."""
    row, column = np.indices((5, 5))
    return np.asarray(-0.3 * np.exp(-((row - y) ** 2 + (column - x) ** 2) / 3.0))


def broken(*places: tuple[int, int]) -> NDArray[np.bool_]:
    mask = np.zeros((5, 5), dtype=np.bool_)
    for place in places:
        mask[place] = True
    return mask


def test_a_taxel_is_filled_in_from_those_around_it() -> None:
    change, mask = dent(2.0, 2.0), broken((2, 2))
    filled = TaxelInterpolator(5, 5).fill(np.where(mask, 0.0, change), mask)
    assert filled[2, 2] == pytest.approx(change[2, 2], abs=0.1)
    np.testing.assert_array_equal(filled[~mask], change[~mask])


@pytest.mark.parametrize(("rows", "columns"), [(5, 5), (3, 7), (1, 4)])
def test_each_taxel_would_be_filled_with_what_all_others_say(rows: int, columns: int) -> None:
    filler = TaxelInterpolator(rows, columns)
    change = np.random.default_rng(2).normal(0.0, 0.1, (rows, columns))
    around = filler.around(change)
    for place in np.ndindex(rows, columns):
        mask = np.zeros((rows, columns), dtype=np.bool_)
        mask[place] = True
        assert around[place] == pytest.approx(filler.fill(change, mask)[place], abs=1e-12)


def test_a_large_sensor_is_ready_at_once() -> None:
    """It took a minute of the first touch when each taxel was solved for by itself."""
    assert TaxelInterpolator(30, 30).around(np.zeros((30, 30))).shape == (30, 30)


def test_a_whole_row_is_filled_in_from_the_others() -> None:
    change, mask = dent(3.0, 2.5), broken(*((2, column) for column in range(5)))
    filled = TaxelInterpolator(5, 5).fill(np.where(mask, 0.0, change), mask)
    assert np.abs(filled - change)[2].max() < 0.08
    assert filled[2].argmin() == 3


def test_where_all_are_broken_nothing_is_made_up() -> None:
    assert not TaxelInterpolator(2, 3).fill(np.ones((2, 3)), np.ones((2, 3), dtype=np.bool_)).any()


def test_a_taxel_that_does_not_answer_is_found_and_forgiven_once_it_does() -> None:
    answers, dead = ResponseMonitor(5, 5, 10.0), None
    for number, place in enumerate(np.tile(CENTRES, (3, 1))):
        change = dent(*place)
        if number < 500:
            change[1, 3] = 0.0
        touch(answers, change)
        if number == 499:
            dead = answers.dead
    assert dead is not None
    assert np.argwhere(dead).tolist() == [[1, 3]]
    assert answers.dead is None


FILLER = TaxelInterpolator(5, 5)


def touch(answers: ResponseMonitor, change: NDArray[np.float64], frames: int = 5) -> None:
    """Show a monitor a touch, and the pause after it."""
    for frame in range(frames + 3):
        answers.learn(change if frame < frames else np.zeros((5, 5)), FILLER)


def test_a_taxel_is_dead_after_several_touches_on_it_however_long_they_are() -> None:
    answers = ResponseMonitor(5, 5, 10.0)
    change = np.where(broken((2, 2)), 0.0, dent(2.3, 2.1))
    touch(answers, change, frames=1000)
    assert answers.dead is None
    touch(answers, change)
    touch(answers, change)
    assert answers.dead is not None
    assert np.argwhere(answers.dead).tolist() == [[2, 2]]


def test_taxels_on_which_no_touch_lay_are_not_judged() -> None:
    """A player who clicks at one place, where the dome around the finger rises."""
    answers, far = ResponseMonitor(5, 5, 10.0), np.indices((5, 5)).sum(axis=0) > 3
    for _ in range(200):
        touch(answers, np.where(far, 0.02, dent(1.0, 1.0)))
    assert answers.dead is None


def test_several_fingers_around_a_taxel_say_nothing_of_it() -> None:
    answers = ResponseMonitor(5, 5, 10.0)
    fingers = [dent(2 + 1.8 * np.cos(angle), 2 + 1.8 * np.sin(angle)) for angle in np.arange(5)]
    hand = np.minimum(np.sum(fingers, axis=0) + 0.4, 0.02)  # the dome rises in the middle
    for _ in range(20):
        touch(answers, hand)
    assert answers.dead is None


@pytest.mark.parametrize("name", ["nominal", "paper-snr"])
def test_a_dead_taxel_of_a_simulated_orb_is_found_in_play(name: str) -> None:
    seeds = np.random.SeedSequence([3, 7]).spawn(5)
    session = simulate(seeds, 2.0, model=preset(name), faults=[Fault.parse("dead:2,1")])
    stage = Preprocessor(PreprocessSettings(), NOMINAL.rows, NOMINAL.columns)
    prepared = [stage.step(frame) for frame in session.frames][-1]
    assert prepared.dead is not None
    assert np.argwhere(prepared.dead).tolist() == [[2, 1]]


def test_clicks_on_a_noisy_orb_find_a_dead_taxel_though_each_frame_looks_untouched() -> None:
    found_s = phantom.play(
        "paper-snr", "play", 2506, 30.0, "dead:1,1", lambda dead: bool(dead[1, 1])
    )
    assert found_s is not None


@pytest.mark.parametrize("seed", [2000, 7484012])
def test_hands_that_close_around_a_taxel_and_raise_it_say_nothing_of_it(seed: int) -> None:
    """The first frames of a squeeze look like one finger on a taxel that answers the wrong way."""
    assert phantom.play("nominal", "squeezes", seed, 90.0, "", lambda dead: True) is None


def test_evidence_is_taken_over_unless_its_form_is_that_of_before() -> None:
    monitor = ResponseMonitor(5, 5, 10.0)
    shape = monitor.evidence.shape
    monitor.restore(np.full(shape, 0.5), np.arange(6.0))
    assert (monitor.evidence == 0.5).all()
    monitor.restore(np.ones((shape[0] - 1, 5, 5)), np.zeros(6))
    assert (monitor.evidence == 0.5).all()
    assert monitor.counts.tolist() == list(range(6))


def test_without_any_noise_in_the_middle_no_taxel_is_noisy() -> None:
    level = np.array([[0.0, 0.0, 100.0]])
    assert not noisy(level).any()
    assert noisy(level, least=1.0).tolist() == [[False, False, True]]
