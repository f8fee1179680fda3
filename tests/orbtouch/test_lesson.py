"""The lesson's steps, as its page prints them, give the counts that it names, without PyTorch."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import ROOT

PAGE = (ROOT / "docs" / "lesson.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_steps_of_the_lesson_confuse_and_improve_as_written(tmp_path: Path) -> None:
    steps = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    lines = [line.removeprefix("    ") for line in "\n".join(steps).splitlines()]
    counts = "print('swipes', before.confusion[-1].tolist(), after.confusion[-1].tolist())"
    program = "\n".join(["import sys", "sys.modules['torch'] = None", *lines, counts])
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.stderr == ""
    assert "With seat 7, 6 of 14 swipes are understood, and 8 are taken for presses." in PAGE
    assert done.stdout.splitlines()[-1] == "swipes [0, 8, 0, 0, 0, 6] [0, 0, 0, 0, 0, 14]"
    assert (tmp_path / "swipe.orb").is_file()
