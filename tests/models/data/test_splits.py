"""Splits: what is tested on shares no frame with what was trained on."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from models.data import splits
from models.data.splits import LeakError


@given(lengths=st.lists(st.integers(10, 60), min_size=1, max_size=4), window=st.integers(1, 10))
def test_the_last_sixth_is_a_window_away_from_the_rest(lengths: list[int], window: int) -> None:
    starts = np.cumsum([0, *lengths[:-1]])
    session = np.repeat(np.arange(len(lengths)), lengths)
    ends = np.array(
        [e for s, n in zip(starts, lengths, strict=True) for e in range(s + window - 1, s + n)]
    )
    train, test = splits.last_blocks(ends, window, session)
    splits.check(train, test, ends, window)
    last = {f for s, n in zip(starts, lengths, strict=True) for f in range(s + n - n // 6, s + n)}
    trained, tested = (
        {f for e in ends[part] for f in range(e - window + 1, e + 1)} for part in (train, test)
    )
    assert tested <= last
    assert all(f + d not in last for f in trained for d in range(-window, window + 1))
    assert test.sum() == sum(max(0, n // 6 - window + 1) for n in lengths)


def test_windows_at_random_share_nearly_every_frame() -> None:
    ends = np.arange(9, 2000)
    test = splits.random_windows(len(ends), 0.2, np.random.default_rng(1))
    assert test.sum() == round(0.2 * len(ends))
    with pytest.raises(LeakError, match="frames on both sides"):
        splits.check(~test, test, ends, 10)


def test_asking_for_random_windows_is_refused_with_the_reason() -> None:
    with pytest.raises(LeakError, match="that of memory; split by session, user, time"):
        splits.require("windows")
    with pytest.raises(ValueError, match="there is no split by 'mood'"):
        splits.require("mood")
    assert splits.require("user") == "user"
