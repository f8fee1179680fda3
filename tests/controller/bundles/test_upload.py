"""A bundle over the link: piece by piece, through losses and cuts, proved while play goes on."""

import errno
import hashlib
import tempfile
from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles.container import BundleError
from controller.bundles.deploy.store import INCOMING
from controller.bundles.deploy.upload import UploadReceiver
from controller.remote.bundle_updates import BundleUpdater
from controller.shared.protocol.codec import fitted
from controller.shared.protocol.link_events import Connected, Delivered, Lost, Received
from controller.shared.protocol.messages import (
    DECLINED,
    IN_USE,
    PIECE,
    PROVING,
    WANTED,
    Message,
    UploadChunk,
    UploadOffer,
    UploadStatus,
    Welcome,
)
from controller.shared.protocol.packets import Decoder, encode
from host.connection.bundle_upload import (
    NO_OUTCOME,
    PATIENCE_S,
    PROOF_REPEATS,
    PROOFS,
    REPEATS,
    BundleUpload,
)
from tests.support.loop_bench import Bench
from tests.support.waiting import until

DATA = np.random.default_rng(1).bytes(40 * PIECE + 123)
WELCOME = Welcome(
    2, 7, "orb-1", "OrbTouch", False, 5, 5, 10.0, 10.0, 100, 300, ("null", "press"), ("drop",)
)  # fmt: skip


class Wire:
    """A courier and an intake, and what is between them: messages may be lost on the way."""

    def __init__(self, folder: Path, loses: Callable[[], bool] = lambda: False) -> None:
        self.courier, self.intake = BundleUpload("new.orb", DATA), UploadReceiver(folder)
        self.loses = loses
        self.now_s = 0.0
        self.answers: list[UploadStatus] = []
        self.sent = 0

    def send(self, message: Message) -> bool:
        self.sent += 1
        if not self.loses():
            assert isinstance(message, UploadOffer | UploadChunk)
            self.answers.append(self.intake.take(message))
        return True

    def turn(self, *news: Received) -> None:
        self.now_s += 0.1
        answers = [Delivered(a, 0) for a in self.answers if not self.loses()]
        self.answers.clear()
        self.courier.turn([*news, *answers], self.now_s, self.send)


def deliver(wire: Wire) -> None:
    wire.turn(Connected(WELCOME))
    for _ in range(3000):
        if wire.intake.whole is not None:
            return
        wire.turn()
    raise AssertionError("the delivery does not end")


def test_a_file_arrives_whole_and_no_more_is_under_way_than_allowed(tmp_path: Path) -> None:
    wire = Wire(tmp_path)
    deliver(wire)
    assert wire.intake.whole is not None
    assert wire.intake.whole.read_bytes() == DATA
    assert wire.sent == 1 + 41  # the announcement, and each piece once
    wire.turn()
    assert wire.courier.stage == "proving"


@settings(max_examples=25)
@given(st.integers(0, 999), st.floats(0.0, 0.3))
def test_whatever_is_lost_on_the_way_is_sent_again(seed: int, share: float) -> None:
    draw = Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        wire = Wire(Path(folder), lambda: draw.random() < share)
        deliver(wire)
        assert wire.intake.whole is not None
        assert wire.intake.whole.read_bytes() == DATA


def test_after_a_cut_it_goes_on_where_it_was_even_if_the_device_began_anew(tmp_path: Path) -> None:
    wire = Wire(tmp_path)
    wire.turn(Connected(WELCOME))
    wire.turn()
    wire.turn()
    before = wire.courier.offset
    assert 0 < before < len(DATA)
    wire.turn(Lost("the cable was pulled"))
    wire.intake = UploadReceiver(tmp_path)  # switched off and on
    sent = wire.sent
    deliver(wire)
    assert wire.intake.whole is not None
    assert wire.intake.whole.read_bytes() == DATA
    assert wire.sent - sent < 41 - before // PIECE + 3


def test_what_is_not_what_was_announced_is_thrown_away(tmp_path: Path) -> None:
    intake = UploadReceiver(tmp_path)
    announced = UploadOffer(bytes(32), len(DATA), "new.orb")
    assert intake.take(announced) == UploadStatus(WANTED, 0, "")
    answers = [intake.take(UploadChunk(i, DATA[i : i + PIECE])) for i in range(0, len(DATA), PIECE)]
    assert answers[-1].state == DECLINED
    assert "not what was announced" in answers[-1].text
    assert intake.whole is None
    assert not list((tmp_path / INCOMING).iterdir())


def test_a_link_that_proves_nothing_delivers_nothing(tmp_path: Path) -> None:
    intake = UploadReceiver(tmp_path, "this link has no key")
    answer = intake.take(UploadOffer(bytes(32), 10, "new.orb"))
    assert answer == UploadStatus(DECLINED, 0, "this link has no key")
    assert intake.take(UploadChunk(0, b"x")).state == DECLINED
    assert not (tmp_path / INCOMING).exists()


def test_a_file_of_any_claimed_size_takes_no_more_room_than_was_sent(tmp_path: Path) -> None:
    intake = UploadReceiver(tmp_path)
    assert intake.take(UploadOffer(bytes(32), 1 << 31, "new.orb")).state == DECLINED
    assert intake.take(UploadOffer(bytes(32), 5000, "new.orb")) == UploadStatus(WANTED, 0, "")
    for offset, size in ((4000, 0), (0, 1000), (0, 1000)):  # not the next one; twice
        status = intake.take(UploadChunk(offset, bytes(1000)))
        assert status == UploadStatus(WANTED, size, "")
    (part,) = (tmp_path / INCOMING).iterdir()
    assert part.stat().st_size == 1000


def test_one_unfinished_delivery_is_kept_not_many(tmp_path: Path) -> None:
    intake = UploadReceiver(tmp_path)
    for number in range(3):
        intake.take(UploadOffer(bytes([number]) * 32, 5000, "new.orb"))
        intake.take(UploadChunk(0, bytes(1000)))
    assert [path.stem for path in (tmp_path / INCOMING).iterdir()] == ["02" * 32]


def hand_over(clerk: BundleUpdater, data: bytes) -> UploadStatus:
    device = Bench().open()
    clerk.take(UploadOffer(hashlib.sha256(data).digest(), len(data), "new.orb"), device)
    (answer,) = clerk.take(UploadChunk(0, data), device) or ()
    assert isinstance(answer, UploadStatus)
    assert answer.state == PROVING
    (outcome,) = until(lambda: clerk.poll(device))
    assert isinstance(outcome, UploadStatus)
    return outcome


def test_the_clerk_proves_beside_the_loop_and_tells_it_to_switch(tmp_path: Path) -> None:
    seen: list[bytes] = []

    def install(path: Path) -> str:
        seen.append(path.read_bytes())
        return "it is in use"

    changed: list[object] = []
    clerk = BundleUpdater(
        UploadReceiver(tmp_path), install, exchange=lambda parts, device: changed.append(parts)
    )
    assert not clerk.poll(Bench().open())
    assert hand_over(clerk, b"bundle") == UploadStatus(IN_USE, 0, "it is in use")
    assert changed == [None]
    assert seen == [b"bundle"]
    assert not list((tmp_path / INCOMING).iterdir())


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (BundleError("it answers differently"), "it answers differently"),
        (OSError(errno.ENOSPC, "No space left on device"),
         "the orb cannot keep it: no space left on device"),
        (OverflowError("too large"), "OverflowError on the orb; see its log"),
        (RecursionError(), "RecursionError on the orb; see its log"),
        *((BundleError(text), "") for text in ("\x1b[31m", "漢" * 400, "one\ntwo", "\udce9")),
    ],
)  # fmt: skip
def test_every_error_on_the_orb_is_answered(tmp_path: Path, error: Exception, told: str) -> None:
    def install(path: Path) -> str:
        raise error

    changed: list[object] = []
    clerk = BundleUpdater(
        UploadReceiver(tmp_path), install, exchange=lambda parts, device: changed.append(parts)
    )
    outcome = hand_over(clerk, b"bundle")
    encode(outcome, session=1, sequence=1, t_ms=0)  # it fits in a packet
    assert outcome.state == DECLINED
    assert told in outcome.text
    assert not changed
    assert hand_over(clerk, b"another").state == DECLINED  # and it takes the next one


@pytest.mark.parametrize(
    "name",
    ["new.orb", "é" * 60, "漢字" * 30, "модель" * 20, "نموذج" * 20, "मॉडल" * 20, "모델🎲" * 20,
     "a\x1b]0;title\x07", "two\nlines", "not \udce9\udcff UTF-8", ""],
)  # fmt: skip
def test_a_file_may_have_any_name(name: str) -> None:
    sent: list[Message] = []
    BundleUpload(name, DATA).turn([Connected(WELCOME)], 0.0, sent.append)
    (packet,) = Decoder().feed(encode(sent[0], session=1, sequence=1, t_ms=0))
    assert isinstance(packet.message, UploadOffer)
    if name.isprintable():
        assert name.startswith(packet.message.name)
        assert len(name.encode()) < 64 or len(packet.message.name.encode()) > 60


def test_a_text_is_cut_between_two_characters() -> None:
    assert fitted("漢" * 22, 64) == "漢" * 21
    assert fitted("\x1b[1m" + "é" * 40, 20) == "\\x1b[1m" + "é" * 6


def test_an_orb_that_takes_it_and_never_says_how_it_went_is_given_up(tmp_path: Path) -> None:
    """As one does whose proof ends without an answer: it wants the file once more."""
    wire = Wire(tmp_path)
    wire.turn(Connected(WELCOME))
    proofs = 0
    for _ in range(2000):
        if wire.courier.over:
            break
        if wire.intake.whole is not None:
            wire.intake.remove()
            proofs += 1
        wire.turn()
    assert (wire.courier.stage, wire.courier.told) == ("declined", NO_OUTCOME)
    assert proofs == PROOFS + 1


@pytest.mark.parametrize(
    ("answer", "repeats"),
    [
        (None, REPEATS),
        (UploadStatus(WANTED, 0, ""), REPEATS),
        (UploadStatus(PROVING, 9, ""), PROOF_REPEATS),
    ],
)
def test_an_orb_without_progress_is_given_up(answer: UploadStatus | None, repeats: int) -> None:
    courier, now_s, turns = BundleUpload("new.orb", DATA), 0.0, 0
    courier.turn([Connected(WELCOME)], now_s, lambda message: True)
    while not courier.over and turns < 2000:
        now_s += PATIENCE_S + 0.1
        news = [Delivered(answer, 0)] if answer is not None and turns == 0 else []
        courier.turn(news, now_s, lambda message: True)
        turns += 1
    assert (courier.stage, courier.told) == ("declined", NO_OUTCOME)
    assert repeats <= turns <= repeats + 2


def test_an_orb_that_goes_at_every_announcement_is_given_up() -> None:
    courier, losses = BundleUpload("new.orb", DATA), 0
    while not courier.over and losses < 2000:
        courier.turn([Connected(WELCOME)], 0.0, lambda message: True)
        courier.turn([Delivered(UploadStatus(WANTED, 0, ""), 0), Lost("gone")], 0.0, lambda _: True)
        losses += 1
    assert (courier.told, losses) == (NO_OUTCOME, REPEATS + 1)


def test_the_courier_says_what_the_orb_said() -> None:
    courier = BundleUpload("new.orb", DATA)
    courier.turn([Connected(WELCOME)], 0.0, lambda message: True)
    courier.turn([Delivered(UploadStatus(DECLINED, 0, "no"), 0)], PATIENCE_S, lambda message: True)
    assert (courier.over, courier.stage, courier.told) == (True, "declined", "no")
