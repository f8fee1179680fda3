"""The paper's histogram statistics, on distributions whose answers are known."""

import numpy as np
import pytest

from models.studies.paper.section6 import (
    BITS,
    entropy,
    null_information,
    recorded,
    statistics,
)
from tests.support.recordings import of, origin, played


def test_the_papers_label_entropy_is_nats_printed_as_bits() -> None:
    # Section 6: five classes, p_static = .57, H(y) = "1.28 bits": so it is, in nats.
    y = np.repeat(np.arange(5), [2280, 430, 430, 430, 430])
    assert entropy(y) == pytest.approx(1.28, abs=0.005)
    assert entropy(y) * BITS == pytest.approx(1.85, abs=0.005)
    assert entropy(np.arange(5)) * BITS == pytest.approx(2.32, abs=0.005)  # figure 9's bar


def test_a_signal_that_is_the_label_says_all_of_it() -> None:
    y = np.repeat([0, 1, 2, 3], 250)
    found = statistics(y[:, None].astype(float), y, scaling="global")
    assert found.information[0] == pytest.approx(np.log(4))
    assert found.h_y == pytest.approx(np.log(4))


def test_scaling_each_gesture_on_its_own_hides_what_its_size_says() -> None:
    rng = np.random.default_rng(0)
    y = np.repeat([0, 1], 5000)
    z = rng.uniform(0.0, 1.0, (10_000, 1)) * np.where(y == 1, 10.0, 1.0)[:, None]
    by_label = statistics(z, y, scaling="paper").information[0]
    together = statistics(z, y, scaling="global").information[0]
    assert by_label < 0.01
    assert together > 0.3


def test_the_bias_that_is_taken_off_is_what_chance_alone_fills_cells_with() -> None:
    rng = np.random.default_rng(2)
    z, y = rng.uniform(size=(3000, 8)), rng.integers(0, 5, 3000)
    counted = statistics(z, y, scaling="global").information.mean()
    sound = statistics(z, y, scaling="global", corrected=True).information.mean()
    assert counted > 0.012  # (25 - 1) (5 - 1) / 2n = 0.016
    assert abs(sound) < 0.003
    assert null_information(z, y) == pytest.approx(counted, abs=0.004)


def test_what_drifts_agrees_by_chance_with_labels_that_last() -> None:
    # Class by class, as the paper records: a sensor that only drifts seems to know the label, and
    # goes on doing so when the labels are moved in time; shuffled, they betray nothing.
    y = np.repeat(np.arange(5), 1000)
    drift = np.cumsum(np.random.default_rng(3).normal(size=(5000, 6)), axis=0)
    assert statistics(drift, y, scaling="global").information.mean() > 0.5
    assert null_information(drift, y, slow=True) > 0.5
    assert null_information(drift, y) < 0.02


def test_the_correction_is_that_of_infomeasure() -> None:
    infomeasure = pytest.importorskip("infomeasure", reason="the oracle infomeasure is missing")
    rng = np.random.default_rng(4)
    y = rng.integers(0, 3, 500)
    z = (y[:, None] + rng.integers(0, 4, (500, 1))).astype(float)
    ours = statistics(z, y, "global", corrected=True, bins=7).information[0]
    peer = infomeasure.mutual_information(z[:, 0].astype(int), y, approach="miller_madow", base="e")
    assert ours == pytest.approx(peer, abs=1e-9)


def test_the_paper_takes_all_frames_the_first_ten_seconds_and_the_button() -> None:
    recording = played()
    z, y = recorded([recording])
    assert z.shape == (len(recording.frames), 25)
    assert z[:100].mean(axis=0) == pytest.approx(1.0)
    assert y.tolist() == recording.button.tolist()


def test_sensors_of_two_kinds_are_not_mixed() -> None:
    small = of(np.ones((50, 2, 2)), origin(2, 2), label=np.zeros(50))
    with pytest.raises(ValueError, match="one kind"):
        recorded([played(), small])
