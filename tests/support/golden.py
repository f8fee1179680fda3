"""Answers of today against those of a file."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Answers = dict[str, NDArray[Any]]


def compare(path: Path, now: Answers) -> None:
    """Fail unless texts are equal, and numbers as good as equal, to those of an .npz file."""
    with np.load(path) as golden:
        assert set(golden.files) == set(now)
        for name in golden.files:
            if golden[name].dtype.kind == "U":
                assert list(golden[name]) == list(now[name]), name
            else:
                np.testing.assert_allclose(
                    now[name], golden[name], rtol=1e-4, atol=1e-5, err_msg=name
                )
