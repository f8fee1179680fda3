"""Teaching without a link's other end: examples, recordings, faults, and what is refused."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import TypeVar

import numpy as np
import pytest

from controller import adapt
from controller.adapt import Example, cost, few_shot
from controller.bundles import bundle as bundles
from controller.bundles.deploy.store import BundleStore
from controller.cli.run import options_of
from controller.recordings import reader
from controller.recordings.recording import RecordingError
from controller.remote import examples, link_recording
from controller.remote.bundle_updates import BundleUpdater
from controller.remote.gesture_reports import Describer
from controller.remote.handlers import handlers
from controller.remote.teacher import Teacher
from controller.runtime.assemble import TOKEN, Parts, open_device, prepare
from controller.runtime.device import Device
from controller.runtime.loop import Handler
from controller.runtime.renewal import exchange
from controller.shared.notices import Notice
from controller.shared.protocol.messages import Contact, Message
from controller.shared.protocol.teaching import (
    DONE,
    FAILED,
    LEARNING,
    Check,
    CheckStep,
    DeleteExamples,
    Describe,
    ExampleDrop,
    ExampleEnd,
    ExampleStart,
    ExampleTaken,
    Forget,
    GestureInfo,
    InjectFault,
    Learn,
    LearnStatus,
    LessonCost,
    Recalibrate,
    Record,
    RecordingStatus,
    RecordLabel,
    SaveAs,
    SetCommand,
    SetStrength,
    TouchStrength,
    Vocabulary,
)
from tests.controller.adapt.test_correction import SHIPPED, copied, images
from tests.support.waiting import until

FINGER = Contact(1, 2.0, 2.0, 9.0, 7.0)
H = TypeVar("H", bound=Handler)


@dataclass
class Orb:
    """A virtual orb whose time only `run` moves."""

    parts: Parts
    device: Device
    handlers: list[Handler]
    changed: list[Parts | None]

    def run(self, seconds: float, *fingers: Contact) -> list[Message]:
        self.device.sensor.touch(fingers, self.device.now_s)
        said: list[Message] = []
        for _ in range(round(seconds * 10.0)):
            self.device.advance(10.0)
            said += self.poll()
        return said

    def poll(self) -> list[Message]:
        return [message for each in self.handlers for message in each.poll(self.device)]

    def ask(self, message: Message) -> list[Message]:
        answers = (each.take(message, self.device) for each in self.handlers)
        return list(next(answer for answer in answers if answer is not None))

    def outcome(self) -> LearnStatus:
        """Wait for the outcome of a change; its description comes before it."""
        said = until(lambda: self.only(BundleUpdater).poll(self.device))
        assert isinstance(said[-1], LearnStatus)
        return said[-1]

    def only(self, kind: type[H]) -> H:
        """Return the one handler of a kind."""
        (one,) = (each for each in self.handlers if isinstance(each, kind))
        return one

    def answer(self) -> Message:
        """Wait for the next message of the worker."""
        said: list[Message] = until(self.poll)
        return said[0]

    def example(self, number: int, *fingers: Contact) -> Message:
        assert self.ask(ExampleStart(number, "poke")) == []
        self.run(0.5, *fingers)
        self.ask(ExampleEnd(number, True))
        said = self.run(1.0)
        return said[0] if said else self.answer()


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Orb]]:
    """What starts an orb whose host has a token, or that is open to all, with options."""
    monkeypatch.setattr("controller.shared.files.data_folder", lambda: tmp_path)
    monkeypatch.setattr("controller.shared.files.state_folder", lambda: tmp_path / "state")
    monkeypatch.setattr("controller.remote.teacher._MEASURED_S", 0.0)  # no cost of lessons
    made: list[Orb] = []

    def begin(*options: str, token: str = "secret") -> Orb:
        monkeypatch.setenv(TOKEN, token)
        words = ["--sensor", "virtual", "--rate", "10", "--link", "listen://127.0.0.1:0"]
        parts = prepare(options_of([*words, *options]))
        changed: list[Parts | None] = []
        exchange = lambda parts, device: changed.append(parts)  # noqa: E731
        orb = Orb(parts, open_device(parts, 1), handlers(lambda: parts, exchange), changed)
        made.append(orb)
        orb.run(3.0)
        return orb

    yield begin
    for orb in made:
        orb.device.close()
        orb.parts.link.close()


def stored(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / "teaching" / "examples").iterdir())


def test_an_example_is_on_the_disk_and_comes_again_after_a_restart(
    make: Callable[..., Orb], tmp_path: Path
) -> None:
    taken = make().example(7, FINGER)
    assert isinstance(taken, ExampleTaken)
    assert (taken.number, taken.label, taken.felt, taken.text) == (7, "poke", True, "")
    assert 0.3 < taken.seconds < 1.0
    assert min(taken.image) == taken.image[12]  # the middle, where the finger was
    assert stored(tmp_path) == ["example-7.npz"]
    kept = examples.ExampleStore(tmp_path / "teaching" / "examples", (5, 5), 10.0)
    (one,) = kept.of("poke")
    assert one.example.span is not None
    assert one.example.span[0] >= bundles.read(SHIPPED).settings.preprocess.window  # at rest
    (tmp_path / "teaching" / "examples" / "example-8.npz").write_bytes(b"half")
    orb = make()  # the first one was killed
    assert orb.ask(Describe()) == []
    said: list[Message] = until(orb.poll)
    while not isinstance(said[-1], ExampleTaken):
        said.append(orb.answer())
    vocabulary, *infos, again = said
    assert isinstance(vocabulary, Vocabulary)
    assert vocabulary.folder == str(tmp_path / "teaching")
    labels = [one.label for one in infos if isinstance(one, GestureInfo)]
    assert ("null", *labels) == vocabulary.labels
    assert again == taken
    (refused,) = orb.ask(ExampleStart(7, "poke"))
    assert refused == ExampleTaken(7, "poke", False, "there is an example 7 already", 0.0, b"")
    orb.ask(ExampleDrop(7))
    orb.ask(DeleteExamples())
    done = orb.answer()
    assert isinstance(done, LearnStatus)
    assert done.text.startswith("examples deleted: 1, recordings: 0")
    assert stored(tmp_path) == []  # the half-written one is gone, too


def test_what_was_not_felt_is_not_kept(
    make: Callable[..., Orb], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    orb = make()
    nothing = orb.example(1)
    assert isinstance(nothing, ExampleTaken)
    assert not nothing.felt
    assert nothing.text == "nothing touched the orb; make it again"
    orb.ask(ExampleStart(2, "poke"))
    (long,) = orb.run(12.0, FINGER)
    assert isinstance(long, ExampleTaken)
    assert "longer than 10 s" in long.text
    orb.ask(ExampleStart(3, "poke"))
    orb.ask(ExampleEnd(3, False))
    assert orb.run(1.0) == []
    (odd,) = orb.ask(ExampleStart(4, "Poke me"))
    assert isinstance(odd, ExampleTaken)
    assert "no name" in odd.text
    monkeypatch.setattr(examples, "MOST", 0)
    full = orb.example(5, FINGER)
    assert isinstance(full, ExampleTaken)
    assert "examples are waiting" in full.text
    assert not (tmp_path / "teaching").exists()


@pytest.mark.parametrize("case", ["no key", "a bundle of its own"])
def test_an_orb_that_cannot_be_taught_says_why(make: Callable[..., Orb], case: str) -> None:
    orb = make(token="") if case == "no key" else make("--bundle", str(SHIPPED))
    orb.ask(Describe())
    vocabulary = orb.answer()
    assert isinstance(vocabulary, Vocabulary)
    why = vocabulary.objection
    assert ("--key FILE" if case == "no key" else "--bundle") in why
    assert isinstance(why, Notice)
    assert vocabulary.folder == ""
    assert orb.ask(ExampleStart(1, "poke")) == [ExampleTaken(1, "poke", False, why, 0.0, b"")]
    for request in (Learn("poke", "", "none", False, ""), Recalibrate(), SaveAs("a")):
        assert orb.ask(request) == [LearnStatus(FAILED, 1.0, why)]


def test_what_cannot_be_done_is_refused_at_once(make: Callable[..., Orb]) -> None:
    orb = make()
    refused = {
        Learn("poke", "", "none", False, ""): "there is no example of 'poke'",
        Learn("poke", "", "some", False, ""): "rotations 'some'",
        Learn("poke", "Drop!", "none", False, ""): "'Drop!' is no command",
        Forget("poke"): "there is no gesture 'poke'",
        SetCommand("poke", "hold"): "there is no gesture 'poke'",
    }
    for request, why in refused.items():
        (answer,) = orb.ask(request)
        assert isinstance(answer, LearnStatus)
        assert answer.state == FAILED
        assert why in answer.text


def test_a_command_is_set_unless_a_mapping_file_has_it(
    make: Callable[..., Orb], tmp_path: Path
) -> None:
    orb = make()
    assert orb.ask(SetCommand("pinch", "hold")) == [LearnStatus(LEARNING, 0.0, "learning")]
    assert orb.outcome().text == "pinch: hold"
    mapping = tmp_path / "mapping.toml"
    mapping.write_text('pinch = "drop"\n')
    (refused,) = make("--mapping", str(mapping)).ask(SetCommand("pinch", "hold"))
    assert isinstance(refused, LearnStatus)
    assert refused.text == f"the commands are those of {mapping}; edit it"


def test_a_touch_strength_is_set_and_corrections_learn_what_the_network_sees(
    make: Callable[..., Orb],
) -> None:
    orb = make()
    (refused,) = orb.ask(SetStrength(0.5, "cleo"))
    assert refused == LearnStatus(FAILED, 1.0, "there is no user 'cleo'")
    orb.ask(SetStrength(9.0))
    assert "from 0.25 to 2.5" in orb.outcome().text
    orb.ask(SetStrength(0.5))
    said = until(lambda: orb.only(BundleUpdater).poll(orb.device))
    assert said[-2:] == [TouchStrength("", 0.5), LearnStatus(DONE, 1.0, said[-1].text)]
    assert said[-1].text == "the touch strength is 0.50"
    (new,) = orb.changed
    assert new is not None
    exchange(new, orb.device)
    orb.run(0.5, FINGER)
    (latest,) = orb.device.images(orb.device.image_count - 1, orb.device.image_count)
    assert orb.device.recent()[-1] - 1.0 == pytest.approx(2.0 * (latest - 1.0), abs=1e-6)


@pytest.mark.parametrize("label", ["press", "twist_ccw"])  # the first and the last
def test_every_gesture_can_be_forgotten_but_null(make: Callable[..., Orb], label: str) -> None:
    orb = make()
    (refused,) = orb.ask(Forget("null"))
    assert refused == LearnStatus(FAILED, 1.0, "there is no gesture 'null'")
    assert orb.ask(Forget(label)) == [LearnStatus(LEARNING, 0.0, "learning")]


def test_a_gesture_is_learned_and_forgotten_while_every_other_change_waits(
    make: Callable[..., Orb],
) -> None:
    orb = make()
    for number in (1, 2):
        orb.example(number, FINGER, replace(FINGER, id=2, x=0.5, y=3.5))
    started = orb.ask(Learn("poke", "hold", "none", False, ""))
    assert started == [LearnStatus(LEARNING, 0.0, "learning")]
    (busy,) = orb.ask(Forget("press"))
    assert isinstance(busy, LearnStatus)
    assert (busy.state, busy.text[:21]) == (LEARNING, "the orb is still busy")
    learned = orb.outcome()
    assert (learned.state, learned.progress) == (DONE, 1.0)
    assert learned.text.startswith("poke is learned from 2 examples")
    (new,) = orb.changed
    assert new is not None
    assert new.bundle.labels[-1] == "poke"


def test_a_bundle_is_saved_once_under_a_name(make: Callable[..., Orb], tmp_path: Path) -> None:
    orb = make()
    states = []
    for name in ("mine", "mine", "../mine"):
        orb.ask(SaveAs(name))
        answer = orb.answer()
        assert isinstance(answer, LearnStatus)
        states.append(answer.state)
    assert states == [DONE, FAILED, FAILED]
    assert (tmp_path / "teaching" / "saved" / "mine.orb").read_bytes() == SHIPPED.read_bytes()


def test_a_recording_has_the_cues_that_the_host_asked_for(
    make: Callable[..., Orb], tmp_path: Path
) -> None:
    orb = make()
    assert orb.ask(RecordLabel("press")) == [RecordingStatus(False, "nothing is recorded now")]
    (began,) = orb.ask(Record(True))
    assert isinstance(began, RecordingStatus)
    assert began.on
    assert orb.ask(Record(True)) == [began]  # there is one already
    for label, seconds in (("press", 1.0), ("null", 0.5)):
        assert orb.ask(RecordLabel(label)) == []
        orb.run(seconds, FINGER)
    assert orb.ask(RecordLabel("poke")) == [RecordingStatus(True, "there is no gesture 'poke'")]
    orb.ask(Record(False))
    assert orb.answer() == RecordingStatus(False, began.text)
    (path,) = (tmp_path / "teaching" / "recordings").iterdir()
    assert reader.load(path).cue.tolist() == [1] * 10 + [0] * 5


def test_a_recording_ends_by_itself_at_its_limit(
    make: Callable[..., Orb], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(link_recording, "MOST_S", 5.0)
    orb = make()
    (began,) = orb.ask(Record(True))
    assert isinstance(began, RecordingStatus)
    assert orb.run(4.9, FINGER) == []
    assert orb.device.recorder is not None
    said = orb.run(0.3, FINGER)
    assert orb.device.recorder is None
    assert (said or [orb.answer()]) == [
        RecordingStatus(False, f"that is long enough, so the recording ended: {began.text}")
    ]
    assert link_recording.MOST_BYTES == 200 * 1024**2


def test_a_check_has_no_answer_at_once_and_ends_when_it_is_told_to(
    make: Callable[..., Orb],
) -> None:
    orb = make()
    assert orb.ask(Check(True)) == []
    assert orb.answer() == CheckStep("rest", 0, 0, 0.0)
    assert orb.ask(Check(False)) == []
    until(lambda: CheckStep("over", 0, 0, 1.0) in orb.poll())


def test_a_description_of_gestures_that_have_changed_since_is_made_again(
    make: Callable[..., Orb], monkeypatch: pytest.MonkeyPatch
) -> None:
    orb, described = make(), threading.Event()
    describer = orb.only(Describer)
    describe = describer.describe

    def signalled(parts: Parts) -> tuple[Message, ...]:
        old = describe(parts)
        described.set()
        return old

    monkeypatch.setattr(describer, "describe", signalled)
    orb.ask(Describe())
    assert described.wait(10.0)
    known = orb.parts.bundle.labels
    changed = replace(orb.parts.bundle, labels=(*known, "poke"))
    monkeypatch.setattr(describer, "_current", lambda: replace(orb.parts, bundle=changed))
    described.clear()
    until(lambda: orb.poll() != [] or described.is_set())
    assert described.is_set()  # the old description was dropped, and another one begun


def test_a_fault_comes_and_goes(make: Callable[..., Orb]) -> None:
    orb = make()
    (given,) = orb.ask(InjectFault("open_row", 2, 0))
    assert given == LearnStatus(DONE, 1.0, "the orb has a fault: open_row")
    assert orb.device.sensor.read(orb.device.now_s + 0.1)[2].max() < 10.0  # pF
    (odd,) = orb.ask(InjectFault("open_row", 9, 0))
    assert isinstance(odd, LearnStatus)
    assert odd.state == FAILED
    orb.ask(InjectFault("", 0, 0))
    assert orb.device.sensor.read(orb.device.now_s + 0.2)[2].min() > 30.0


def test_the_untouched_orb_is_measured_again(make: Callable[..., Orb]) -> None:
    orb = make()
    assert orb.device.pipeline.rest is not None
    (done,) = orb.ask(Recalibrate())
    assert done == LearnStatus(DONE, 1.0, "the orb is measured again; do not touch it")
    orb.run(0.1)
    assert orb.device.pipeline.rest is None
    orb.run(3.0)
    assert orb.device.pipeline.rest is not None


def test_a_running_orb_takes_a_bundle_with_another_gesture(make: Callable[..., Orb]) -> None:
    orb = make()
    made = adapt.teach(SHIPPED.read_bytes(), [Example("poke", images((10, 16)))])

    def work() -> str:
        out = BundleStore().folder.parent / "new.orb"
        out.write_bytes(bundles.assembled(made.manifest, made.parts))
        return copied(BundleStore())(out, "")

    updater = orb.only(BundleUpdater)
    updater.begin(work, lambda done, text: LearnStatus(DONE if done else FAILED, 1.0, text))
    vocabulary, *infos, outcome = until(lambda: updater.poll(orb.device))
    assert isinstance(outcome, LearnStatus)
    assert outcome.state == DONE
    assert isinstance(vocabulary, Vocabulary)
    assert (vocabulary.labels[-1], vocabulary.undo, vocabulary.taught) == ("poke", True, 1)
    assert infos[-1] == TouchStrength("", 1.0)
    assert isinstance(infos[-2], GestureInfo)
    assert (infos[-2].taught, infos[-2].examples, len(infos[-2].image)) == (True, 1, 25)
    (new,) = orb.changed
    assert new is not None
    rest = orb.device.pipeline.rest
    assert rest is not None
    exchange(new, orb.device)
    step = orb.device.advance(10.0)
    assert step is not None
    assert step.ready
    assert step.probabilities.shape == (6,)
    now = orb.device.pipeline.rest
    assert now is not None
    assert np.abs(now / rest - 1.0).max() < 0.05


def test_the_progress_of_a_change_is_told_once_and_leaves_a_fifth_for_the_test(
    make: Callable[..., Orb],
) -> None:
    orb = make()
    teacher, device = orb.only(Teacher), orb.device
    assert teacher.poll(device) == ()
    teacher._advance(0.5)
    assert teacher.poll(device) == [LearnStatus(LEARNING, 0.4, "learning")]
    assert teacher.poll(device) == ()


def test_a_change_says_what_waits_now_and_a_forgotten_gesture_loses_its_examples(
    make: Callable[..., Orb], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    orb = make()
    before = orb.parts.bundle.debounce
    orb.example(1, FINGER)
    teacher = orb.only(Teacher)
    for fresh, waits in (((), ""), (("a",), "; a now waits"), (("a", "b"), "; a and b now wait")):
        made = replace(before, patient=(*before.patient, *fresh), patience_s=0.3)
        outcome = SimpleNamespace(debounce=made)
        monkeypatch.setattr("controller.adapt.process.alter", lambda *_, found=outcome: found)
        text = teacher._forget(few_shot.forget, "poke")
        assert text == f"poke is forgotten{waits and waits + ' 0.30 s for it'}"
    assert stored(tmp_path) == []


def test_the_cost_of_a_lesson_follows_when_it_is_measured(
    make: Callable[..., Orb], monkeypatch: pytest.MonkeyPatch
) -> None:
    orb = make()
    teacher, outcome = orb.only(Teacher), cost.Outcome(20, 0.5)
    measured = [cost.Cost("press", 20, cost.Outcome(19, 0.25), outcome, outcome)]
    monkeypatch.setattr("controller.adapt.process.run", lambda work, **_: measured)
    teacher.measure(Path("taught.orb"), "poke", orb.parts.sensor)
    assert teacher.poll(orb.device) == [LessonCost("poke", "press", 20, 19, 0.25, 20, 0.5, 20, 0.5)]


def test_a_recording_that_cannot_begin_or_be_kept_is_not_on(
    make: Callable[..., Orb], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    orb, folder = make(), tmp_path / "teaching" / "recordings"
    folder.parent.mkdir(exist_ok=True)
    folder.write_bytes(b"no folder")
    (refused,) = orb.ask(Record(True))
    assert isinstance(refused, RecordingStatus)
    assert not refused.on
    assert refused.text.startswith("the orb cannot record: ")
    folder.unlink()
    folder.mkdir()
    (folder / "old.npz").write_bytes(b"12")
    monkeypatch.setattr(link_recording, "MOST_BYTES", 1)
    full = RecordingStatus(False, f"{folder} is full; delete recordings there")
    assert orb.ask(Record(True)) == [full]
    monkeypatch.setattr(link_recording, "MOST_BYTES", 2)
    (begun,) = orb.ask(Record(True))
    assert isinstance(begun, RecordingStatus)
    assert begun.on
    orb.ask(Record(False))
    assert orb.answer() == RecordingStatus(False, "there was less than a second to keep")
    orb.ask(Record(True))
    assert orb.device.recorder is not None

    def fail() -> bool:
        raise RecordingError("the disk is full")

    monkeypatch.setattr(orb.device.recorder, "close", fail)
    orb.ask(Record(False))
    assert orb.answer() == RecordingStatus(False, "the disk is full")
