"""Learning in a process of its own."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from controller.adapt import process
from controller.adapt.examples import Example
from controller.adapt.few_shot import AdaptError
from controller.adapt.process import Job
from controller.bundles import bundle

SHIPPED = bundle.default_path(10.0)


def swipe() -> Example:
    """An example of a finger that crosses the sensor."""
    images = np.ones((30, 5, 5), np.float32)
    for step in range(5):
        images[10 + step, 2, step] = 0.5
    found = Example("swipe", images).found(10.0)
    assert found is not None
    return found


def test_a_change_is_made_and_its_outcome_returned(tmp_path: Path) -> None:
    out = tmp_path / "new.orb"
    shares: list[float] = []
    process.run(Job("command", label="press", command="hold"), SHIPPED, out, shares.append)
    assert bundle.read(out).mapping.command("press", None) == "hold"


def test_a_disk_that_cannot_keep_it_is_named_without_the_number_of_its_error() -> None:
    job = Job("command", label="press", command="hold")
    with pytest.raises(AdaptError, match=r"^the orb cannot keep it: [a-z ]+$"):
        process.run(job, SHIPPED, SHIPPED / "new.orb")


def test_learning_ends_with_the_program_that_asked_for_it(tmp_path: Path) -> None:
    out, packed = tmp_path / "new.orb", Job("teach", examples=(swipe(),)).pack()
    command = [sys.executable, "-m", "controller.adapt.process", str(SHIPPED), str(out)]
    done = subprocess.run(  # the end of its input is the end of its parent
        command, input=len(packed).to_bytes(8, "little") + packed, capture_output=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (1, b"")
    assert not out.exists()
