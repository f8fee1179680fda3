"""Training in the application, with a fake orb and a small program in place of `models`."""

import os
import sys
from collections import Counter
from pathlib import Path
from random import Random

import pygame
import pytest

from controller.shared.cues import NULL_LABEL, Phase
from controller.shared.files import data_folder
from controller.shared.protocol.messages import (
    IN_USE,
    Command,
    Message,
    UploadOffer,
    UploadStatus,
)
from controller.shared.protocol.teaching import (
    Record,
    RecordingStatus,
    RecordLabel,
    Undo,
    Vocabulary,
)
from host.app.screens.teach import trainer
from host.app.screens.teach.record import UNTOUCHED, RecordPage
from host.app.screens.teach.train import ResultPage, TrainingPage, TrainPage, requests
from host.connection.receiver import Connected, Delivered, Lost
from host.ui.pointer_input import DomeArea
from tests.support.app_window import LABELS, WELCOME
from tests.support.teaching_window import DENT, FakeOrb, Window

# Prints what a training prints, and writes what it writes.
TRAINER = """
import json, pathlib, sys
words = sys.argv[1:]
print("CNN-3D epoch 1/2: loss 0.5", file=sys.stderr)
if words[0] == "train":
    pathlib.Path(words[words.index("--out") + 1]).write_bytes(b"a bundle")
if words[0] == "evaluate":
    verdict = [dict(label="pinch", understood=1, of=2, why="too light", advice=""),
               dict(label="press", understood=2, of=2, why="", advice="")]
    pathlib.Path(words[-1]).write_text(json.dumps({"results": [{"verdict": verdict}]}))
"""
STUCK = "import threading; threading.Event().wait()"


class RecordingOrb(FakeOrb):
    """Records, and takes bundles."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder
        self.refuses = ""  # why nothing can be recorded

    def answers(self, message: Message) -> list[Message]:
        answers = super().answers(message)
        match message:
            case Record(on=True) if self.refuses:
                return [RecordingStatus(False, self.refuses)]
            case Record(on=on):
                return [RecordingStatus(on, str(self.folder / "recordings" / "one.npz"))]
            case UploadOffer():
                return [UploadStatus(IN_USE, 0, "it is in use")]
        return answers

    def described(self) -> list[Message]:
        _, *infos = super().described()
        labels = (*LABELS, *self.taught)
        return [Vocabulary(labels, WELCOME.commands, "", True, 0, str(self.folder)), *infos]


@pytest.fixture(autouse=True)
def fake_models(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Keep results in a folder of the test, and train by the small program."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setattr(trainer, "NEEDED", ("json",))
    monkeypatch.setattr(trainer, "COMMAND", (sys.executable, "-c", TRAINER))


@pytest.fixture
def window(tmp_path: Path) -> Window:
    """Return the application on the page, with an orb that has no session yet."""
    (tmp_path / "orb" / "recordings").mkdir(parents=True)
    window = Window()
    window.orb = RecordingOrb(tmp_path / "orb")
    window.pass_s(0.2, Connected(WELCOME))
    for item in ("Teach", "Train properly"):
        window.choose(item)
    assert isinstance(window.screen, TrainPage)
    return window


def sessions(window: Window, count: int) -> None:
    """Lay recordings into the orb's folder."""
    assert isinstance(window.orb, RecordingOrb)
    for number in range(count):
        path = window.orb.folder / "recordings" / f"{number}.npz"
        path.write_bytes(b"frames")
        os.utime(path, (number, number))
    window.pass_s(0.1)


def recording(window: Window) -> RecordPage:
    """Begin a session, and wait until the orb records."""
    window.choose("Record a session")
    window.pass_s(0.2)
    page = window.screen
    assert isinstance(page, RecordPage)
    return page


def example(window: Window, page: RecordPage) -> None:
    """Do what the page asks for."""
    until(window, page, Phase.GO)
    window.pass_s(0.4, image=DENT)
    until(window, page, Phase.GET_READY)


def until(window: Window, page: RecordPage, phase: Phase) -> None:
    """Let time pass until a phase of the cues."""
    while page.cue.phase is not phase:
        window.pass_s(0.05)


def trained(window: Window) -> ResultPage:
    """Train with two sessions, and wait for the end."""
    sessions(window, 2)
    window.choose("Train")
    page = window.screen
    assert isinstance(page, TrainingPage)
    while window.screen is page:
        page.run._process.wait(20.0)
        page.run._reader.join(20.0)
        window.pass_s(0.1)
    result = window.screen
    assert isinstance(result, ResultPage)
    return result


def test_a_session_is_labelled_with_what_the_page_asks_for(window: Window) -> None:
    page = recording(window)
    asked = []
    for _ in range(4):
        asked.append(page.cue.label)
        example(window, page)
    assert page.count - page.cue.left == 4
    labels = [message.label for message in window.sent(RecordLabel)]  # type: ignore[attr-defined]
    wanted = [label for one in asked if one != NULL_LABEL for label in (one, NULL_LABEL)]
    assert labels == wanted
    window.choose("Stop")
    window.pass_s(0.2)
    assert window.sent(Record) == [Record(True), Record(False)]
    assert isinstance(window.screen, TrainPage)
    assert "one.npz" in "".join(cell for row in window.menu.table for cell in row.cells)


def test_every_gesture_is_asked_for_as_often_as_chosen(window: Window) -> None:
    window.key(pygame.K_LEFT)  # 10 of each
    page = recording(window)
    assert page.count == page.cue.left == 10 * len(LABELS)


def test_commands_are_no_steps_while_it_records(window: Window) -> None:
    page = recording(window)
    down = Delivered(Command("down", "press", 0.9, None, 1), 0)
    window.pass_s(1.0, down)
    assert window.screen.selected == 0
    page.paused = True
    window.pass_s(0.1, down)
    assert window.screen.selected == 1


def test_a_pause_stops_the_cues(window: Window) -> None:
    page = recording(window)
    window.choose("Pause")
    left_s = page.cue.left_s
    window.pass_s(5.0)
    assert page.cue.left_s == left_s
    window.choose("Go on")
    assert page.cue.left_s < left_s


def test_it_pauses_where_nothing_is_felt(window: Window) -> None:
    page, missed = recording(window), 0
    while not page.paused:
        until(window, page, Phase.GO)
        missed = 0 if page.cue.label == NULL_LABEL else missed + 1
        until(window, page, Phase.REST)
    assert missed == UNTOUCHED


def test_presses_lie_all_over_the_dome_and_pinches_in_its_middle() -> None:
    pad, labels = DomeArea(), ["press", "pinch"] * 30
    asks = requests(labels, ["press"], pad, Random(1))
    assert Counter(ask.label for ask in asks) == {"press": 30, "pinch": 30}
    assert asks == requests(labels, ["press"], pad, Random(1))
    assert asks != requests(labels, ["press"], pad, Random(2))
    presses = [ask.place for ask in asks if ask.label == "press" and ask.place]
    assert {ask.place for ask in asks if ask.label == "pinch"} == {pad.centre}
    assert all(pad.on_dome(*place) for place in presses)
    for axis in (0, 1):
        assert min(place[axis] for place in presses) < pad.centre[axis] - 1.0
        assert max(place[axis] for place in presses) > pad.centre[axis] + 1.0


def test_the_orb_may_end_a_recording_or_refuse_it(window: Window) -> None:
    page = recording(window)
    window.pass_s(0.1, Delivered(RecordingStatus(False, "that is long enough"), 0))
    assert window.screen is not page
    assert isinstance(window.orb, RecordingOrb)
    window.orb.refuses = "the orb cannot record: no space left on device"
    window.choose("Record a session")
    window.pass_s(0.3)
    assert isinstance(window.screen, TrainPage)
    assert "no space" in " ".join(cell for row in window.menu.table for cell in row.cells)


def test_a_lost_link_ends_the_session(window: Window) -> None:
    page = recording(window)
    window.pass_s(0.1, Lost("gone"))
    assert window.screen is not page
    window.pass_s(1.0, Connected(WELCOME))
    assert isinstance(window.screen, TrainPage)


def test_training_needs_two_sessions(window: Window) -> None:
    for count in range(3):
        sessions(window, count)
        item = window.menu.items[window.number("Train")]
        assert item.value == f"sessions: {count}"
        assert (item.do is not None) is (count >= 2)


@pytest.mark.parametrize(
    ("missing", "words"), [("torch", "further packages"), ("models", "no training programs")]
)
def test_it_is_said_what_is_missing(
    window: Window, monkeypatch: pytest.MonkeyPatch, missing: str, words: str
) -> None:
    sessions(window, 2)
    monkeypatch.setattr(trainer, "missing", lambda: [missing])
    window.choose("Back")
    window.choose("Train properly")
    item = window.menu.items[window.number("Train")]
    assert item.do is None
    assert words in item.hint


def test_the_verdict_is_shown_and_the_bundle_used(window: Window) -> None:
    trained(window)
    assert window.menu.title == "75 % understood"
    assert [item.value for item in window.menu.items if item.value] == ["1 of 2", "2 of 2"]
    window.choose("Use it")
    window.pass_s(0.3)
    assert [message.size for message in window.sent(UploadOffer)] == [len(b"a bundle")]  # type: ignore[attr-defined]
    assert window.menu.notice == "it is in use"
    window.choose("Undo")
    window.pass_s(0.1)
    assert window.sent(Undo) == [Undo()]
    assert window.menu.notice == "done"


def test_taught_gestures_keep_their_commands(window: Window) -> None:
    window.orb.taught["swipe"] = "hold"
    window.pass_s(0.1, *(Delivered(each, 0) for each in window.orb.described()))
    trained(window)
    text = (data_folder() / "training" / "gestures.toml").read_text()
    assert 'extends = "paper"' in text
    assert 'label = "swipe"\ncommand = "hold"' in text


def test_a_failed_training_says_why(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    fail = (sys.executable, "-c", "import sys; sys.exit('models: there is no touch')")
    monkeypatch.setattr(trainer, "COMMAND", fail)
    sessions(window, 2)
    window.choose("Train")
    page = window.screen
    assert isinstance(page, TrainingPage)
    page.run._process.wait(20.0)
    page.run._reader.join(20.0)
    window.pass_s(0.1)
    assert window.menu.title == "The training failed"
    assert window.menu.table[0].cells == ("there is no touch",)
    window.choose("Back")
    assert isinstance(window.screen, TrainPage)


def test_leaving_a_training_asks_once_and_ends_it(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trainer, "COMMAND", (sys.executable, "-c", STUCK))
    sessions(window, 2)
    window.choose("Train")
    page = window.screen
    assert isinstance(page, TrainingPage)
    window.key(pygame.K_ESCAPE)
    window.choose("No")
    assert window.screen is page
    assert page.run._process.poll() is None
    window.key(pygame.K_ESCAPE)
    window.choose("Yes")
    assert isinstance(window.screen, TrainPage)
    assert page.run._process.returncode is not None
