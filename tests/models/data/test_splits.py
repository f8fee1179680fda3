"""Splits: what is tested on shares no frame with what was trained on."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from models.data import splits
from models.data.splits import LeakError

WINDOW = 3
SESSION = np.repeat([0, 1, 2], 10)  # three sessions of ten frames
ENDS = np.array([e for s in range(3) for e in range(10 * s + 2, 10 * s + 10)])


def frames_of(ends: np.ndarray) -> set[int]:
    return {frame for end in ends for frame in range(end - WINDOW + 1, end + 1)}


def test_every_session_is_tested_once_and_never_trained_on_then() -> None:
    with pytest.raises(ValueError, match="only one to split by"):
        splits.by_group(ENDS[:5], WINDOW, SESSION)
    folds = splits.by_group(ENDS, WINDOW, SESSION)
    assert [fold.name for fold in folds] == ["0", "1", "2"]
    for number, fold in enumerate(folds):
        assert set(SESSION[ENDS[fold.test]]) == {number}
        assert number not in SESSION[ENDS[fold.train]]


def test_blocks_of_time_test_every_part_of_every_session() -> None:
    first, second = splits.by_time(ENDS, WINDOW, SESSION, blocks=2)
    assert frames_of(ENDS[first.test]) == {*range(5), *range(10, 15), *range(20, 25)}
    assert frames_of(ENDS[first.train]) == {*range(5, 10), *range(15, 20), *range(25, 30)}
    assert len(second.test) == len(first.train)


@given(
    lengths=st.lists(st.integers(10, 60), min_size=1, max_size=4),
    window=st.integers(1, 10),
    blocks=st.integers(2, 6),
    gap=st.integers(0, 12),
)
def test_no_frame_is_ever_on_both_sides_and_the_gap_is_kept(
    lengths: list[int], window: int, blocks: int, gap: int
) -> None:
    session = np.repeat(np.arange(len(lengths)), lengths)
    starts = np.cumsum([0, *lengths[:-1]])
    ends = np.array(
        [e for s, n in zip(starts, lengths, strict=True) for e in range(s + window - 1, s + n)]
    )
    for fold in splits.by_time(ends, window, session, blocks, gap):
        trained = {f for e in ends[fold.train] for f in range(e - window + 1, e + 1)}
        tested = {f for e in ends[fold.test] for f in range(e - window + 1, e + 1)}
        assert all(f + d not in tested for f in trained for d in range(-gap, gap + 1))


def test_windows_at_random_share_nearly_every_frame() -> None:
    ends = np.arange(9, 2000)
    fold = splits.random_windows(len(ends), 0.2, np.random.default_rng(1))
    assert len(fold.test) == round(0.2 * len(ends))
    with pytest.raises(LeakError, match="frames on both sides"):
        splits.check(fold, ends, 10)


def test_asking_for_random_windows_is_refused_with_the_reason() -> None:
    with pytest.raises(LeakError, match="that of memory; split by session, user, time"):
        splits.require("windows")
    with pytest.raises(ValueError, match="there is no split by 'mood'"):
        splits.require("mood")
    assert splits.require("user") == "user"
