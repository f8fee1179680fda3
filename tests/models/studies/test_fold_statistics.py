"""Folds by people: who is judged when, by what, and how sure one may be of it."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tests.support.synthetic_people as look_alike
from controller.recordings import importer
from controller.recordings.description import described
from models.data import splits
from models.data.examples import Examples, run_starts
from models.results import storage
from models.studies import fold_statistics, trajectory_baseline
from models.studies.fold_statistics import Windows
from tests.support import ROOT
from tests.support.model_commands import examples

WINDOW = 3
DESCRIPTION = ROOT / "docs" / "people" / "capfingerid.toml"


@settings(deadline=None, max_examples=40)
@given(sizes=st.lists(st.integers(WINDOW, 12), min_size=4, max_size=9), count=st.integers(2, 4))
def test_everybody_is_judged_once_and_nobody_judged_chooses(sizes: list[int], count: int) -> None:
    person = np.repeat(np.arange(len(sizes)), sizes)
    at = np.cumsum([0, *sizes[:-1]])
    end = np.concatenate([np.arange(s + WINDOW - 1, s + n) for s, n in zip(at, sizes, strict=True)])
    judged: list[int] = []
    for fold in splits.by_group(end, WINDOW, person, count):
        inner = fold_statistics.within(fold, end, WINDOW, person)
        now = set(person[end[fold.test]])
        learned, chosen = set(person[end[inner.train]]), set(person[end[inner.test]])
        assert learned
        assert chosen
        assert not learned & chosen
        assert not now & (learned | chosen)
        assert learned | chosen == set(person[end[fold.train]])
        judged += sorted(now)
    assert sorted(judged) == list(range(len(sizes)))


def test_a_fold_that_learns_from_one_person_has_nobody_to_choose_on() -> None:
    person = np.repeat([0, 1], 5)
    ends = np.array([2, 3, 4, 7, 8, 9])
    fold = splits.by_group(ends, WINDOW, person)[0]
    with pytest.raises(ValueError, match="nobody to choose on"):
        fold_statistics.within(fold, ends, WINDOW, person)


def test_a_stretch_ends_where_a_frame_is_missed_or_another_class_begins() -> None:
    ends = np.array([4, 5, 6, 8, 9, 10, 11])
    label = np.array([1, 1, 1, 1, 1, 2, 2])
    session = np.array([0, 0, 0, 0, 0, 0, 1])
    starts = run_starts(ends, label, session, gap=1)
    assert (np.cumsum(starts) - 1).tolist() == [0, 0, 0, 1, 1, 2, 3]


def rowed() -> Windows:
    """Three people, with two stretches of four windows each, of one class and of the other."""
    label = np.tile(np.repeat([0, 1], 4), 3)
    return Windows(
        label,
        stretch=np.repeat(np.arange(6), 4),
        person=np.repeat([0, 1, 2], 8),
        labels=("press", "pinch"),
        people=("ada", "ben", "cy"),
    )


def certain(named: np.ndarray) -> np.ndarray:
    return np.asarray(np.eye(2)[named] * 0.8 + 0.1)


def test_windows_and_stretches_are_counted_and_the_gain_is_ours_less_theirs() -> None:
    rows = rowed()
    ours, other = rows.label.copy(), rows.label.copy()
    ours[0] = 1  # one window of four: the stretch is still named rightly
    other[8:11] = 1  # three of four: the stretch is lost
    other[16] = 1
    ends = np.arange(24) * 10
    rounds = splits.by_group(ends, 1, np.repeat(rows.person, 10))
    mine = fold_statistics.judge(rows, rounds, "ours", certain(ours), 1.0)
    assert mine.windows.value == pytest.approx(23 / 24)
    assert mine.windows.low <= 23 / 24 <= mine.windows.high
    assert mine.stretches.value == 1.0
    assert mine.confusion == ((11, 1), (0, 12))
    assert mine.by_fold == mine.by_person == (7 / 8, 1.0, 1.0)
    theirs = fold_statistics.judge(rows, rounds, "theirs", certain(other), 1.0)
    assert theirs.stretches.value == pytest.approx(5 / 6)
    more = fold_statistics.gain(rows, certain(ours), certain(other))
    assert more.windows.value == pytest.approx(3 / 24)
    assert more.windows.low == pytest.approx(-1 / 8)  # only ada, three times
    assert more.stretches.value == pytest.approx(1 / 6)
    assert more.ahead == 2


def test_the_report_names_everybody_and_json_has_no_nan() -> None:
    rows = rowed()
    ends = np.arange(24) * 10
    rounds = splits.by_group(ends, 1, np.repeat(rows.person, 10))
    model = fold_statistics.judge(rows, rounds, "ours", certain(rows.label), 60.0)
    found = fold_statistics.CrossValidation(
        command="models folds",
        software="test",
        data="24 windows",
        how=(),
        labels=rows.labels,
        majority=0.5,
        windows=24,
        stretches=6,
        people=rows.people,
        held=rows.people,
        chosen=("", "", ""),
        models=(replace(model, cpu_s=float("nan")), replace(model, name="theirs")),
        gain=fold_statistics.gain(rows, certain(rows.label), certain(1 - rows.label)),
        reading_cpu_s=1.0,
        cpu_minutes=2.0,
    )
    told = fold_statistics.text(found)
    assert "| ada | 1.000 |" in told
    assert "+100.0 points (+100.0 … +100.0) | +100.0" in told
    assert "better for 3 of 3 people" in told
    assert json.loads(storage.json_text(asdict(found)))["models"][0]["cpu_s"] is None


def windowed(images: np.ndarray) -> Examples:
    """Two windows of these six images."""
    return examples([0] * 6, images=images, ends=[2, 5], window=WINDOW)


X, Y = slice(0, WINDOW), slice(WINDOW, 2 * WINDOW)
SPREAD, TOTAL = slice(2 * WINDOW, 3 * WINDOW), slice(3 * WINDOW, 4 * WINDOW)


def moving() -> np.ndarray:
    """A finger over three rows that goes to the right, a taxel an image; the first is untouched."""
    images = np.ones((6, 6, 7), dtype=np.float32)
    for i in range(1, 6):
        images[i, 1:4, i] = 2.0, 3.0, 2.0
    return images


def test_the_plain_model_sees_where_a_touch_is_how_wide_and_how_strong() -> None:
    rows = trajectory_baseline.features(windowed(moving()))
    assert rows[1, X].tolist() == [3.0, 4.0, 5.0]
    assert rows[1, Y].tolist() == [2.0, 2.0, 2.0]
    assert rows[1, SPREAD].tolist() == pytest.approx([np.sqrt(0.5)] * 3)
    assert rows[1, TOTAL].tolist() == [4.0, 4.0, 4.0]
    assert rows[0, X].tolist() == [-1.0, 1.0, 2.0]  # nowhere, then it is touched


def test_a_signal_that_falls_under_touch_is_seen_like_one_that_rises() -> None:
    """A sensor whose counts fall gives the plain model the features of one whose counts rise."""
    up, down = windowed(moving()), windowed(np.float32(2.0) - moving())
    rising, falling = (trajectory_baseline.features(one) for one in (up, down))
    np.testing.assert_array_equal(rising, falling)
    assert (rising[1, TOTAL] > 0.0).all()


def test_a_taxel_that_is_read_wrongly_moves_no_centroid() -> None:
    images = moving()
    images[:, 5, 6] = 2.5  # alone in its corner, in every image
    images[4, 4, 0] = -3.0  # what is below untouched counts for nothing
    clean = trajectory_baseline.features(windowed(moving()))
    np.testing.assert_allclose(trajectory_baseline.features(windowed(images)), clean, rtol=1e-6)


def test_the_description_that_ships_reads_what_looks_like_capfingerid() -> None:
    told = described(DESCRIPTION)
    made = list(importer.recordings(look_alike.arrays(people=2), told))
    assert [(r.origin.user, r.origin.session) for r in made] == [
        ("00", "leftthumb"), ("00", "rightthumb"), ("01", "leftthumb"), ("01", "rightthumb"),
    ]  # fmt: skip
    assert made[0].origin.labels == ("null", "drag", "scroll", "tap")
    # Frames over time; the one that is read twice in each stretch is dropped.
    kept = (look_alike.STRETCH - 2) / (look_alike.STRETCH - 1)
    assert made[0].origin.rate_hz == pytest.approx(kept / look_alike.STEP_S, abs=0.1)
    assert (np.diff(made[0].sequence) > 1).sum() == 8  # nine stretches
