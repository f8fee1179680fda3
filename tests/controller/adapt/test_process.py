"""Learning in a process of its own."""

import pickle
import subprocess
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from controller.adapt import few_shot, process
from controller.adapt.examples import Example
from controller.adapt.few_shot import AdaptError
from controller.bundles import bundle

SHIPPED = bundle.default_path(10.0)
HOLD = partial(process.set_command, label="press", command="hold")


def unexpected(path: Path) -> None:
    """Install nothing."""
    pytest.fail("a bundle was made")


def swipe() -> Example:
    """An example of a finger that crosses the sensor."""
    images = np.ones((30, 5, 5), np.float32)
    for step in range(5):
        images[10 + step, 2, step] = 0.5
    return Example("swipe", images)


def test_a_change_is_made_installed_and_its_outcome_returned(tmp_path: Path) -> None:
    shares: list[float] = []
    read: list[bundle.Bundle] = []
    made = process.alter(
        HOLD, SHIPPED, tmp_path, lambda out: read.append(bundle.read(out)), shares.append
    )
    assert read[0].mapping.command("press", None) == "hold"
    assert read[0].card["changes"] == 1
    assert (made.kept, made.parts, shares) == (1.0, {}, [1.0])
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_learned_is_a_sentence_and_nothing_is_installed(tmp_path: Path) -> None:
    change = partial(few_shot.forget, label="press")
    with pytest.raises(AdaptError, match="'press' is no gesture that was taught"):
        process.alter(change, SHIPPED, tmp_path, unexpected)
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_not_there_is_named_without_the_number_of_its_error(tmp_path: Path) -> None:
    with pytest.raises(AdaptError, match=r"^the orb cannot keep it: [a-z ]+$"):
        process.alter(HOLD, tmp_path / "absent.orb", tmp_path, unexpected)


def test_a_change_that_breaks_ends_with_its_status(tmp_path: Path) -> None:
    change = partial(few_shot.forget, gesture="press")  # type: ignore[call-arg]
    with pytest.raises(AdaptError, match=r"^learning ended with status 1$"):
        process.alter(change, SHIPPED, tmp_path, unexpected)


def test_learning_ends_with_the_program_that_asked_for_it(tmp_path: Path) -> None:
    out, change = tmp_path / "new.orb", partial(few_shot.teach, examples=[swipe()])
    work = partial(process._made, change, SHIPPED, out)
    done = subprocess.run(  # the end of its input is the end of its parent
        process.COMMAND, input=pickle.dumps(work), capture_output=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (1, b"")
    assert not out.exists()
