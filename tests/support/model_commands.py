"""Commands of the training machine that are refused, and small examples for its tests."""

import numpy as np
import pytest

from models.__main__ import main
from models.data.examples import Examples


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """Return the one sentence of a command that is refused, without the program's name."""
    capsys.readouterr()
    assert main([str(word) for word in words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.splitlines()
    assert line.startswith("models: ")
    return line.removeprefix("models: ")


def examples(
    label: list[int],
    session: list[int] | None = None,
    images: "np.ndarray | None" = None,
    ends: list[int] | None = None,
    window: int = 1,
) -> Examples:
    """Return frames of these classes without places; the images are numbered, (frames, 2, 2)."""
    count = len(label)
    numbered = np.arange(count, dtype=np.float32)[:, None, None] * np.ones((2, 2), np.float32)
    return Examples(
        numbered if images is None else images,
        np.array(label),
        np.full((count, 2), np.nan, dtype=np.float32),
        np.arange(window - 1, count) if ends is None else np.array(ends),
        np.array(session or [0] * count, dtype=np.int32),
        np.zeros(count, dtype=np.float32),
        window,
    )
