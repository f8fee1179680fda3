"""The tape that runs along with a session: what is kept, and in which file."""

from pathlib import Path

import pytest

from controller.capture.labels import Labeller
from controller.capture.session_recorder import SessionRecorder
from controller.recognition.pipeline import Pipeline
from controller.recordings import reader
from controller.recordings.journal import Journal
from controller.recordings.recorder import Recorder
from controller.recordings.recording import Provenance
from controller.runtime.device import Device
from controller.runtime.loop import Loop
from controller.shared.aliases import State
from controller.shared.protocol.messages import Command, Contacts, Grant, Message
from tests.controller.capture.test_cues import cues
from tests.support.loop_bench import FINGER, GRANTING, SHIPPED, Bench, Certain, Slab, World


def test_the_end_closes_the_sensor_and_seals_the_recording(tmp_path: Path) -> None:
    path = tmp_path / "one.npz"
    bench = Bench((3.0, FINGER), (5.0, Contacts(())), record=path).run(6.05)
    assert bench.sensors[0].closed
    loaded = reader.load(path)
    assert loaded.t.tolist() == [k / 10 for k in range(1, 61)]
    assert [(c.command, c.frame) for c in loaded.commands] == [
        (m.name, m.frame) for m in bench.messages(Command) if isinstance(m, Command)
    ]
    assert loaded.label[10] == 0
    assert loaded.label[40] == 1
    assert loaded.button.tolist() == loaded.label.tolist()  # this slab's button is never late
    assert loaded.rest is not None
    assert loaded.rest[0, 0] == 40.0


@pytest.mark.parametrize("owned_by_host", [False, True])
def test_a_session_of_cues_ends_when_there_is_enough(tmp_path: Path, owned_by_host: bool) -> None:
    path = tmp_path / "cued.npz"
    requests: list[tuple[float, Message]] = [(2.5, FINGER), (3.5, Contacts(()))]
    if owned_by_host:
        steps = (GRANTING, Grant(2500), FINGER, Grant(3500), Contacts(()), Grant(60_000))
        requests = [(0.0, message) for message in steps]
    asked = cues("press", "null")
    bench = Bench(*requests, record=path, cues=asked, await_host=owned_by_host).run(60.0)
    loaded = reader.load(path)
    assert loaded.t[-1] == pytest.approx(9.0)  # a second of rest, two times four
    assert loaded.cue[19:39].tolist() == [1] * 20
    assert set(loaded.cue[39:89].tolist()) == {0}
    assert not loaded.excluded.any()
    asked_for = [mark.text for mark in loaded.marks if mark.kind == "cue"]
    assert asked_for == ["wait", *_cued("press"), *_cued("null"), "done"]
    assert bench.sensors[0].performances[0] == (2.0, "press")


def _cued(label: str) -> list[str]:
    return [f"{phase} {label}" for phase in ("get ready", "go", "rest")]


def test_a_full_recording_is_sealed_and_the_next_one_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Journal, "full", property(lambda it: it._sequence in (20, 40)))
    world = World((3.0, FINGER))
    pipeline = Pipeline(SHIPPED.settings, Certain(), SHIPPED.mapping)
    origin = Provenance("x", 5, 5, 10.0, 10.0, SHIPPED.labels, SHIPPED.hash, "none", "0")
    paths = [tmp_path / f"{number}.npz" for number in range(3)]
    names = iter(paths)

    def begin(state: State) -> Recorder:
        return Recorder(next(names), origin, state)

    tape = SessionRecorder(begin, pipeline, Labeller(SHIPPED.labels))
    device = Device(Slab(world), pipeline, world, recorder=tape)
    Loop(world, lambda: device, world.clock).run(world.after(5.05))
    loaded = [reader.load(path) for path in paths]
    assert [k for one in loaded for k in one.sequence.tolist()] == list(range(1, 51))
    assert all(one.rest is not None for one in loaded)
    replayed = Pipeline(SHIPPED.settings, Certain(), SHIPPED.mapping)
    replayed.restore(loaded[1].state)
    steps = [replayed.step(f, float(t)) for f, t in zip(loaded[1].frames, loaded[1].t, strict=True)]
    assert [s.command.command for s in steps if s.command] == ["left"]
