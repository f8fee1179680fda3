"""A sweep's file: what it may say, and that a mistake in it is told with its line."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from controller.shared import config
from models.cli.sweep import EXAMPLE_FILE
from models.data.recipe import PAPER
from models.studies.sweep import plan
from models.studies.sweep.plan import Plan, PlanError
from tests.support import ROOT
from tests.support.model_commands import refused
from tests.support.pytest_types import Capture, Patch


def parsed(text: str) -> Plan:
    return plan.parse(config.parse_toml(text), "people")


def test_every_combination_of_the_axes_is_a_training() -> None:
    made = parsed("""
        [test]
        hold = 2
        [axes]
        users = [1, 3]
        gesture.rate = [0.1, 0.2, 0.3]
    """)
    at = [job["at"] for job in made.jobs("ff")]
    assert len(at) == 6
    assert at[:2] == [{"users": 1, "gesture.rate": 0.1}, {"users": 1, "gesture.rate": 0.2}]


def test_without_a_word_everybody_is_held_out_once_in_five_folds() -> None:
    listed = parsed("").jobs("ff")
    assert [job["test"] for job in listed] == [
        {"by": "user", "folds": 5, "hold": 0, "fold": fold} for fold in range(5)
    ]
    assert listed[0]["data"] == {"folders": ("data",), "sha256": "ff"}


def test_the_example_that_is_printed_can_be_read() -> None:
    assert len(parsed(EXAMPLE_FILE.read_text(encoding="utf-8")).jobs("ff")) == 12


def test_the_files_in_the_documentation_can_be_read() -> None:
    text = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
    blocks = [
        "\n".join(line.removeprefix("    ") for line in part.splitlines())
        for part in re.findall(r"(?m)(?:^    .*\n|^\n)+", text)
        if "[data]" in part
    ]
    counts = [len(parsed(one).jobs("ff")) for one in blocks]
    assert counts == [45, 10]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[train]\n\nusers = 'ten'", "line 3 has users = 'ten' under [train]; expected is a whole "
         "number from 0 to 100000 (orbtouch docs sweeps)"),
        ("[data]\nfolders = ['a']\nusers = 3", "line 3 has the unknown key 'users' under [data]; "
         "known are folders"),
        ("[tran]\nseed = 1", "line 1 has the unknown key 'tran'; known are name, data, train"),
        ("[train]\ntask = 'user'", "line 2 has task = 'user' under [train]; expected is one of "
         "gesture, location"),
        ("[train]\ngesture.rat = 1", "line 2 has the unknown key 'rat' under [train.gesture]"),
        ("[train]\ntask = 'location'\nmodel = 'mlp'", "line 3 has model = 'mlp'; for places there "
         "are network and trees"),
        ("[test]\nfolds = 2\nhold = 1", "line 1 has folds, which hold out all in turn, and hold"),
        ("[axes]\nseed = 3", "line 2 has seed = 3 under [axes]; expected is a list of values"),
        ('[axes]\ntask = ["gesture", "location"]', "line 2 has an axis task under [axes], and "),
        ("[axes]\n[axes.gesture]\nrat = [1]", "line 3 has the unknown key 'rat' under"),
        ("[axes]\ndata.seed = [1, 2]", "line 2 has the unknown key 'data' under [train]"),
        (f"[axes]\nseed = {list(range(1000))}\nusers = {list(range(1, 9))}\nminutes = "
         f"{list(range(1, 90))}", "line 1 is of 3,560,000 trainings"),
        ("[train]\ngesture.rate = 'fast'", "has rate = 'fast' under [train.gesture]; expected is a "
         "number from 0 to"),
        ("[train]\ngesture.channels = [1]", "has channels = [1] under [train.gesture]; expected is "
         "a list of 2"),
        ("[train]\ngesture.batch = 1.5", "has batch = 1.5 under [train.gesture]; expected is "
         "a whole number"),
        ("[axes\n", ", line 1: "),
    ],
)  # fmt: skip
def test_a_mistake_is_told_with_its_line_and_what_was_expected(
    text: str, said: str, tmp_path: Path
) -> None:
    file = tmp_path / "people.toml"
    file.write_text(text)
    with pytest.raises(PlanError) as caught:
        plan.read(file)
    assert said in str(caught.value)
    assert str(caught.value).startswith(str(file))
    assert "\n" not in str(caught.value)


def test_settings_of_the_recipe_replace_its_own() -> None:
    made = plan.training({"recipe": "paper", "gesture": {"hidden": [32, 32], "l2": [0, 0]}})
    wanted = replace(PAPER.gesture, hidden=(32, 32), l2=(0.0, 0.0))
    assert made.recipe == replace(PAPER, gesture=wanted)


def test_a_file_that_is_not_there_or_is_no_text_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match="no such file or directory"):
        plan.read(tmp_path / "none.toml")
    (tmp_path / "odd.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(PlanError, match="not text in UTF-8"):
        plan.read(tmp_path / "odd.toml")


def test_the_command_prints_a_file_to_begin_with(capsys: Capture) -> None:
    from models.__main__ import main

    assert main(["sweep"]) == 0
    assert "[axes]" in capsys.readouterr().out


@pytest.mark.parametrize(("absent", "extra"), [("sklearn", "train"), ("distributed", "sweep")])
def test_extras_are_named(absent: str, extra: str, capsys: Capture, monkeypatch: Patch) -> None:
    from models.cli import _options as options

    found: Callable[[str], object] = lambda name: None if name == absent else object()  # noqa: E731
    monkeypatch.setattr(options, "find_spec", found)
    error = refused(capsys, "sweep", "x.toml", "--cluster", "127.0.0.1:1")
    assert f"pip install -e '.[{extra}]'" in error
