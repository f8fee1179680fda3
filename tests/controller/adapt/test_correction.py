"""Corrections: the latest touch is learned under another label while play goes on."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pygame
import pytest

from controller.adapt import AdaptError, process
from controller.bundles import bundle as bundles
from controller.bundles.container import BundleError
from controller.bundles.deploy.store import BundleStore, StoredBundle, name_of
from controller.bundles.deploy.upload import UploadReceiver
from controller.cli.run import options_of
from controller.recognition.pipeline import Pipeline
from controller.recordings import reader
from controller.remote.bundle_updates import BundleUpdater
from controller.runtime.assemble import Parts, open_device, prepare
from controller.runtime.device import Device
from controller.runtime.loop import Handler
from controller.runtime.renewal import exchange, refreshed
from controller.shared.protocol.messages import (
    DECLINED,
    IN_USE,
    PROVING,
    Contact,
    Contacts,
    Correction,
    Message,
    Telemetry,
    UploadStatus,
)
from host.app.correction_keys import CorrectionKeys
from tests.support.loop_bench import FINGER, Bench
from tests.support.waiting import until
from tetris.kit import language

RATE_HZ = 10.0
Run = tuple[Parts, Device, BundleStore]
SHIPPED = bundles.default_path(10.0)


def images(*touches: tuple[int, int], frames: int = 40) -> np.ndarray:
    """Rest, and a finger in the middle from one frame to another."""
    rng = np.random.default_rng(0)
    z = 1.0 + 0.003 * rng.normal(size=(frames, 5, 5))
    for first, end in touches:
        z[first:end, 1:4, 1:4] -= 0.2
        z[first:end, 2, 2] -= 0.2
    return z.astype(np.float32)


def test_the_latest_touch_is_meant() -> None:
    cut = process.latest(images((8, 13), (25, 31)), RATE_HZ)
    assert cut is not None
    assert len(cut) == 27  # from 13 frames before it, but not from within the touch before
    span = process.example("pinch", images((8, 13), (25, 31)), RATE_HZ).found()
    assert span is not None


def test_two_taps_in_a_row_are_one_touch() -> None:
    cut = process.latest(images((22, 25), (27, 30)), RATE_HZ)
    assert cut is not None
    assert len(cut) == 40 - (22 - 13)


@pytest.mark.parametrize("seen", [images(), images((2, 8)), images(frames=2)])
def test_what_was_long_ago_or_never_is_refused(seen: np.ndarray) -> None:
    with pytest.raises(AdaptError, match="nothing touched the orb"):
        process.example("pinch", seen, RATE_HZ)


def copied(shelf: BundleStore) -> Callable[[Path, str | None], str]:
    """Return what takes a bundle into use without a proof, which the shelf's tests look at."""

    def install(path: Path, corrects: str | None = None) -> str:
        data = path.read_bytes()
        name = name_of(bundles.parse(data))
        shelf.install(data, StoredBundle(name, 1.0, "now", corrects))
        return name

    return install


@pytest.mark.slow
def test_corrections_are_learned_in_a_process_and_taken_back_one_by_one(tmp_path: Path) -> None:
    shelf = BundleStore(tmp_path)
    seen, install = images((25, 31)), copied(shelf)

    def correct(label: str) -> str:
        return process.correct(label, seen, RATE_HZ, shelf, install)

    assert correct("twist_cw") == "learned: that was twist_cw (1 so far)"
    assert correct("null") == "learned: that was nothing (2 so far)"
    now = bundles.read(shelf.current())
    assert now.card["added"] == ["corrected in play: twist_cw", "corrected in play: nothing"]
    assert now.labels == bundles.read(SHIPPED).labels
    assert correct("") == "taken back (1 left)"
    assert bundles.read(shelf.current()).card["added"] == ["corrected in play: twist_cw"]
    assert correct("") == "taken back (0 left)"
    assert shelf.current(RATE_HZ) == SHIPPED
    with pytest.raises(BundleError, match="no change to undo"):
        correct("")
    assert not list((tmp_path / "incoming").iterdir())


@pytest.mark.parametrize("problem", ["", "that touch is too weak to learn from"])
def test_the_loop_hears_at_once_and_again_at_the_outcome(tmp_path: Path, problem: str) -> None:
    asked = []

    def learn(label: str, seen: list[np.ndarray]) -> str:
        asked.append((label, len(seen)))
        if problem:
            raise AdaptError(problem)
        return "learned"

    changed: list[object] = []
    clerk = BundleUpdater(
        UploadReceiver(tmp_path),
        lambda path: "",
        learn,
        exchange=lambda parts, device: changed.append(parts),
    )
    device = Bench().open()
    assert clerk.take(Correction("pinch"), device) == [UploadStatus(PROVING, 0, "learning")]
    end = UploadStatus(DECLINED, 0, problem) if problem else UploadStatus(IN_USE, 0, "learned")
    assert until(lambda: clerk.poll(device)) == [end]
    assert asked == [("pinch", 0)]
    assert changed == ([] if problem else [None])


def test_a_link_that_does_not_prove_who_is_there_corrects_nothing(tmp_path: Path) -> None:
    clerk = BundleUpdater(
        UploadReceiver(tmp_path, "no key"), lambda path: "", lambda label, seen: ""
    )
    answers = clerk.take(Correction("pinch"), Bench().open())
    assert answers == [UploadStatus(DECLINED, 0, "no key")]


def test_keys_with_alt_name_the_gestures_of_the_panel() -> None:
    sent: list[Correction] = []
    keys, words = CorrectionKeys(sent.append), language.load("en")
    labels = ("null", "press", "pinch")
    assert not keys.key(pygame.K_1, pygame.KMOD_ALT, (), 0.0)  # no orb is there yet
    assert not keys.key(pygame.K_2, 0, labels, 0.0)  # two fingers, as ever
    assert keys.key(pygame.K_3, pygame.KMOD_ALT, labels, 0.0)
    assert sent == []
    assert keys.told(0.0, words) == "there is no gesture 3"
    for code, label in ((pygame.K_2, "pinch"), (pygame.K_0, "null"), (pygame.K_BACKSPACE, "")):
        assert keys.key(code, pygame.KMOD_LALT, labels, 1.0)
        assert sent.pop() == Correction(label)
    keys.answer(UploadStatus(PROVING, 0, "learning"), 2.0)
    assert keys.told(30.0, words) == "learning"
    keys.answer(UploadStatus(IN_USE, 0, "learned: that was pinch"), 31.0)
    assert keys.told(32.0, words) == "learned: that was pinch"
    assert keys.told(40.0, words) == ""


class Patient(Handler):
    """A clerk that answers at once, and has learned at the twentieth look."""

    def __init__(self) -> None:
        self.given: list[tuple[str, int]] = []
        self.looks = 20

    def take(self, message: Message, device: Device) -> Sequence[Message] | None:
        if not isinstance(message, Correction):
            return None
        self.given.append((message.label, len(device.recent())))
        return [UploadStatus(PROVING, 0, "learning")]

    def poll(self, device: Device) -> Sequence[Message]:
        self.looks -= bool(self.given)
        return [] if self.looks else [UploadStatus(IN_USE, 0, "learned")]


class Deaf(Handler):
    """Takes nothing."""

    def take(self, message: Message, device: Device) -> Sequence[Message] | None:
        return None


def test_the_loop_offers_a_request_to_its_handlers_and_never_waits() -> None:
    bench = Bench((3.0, FINGER), (4.0, Contacts(())), (6.05, Correction("pinch")))
    clerk, second = Patient(), Patient()
    bench.loop._handlers = (Deaf(), clerk, second)
    bench.run(20.0)
    assert clerk.given == [("pinch", 40)]  # four seconds of images
    assert not second.given
    said = bench.messages(UploadStatus)
    assert said == [UploadStatus(PROVING, 0, "learning"), UploadStatus(IN_USE, 0, "learned")]
    frames = [m.frame for m in bench.messages(Telemetry) if isinstance(m, Telemetry)]
    assert frames == list(range(1, len(frames) + 1))  # none was missed meanwhile


@pytest.fixture
def run_of_a_bundle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Run]:
    """A virtual orb that records, with the bundle that ships, thirty frames after its start."""
    monkeypatch.setattr("controller.bundles.deploy.store.home", lambda: tmp_path / "shelf")
    monkeypatch.setattr("controller.shared.files.state_folder", lambda: tmp_path / "state")
    words = (
        f"--sensor virtual --rate 10 --link listen://127.0.0.1:0 --record {tmp_path} "
        "--user ab --session 1"
    )
    parts = prepare(options_of(words.split()))
    device = open_device(parts, 1)
    for _ in range(30):
        device.advance(10.0)
    try:
        yield parts, device, BundleStore(tmp_path / "shelf")
    finally:
        device.close()
        parts.link.close()


def test_networks_are_exchanged_while_the_orb_runs(run_of_a_bundle: Run, tmp_path: Path) -> None:
    parts, device, shelf = run_of_a_bundle
    device.sensor.touch((Contact(1, 2.0, 2.0, 8.0, 7.0),), 3.0)
    seen = np.array([device.advance(10.0).image for _ in range(8)])  # type: ignore[union-attr]
    before = np.concatenate([np.ones((20, 5, 5), np.float32), seen])
    process.correct("twist_cw", before, RATE_HZ, shelf, copied(shelf))
    rest = device.pipeline.rest
    assert rest is not None
    changed = refreshed(parts)
    assert changed is not None
    assert changed.bundle.hash != parts.bundle.hash
    exchange(changed, device)
    for _ in range(5):
        step = device.advance(10.0)
        assert step is not None
        assert step.ready  # rest is not found anew
    now = device.pipeline.rest
    assert now is not None
    assert np.abs(now / rest - 1.0).max() < 0.05
    device.recorder.close()  # type: ignore[union-attr]
    device.recorder = None
    first, second = (reader.load(tmp_path / f"sub-ab_ses-1_run-0{number}.npz") for number in (1, 2))
    assert (first.origin.bundle, second.origin.bundle) == (parts.bundle.hash, changed.bundle.hash)
    assert (len(first.t), len(second.t)) == (38, 5)
    replayed = Pipeline(changed.bundle.settings, changed.recognizer, changed.mapping)
    replayed.restore(second.state)
    steps = [replayed.step(f, float(t)) for f, t in zip(second.frames, second.t, strict=True)]
    assert step is not None
    np.testing.assert_array_equal(steps[-1].probabilities, step.probabilities)


def test_a_bundle_with_other_preprocessing_makes_the_orb_begin_anew(run_of_a_bundle: Run) -> None:
    parts, _, _ = run_of_a_bundle
    other = replace(parts.bundle, preprocess=replace(parts.bundle.preprocess, start_s=2.0))
    assert refreshed(parts) is not None
    assert refreshed(replace(parts, bundle=other)) is None
