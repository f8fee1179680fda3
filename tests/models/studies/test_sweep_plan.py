"""A sweep's file: what it may say, and that a mistake in it is told with its line."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from models.cli.sweep import EXAMPLE_FILE
from models.data.recipe import DEFAULT
from models.studies.sweep import plan
from models.studies.sweep.plan import Plan, PlanError
from tests.support import ROOT
from tests.support.model_commands import refused
from tests.support.pytest_types import Capture, Patch

OWN = DEFAULT.gesture


def parsed(text: str) -> Plan:
    return plan.parse(text, "people.toml", "people")


def fault(text: str) -> str:
    """The one sentence about a file that is refused."""
    with pytest.raises(PlanError) as caught:
        parsed(text)
    said = str(caught.value)
    assert "\n" not in said
    return said


def test_every_combination_of_the_axes_is_a_training() -> None:
    made = parsed("""
        [test]
        hold = 2
        [axes]
        users = [1, 3]
        gesture.rate = [0.1, 0.2, 0.3]
    """)
    at = [job["at"] for job in made.jobs()]
    assert len(at) == 6
    assert at[:2] == [{"users": 1, "gesture.rate": 0.1}, {"users": 1, "gesture.rate": 0.2}]


def test_without_a_word_everybody_is_held_out_once_in_five_folds() -> None:
    listed = parsed("").jobs()
    assert [job["test"] for job in listed] == [
        {"by": "user", "folds": 5, "fold": fold} for fold in range(5)
    ]
    assert listed[0]["data"]["users"] == 10


def test_the_example_that_is_printed_can_be_read() -> None:
    assert len(parsed(EXAMPLE_FILE.read_text(encoding="utf-8")).jobs()) == 12


def test_the_files_in_the_documentation_can_be_read() -> None:
    text = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
    blocks = [
        "\n".join(line.removeprefix("    ") for line in part.splitlines())
        for part in re.findall(r"(?m)(?:^    .*\n|^\n)+", text)
        if "[data]" in part
    ]
    counts = [len(parsed(one).jobs()) for one in blocks]
    assert counts == [45, 20]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[data]\nusrs = 3", "people.toml, line 2: [data] usrs: there is no such setting; did you "
         "mean 'users'?"),
        ("[data]\n\nusers = 'ten'", 'line 3: [data] users: expected a whole number from 1 to '
         '100000, found "ten"'),
        ("[data]\npreset = 'nominl'", "line 2: [data] preset: expected one of nominal, paper-snr"),
        ("[data]\nseed = 900001", "line 2: [data] seed: this simulation has seed 900001, and seeds "
         "900000 to 999999 are for tests only"),
        ("[data]\ngestures = ['wave']", "line 2: [data] gestures: there is no gesture 'wave'"),
        ("[data]\nfolders = ['a']\nusers = 3", "line 3: [data] users: there is no such setting; "
         "there are folders"),
        ("[tran]\nseed = 1", "line 1: 'tran' is no section; there are [data], [train]"),
        ("[train]\ntask = 'user'", "line 2: [train] task: expected one of gesture, location"),
        ("[train]\ngesture.rat = 1", "line 2: [train] gesture.rat: there is no such setting"),
        ("[test]\nfolds = 2\nhold = 1", "line 3: [test] hold: folds hold out every group in turn"),
        ("[axes]\nseed = 3", "line 2: [axes] seed: expected a list of values, found 3"),
        ('[axes]\ntask = ["gesture", "location"]', "line 2: [axes] task: scores of tasks"),
        ("[axes]\n[axes.gesture]\nrat = [1]", "line 3: [axes] gesture.rat: there is no such"),
        ("[data]\nfolders = ['a']\n[axes]\ndata.seed = [1, 2]", "line 4: [axes] data.seed: there "
         "is no such setting"),
        (f"[axes]\nseed = {list(range(1000))}\nusers = {list(range(1, 9))}\nminutes = "
         f"{list(range(1, 90))}", "line 1: these are 3,560,000 trainings"),
        ("[train]\ngesture.rate = 'fast'", f'a number, such as {OWN.rate}, found "fast"'),
        ("[train]\ngesture.channels = [1]", f"a row, such as {list(OWN.channels)}, found [1]"),
        ("[train]\ngesture.batch = 1.5", f"a whole number, such as {OWN.batch}, found 1.5"),
        ("[axes\n", "people.toml, line 1: "),
    ],
)  # fmt: skip
def test_a_mistake_is_told_with_its_line_and_what_was_expected(text: str, said: str) -> None:
    assert said in fault(text)


def test_a_file_that_is_not_there_or_is_no_text_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match="no such file or directory; models sweep"):
        plan.read(tmp_path / "none.toml")
    (tmp_path / "odd.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(PlanError, match="not text in UTF-8"):
        plan.read(tmp_path / "odd.toml")


def test_the_command_prints_a_file_to_begin_with(capsys: Capture) -> None:
    from models.__main__ import main

    assert main(["sweep", "--example"]) == 0
    assert "[axes]" in capsys.readouterr().out


@pytest.mark.parametrize(("absent", "extra"), [("joblib", "train,sweep"), ("distributed", "sweep")])
def test_extras_are_named(absent: str, extra: str, capsys: Capture, monkeypatch: Patch) -> None:
    from models.cli import _options as options

    found: Callable[[str], object] = lambda name: None if name == absent else object()  # noqa: E731
    monkeypatch.setattr(options, "find_spec", found)
    error = refused(capsys, "sweep", "x.toml", "--cluster", "127.0.0.1:1")
    assert f"pip install -e '.[{extra}]'" in error
