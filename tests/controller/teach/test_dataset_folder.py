"""The folder that is taught into, and what comes after: train, tune, evaluate."""

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from controller import errors
from controller.bundles import vocabulary
from controller.recordings import writer
from controller.recordings.recording import Mark
from controller.simulator import gesture_file
from controller.teach import TeachError, dataset_folder
from controller.teach.dataset_folder import ExistingRecording
from tests.support import ROOT
from tests.support import recordings as recorded

KNOCK = """
name = "mine"
[[gesture]]
label = "press"
[[gesture]]
label = "knock"
say = "knock twice"
command = "hold"
file = "hands/knock.toml"
"""


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A vocabulary whose gesture's file lies in a folder of its own."""
    (tmp_path / "hands").mkdir()
    (tmp_path / "hands" / "knock.toml").write_text('label = "knock"\nlike = "press"\n')
    path = tmp_path / "mine.toml"
    path.write_text(KNOCK)
    return path


def test_a_vocabulary_and_its_files_lie_beside_the_recordings(mine: Path, tmp_path: Path) -> None:
    out = tmp_path / "data"
    laid = dataset_folder.lay(out, dataset_folder.vocabulary(out, mine))
    assert laid.files == (out / "knock.toml",)
    assert gesture_file.load(laid.files)["knock"].place == "anywhere"
    assert laid.table == {"knock": "hold"}
    mine.unlink()
    assert dataset_folder.vocabulary(out, None) == laid
    assert dataset_folder.lay(out, laid) == laid  # which changes nothing


def test_recordings_of_other_gestures_do_not_go_into_one_folder(mine: Path, tmp_path: Path) -> None:
    out = tmp_path / "data"
    dataset_folder.lay(out, dataset_folder.vocabulary(out, mine))
    mine.write_text(KNOCK.replace("hold", "pause"))
    with pytest.raises(TeachError, match=r"of other gestures, .*; choose another --out"):
        dataset_folder.lay(out, dataset_folder.vocabulary(out, mine))


def test_nobody_has_to_name_gestures(tmp_path: Path) -> None:
    assert dataset_folder.vocabulary(tmp_path, None) == vocabulary.shipped()
    laid = dataset_folder.lay(tmp_path, vocabulary.shipped())
    assert laid.entries == vocabulary.shipped().entries


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(TeachError, match=r"cannot teach into .*; choose another --out"):
        dataset_folder.lay(tmp_path / "file" / "data", vocabulary.shipped())


def test_the_example_is_a_vocabulary_whose_new_gesture_the_hand_can_do(tmp_path: Path) -> None:
    made = dataset_folder.example(tmp_path / "mine")
    assert [path.name for path in made] == ["gestures.toml", "knock.toml"]
    words = vocabulary.read(made[0])
    assert words.labels == (*vocabulary.shipped().labels, "knock")
    assert words.entries[:4] == vocabulary.shipped().entries
    assert words.mapping.command("knock", None) == "hold"
    assert gesture_file.load(words.files)["knock"].rotations == words.entries[4].rotations
    with pytest.raises(TeachError, match=r"cannot write .*gestures\.toml: file exists"):
        dataset_folder.example(tmp_path / "mine")


def test_the_documentation_shows_the_example_s_knock(tmp_path: Path) -> None:
    _, knock = dataset_folder.example(tmp_path)
    whole = (ROOT / "docs" / "gestures.md").read_text(encoding="utf-8")
    body = knock.read_text().partition("\n\n")[2]
    assert textwrap.indent(f"```toml\n{body}```", "    ") in whole


def test_the_vocabulary_in_the_documentation_is_one() -> None:
    whole = (ROOT / "docs" / "teach.md").read_text(encoding="utf-8")
    text = whole.partition("```toml\n")[2].partition("```")[0]
    words = vocabulary.parse(text, "docs/teach.md", Path())
    assert (words.labels, words.located) == (("null", "press", "knock"), ("press",))
    assert words.mapping.command("knock", None) == "hold"


def test_examples_are_counted_from_what_the_cues_said(tmp_path: Path) -> None:
    said = (
        "wait", "get ready press", "go press at 1,2", "rest press",
        "get ready knock", "go knock", "again knock: nothing was felt", "go knock", "done",
    )  # fmt: skip
    marks = [Mark(float(i), "cue", text) for i, text in enumerate(said)]
    assert dataset_folder.count((*marks, Mark(9.0, "key", "go on"))) == {"press": 1, "knock": 1}


def test_recordings_are_told_by_age_and_unreadable_ones_left_out(tmp_path: Path) -> None:
    for name, day in (("b", "2026-01-02"), ("a", "2026-01-03")):
        about = recorded.origin(started=day, user="ada", session=name, protocol="gestures")
        one = replace(recorded.of(np.ones((9, 5, 5)), about), marks=(Mark(1.0, "cue", "go press"),))
        writer.write_beside(tmp_path / f"{name}.npz", writer.pack(one))
    (tmp_path / "c.npz").write_bytes(b"no recording")
    taken = dataset_folder.taken(tmp_path)
    assert [(one.path.name, one.session, one.examples) for one in taken] == [
        ("b.npz", "b", {"press": 1}),
        ("a.npz", "a", {"press": 1}),
    ]


def taken(*sessions: str, protocol: str = "gestures") -> list[ExistingRecording]:
    return [
        ExistingRecording(Path(f"data/{protocol}-{s}.npz"), "ada", s, protocol, s, {})
        for s in sessions
    ]


def test_a_first_session_is_trained_on_and_nobody_is_told_that_its_figures_are_honest() -> None:
    planned = dataset_folder.course(Path("data"), taken("1"))
    assert planned.commands == (
        ["train", "data", "--out", "data.orb"],
        ["tune", "data.orb", "data", "--out", "data.orb", "--html", "data.html"],
        ["evaluate", "data.orb", "data", "--html", "data.html"],
    )
    assert "it flatters" in planned.note


def test_from_three_sessions_on_the_newest_is_neither_trained_nor_tuned_on() -> None:
    places = taken("3", protocol="locations")
    planned = dataset_folder.course(Path("data"), [*taken("1", "2"), *places, *taken("3", "3")])
    train, tune, evaluate = planned.commands
    learned = ["data/gestures-1.npz", "data/gestures-2.npz", "data/locations-3.npz"]
    assert train[1:4] == tune[2:5] == learned
    assert evaluate[2:4] == ["data/gestures-3.npz"] * 2
    assert "is spared" in planned.note


def came(*who: tuple[str, str]) -> list[ExistingRecording]:
    return [
        ExistingRecording(Path(f"home/{user}-{day}.npz"), user, day, "users", day, {})
        for user, day in who
    ]


def test_people_who_came_twice_are_told_apart_and_not_merely_their_gestures() -> None:
    twice = came(("ada", "1"), ("ben", "1"), ("ada", "2"), ("ben", "2"))
    planned = dataset_folder.course_of_people(Path("home"), twice)
    assert planned.commands == (["train", "home", "--task", "user", "--out", "home.orb"],)
    assert "tell them apart" in planned.question


def test_people_who_came_once_are_asked_to_come_again_and_nothing_is_trained() -> None:
    once = came(("ada", "1"), ("ben", "1"), ("ada", "2"))
    planned = dataset_folder.course_of_people(Path("home"), once)
    said: list[str] = []
    assert (
        dataset_folder.offer(planned, agree=lambda question: True, say=said.append, yes=True) == 0
    )
    assert said == [planned.note]
    assert planned.note.startswith("ben came on one day only")
    assert "controller teach --protocol users --user ada,ben --out home" in planned.note
    alone = dataset_folder.course_of_people(Path("home"), came(("ada", "1"), ("ada", "2")))
    assert alone.note.startswith("only ada was recorded")


ALL = ["train", "tune", "evaluate"]


@pytest.mark.parametrize(
    ("answer", "yes", "installed", "statuses", "status", "ran", "told"),
    [
        (True, False, True, [], 0, ALL, "Play with it: host -- --bundle data.orb"),
        (None, True, True, [], 0, ALL, "Play with it: host -- --bundle data.orb"),
        (False, False, True, [], 0, [], "make a bundle of it with:|  models train data --out data"),
        (None, False, True, [], 0, [], "make a bundle of it with:|  models train data --out data"),
        (True, False, False, [], 0, [], "pip install -e '.[train]'"),
        (None, True, False, [], 1, [], "pip install -e '.[train]'"),
        (True, False, True, [0, 2], 2, ALL[:2], "the same commands go on from here:"),
    ],
)
def test_who_agrees_gets_a_bundle_and_others_are_told_how(
    answer: bool | None, yes: bool, installed: bool, statuses: list[int],
    status: int, ran: list[str], told: str,
) -> None:  # fmt: skip
    called: list[str] = []
    said: list[str] = []

    def call(command: Sequence[str]) -> int:
        called.append(command[3])
        return statuses.pop(0) if statuses else 0

    ended = dataset_folder.offer(
        dataset_folder.course(Path("data"), taken("1")),
        agree=None if answer is None else lambda question: answer,
        say=said.append,
        call=call,
        installed=lambda: installed,
        yes=yes,
    )
    assert (ended, called) == (status, ran)
    assert told in "|".join(said)


@pytest.mark.parametrize(
    ("answer", "agreed"), [("y", True), (" YES", True), ("", False), ("no", False), (None, False)]
)
def test_only_yes_is_yes(answer: str | None, agreed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    def typed() -> str:
        if answer is None:
            raise EOFError
        return answer

    monkeypatch.setattr("builtins.input", typed)
    assert errors.agreed("Train now?") is agreed
