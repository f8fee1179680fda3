"""The lesson's steps, as its page prints them, give the counts that it names, without PyTorch."""

import json
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from tests.support import ROOT

PAGE = (ROOT / "docs" / "lesson.md").read_text(encoding="utf-8")
STEPS = [textwrap.dedent(one) for one in re.findall(r"```python\n(.*?) *```", PAGE, re.DOTALL)]


def test_the_notebook_has_the_words_and_steps_of_the_page() -> None:
    text = (ROOT / "examples" / "lesson.ipynb").read_text(encoding="utf-8")
    cells = [("".join(one["source"]), one["cell_type"]) for one in json.loads(text)["cells"]]
    assert [source + "\n" for source, kind in cells if kind == "code"] == STEPS
    words = " ".join(PAGE.split())
    assert [source for source, kind in cells[1:] if kind != "code" and source not in words] == []


@pytest.mark.slow
def test_the_steps_of_the_lesson_confuse_and_improve_as_written(tmp_path: Path) -> None:
    counts = "print('swipes', before.confusion[-1].tolist(), after.confusion[-1].tolist())"
    program = "\n".join(["import sys", "sys.modules['torch'] = None", *STEPS, counts])
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.stderr == ""
    assert "With seat 7, 9 of 14 swipes are understood, and 5 are taken for presses." in PAGE
    assert done.stdout.splitlines()[-1] == "swipes [0, 5, 0, 0, 0, 9] [0, 0, 0, 0, 0, 14]"
    assert (tmp_path / "swipe.orb").is_file()
