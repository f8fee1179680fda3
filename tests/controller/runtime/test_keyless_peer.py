"""A peer of a virtual orb without a key may touch it, but not break it, nor fill its disk."""

import logging
import math
from pathlib import Path

import numpy as np
import pytest

from controller.bundles.deploy.upload import UploadReceiver
from controller.links.base import HUSH_S, LogLimit
from controller.recordings import reader
from controller.remote.bundle_updates import BundleUpdater
from controller.runtime import loop
from controller.runtime.device import Device
from controller.shared.protocol import messages as wire
from controller.simulator.virtual_orb import PERFORMANCES, VirtualOrb
from tests.support.loop_bench import FINGER, GRANTING, HELLO, Bench, World

HUGE = 3e38


def frames(orb: VirtualOrb, first: int, end: int) -> np.ndarray:
    return np.array([orb.read(number / 10.0) for number in range(first, end)])


@pytest.mark.parametrize(
    "contact",
    [
        (1e6, 2.0, 9.0, 7.0), (-HUGE, HUGE, HUGE, HUGE), (2.0, 2.0, 9.0, HUGE),
        (2.0, 2.0, HUGE, 1e-38), (5.8, 2.0, -HUGE, -HUGE), (math.nan, 2.0, 9.0, 7.0),
        (2.0, 2.0, math.inf, 7.0),
    ],
)  # fmt: skip
def test_no_contact_leaves_traces_once_lifted(contact: tuple[float, float, float, float]) -> None:
    orb, untouched = VirtualOrb(1), VirtualOrb(1)
    orb.touch([wire.Contact(1, *contact), wire.Contact(2, HUGE, HUGE, HUGE, HUGE)], 0.1)
    assert np.isfinite(frames(orb, 1, 11)).all()
    orb.touch((), 1.1)
    frames(orb, 11, 200)
    frames(untouched, 1, 200)
    np.testing.assert_allclose(frames(orb, 200, 230), frames(untouched, 200, 230), rtol=0.01)


def test_a_finger_beyond_the_edge_is_felt_at_the_edge() -> None:
    far, edge = VirtualOrb(1), VirtualOrb(1)
    far.touch([wire.Contact(1, 1e6, 2.0, 9.0, 7.0)], 0.1)
    edge.touch([wire.Contact(1, 2.0 + 0.96 * 3.8, 2.0, 9.0, 7.0)], 0.1)
    np.testing.assert_allclose(frames(far, 1, 9), frames(edge, 1, 9), rtol=1e-6)


def test_performances_that_end_in_one_frame_are_both_told() -> None:
    orb = VirtualOrb(1)
    for number, label in ((1, "press"), (2, "pinch")):
        orb.perform(number, label, HUGE, -HUGE, 0.05)
    assert np.isfinite(frames(orb, 1, 60)).all()
    assert sorted(truth.number for truth in orb.truths()) == [1, 2]


def test_the_hand_refuses_what_is_too_much_or_nowhere() -> None:
    orb = VirtualOrb(1)
    with pytest.raises(ValueError, match="no place on the orb"):
        orb.perform(1, "press", math.nan, 2.0, 0.0)
    for number in range(PERFORMANCES):
        orb.perform(number, "press", 2.0, 2.0, 0.0)
    with pytest.raises(ValueError, match="has 8 things to do; wait for them"):
        orb.perform(9, "press", 2.0, 2.0, 0.0)


def test_fingers_that_nobody_scans_take_no_more_memory() -> None:
    orb = VirtualOrb(1)
    for _ in range(5000):
        orb.touch(FINGER.contacts, 0.0)
    assert len(orb._updates) < 2000


def test_a_flood_of_wrong_labels_is_logged_now_and_then(caplog: pytest.LogCaptureFixture) -> None:
    flood: list[tuple[float, wire.Message]] = [(0.0, HELLO)]
    flood += [(0.5, wire.Perform(number, "juggle", 2.0, 2.0)) for number in range(500)]
    with caplog.at_level(logging.WARNING):
        Bench(*flood).run(1.0)
    assert caplog.messages == ["performance 0 ignored: the hand cannot juggle"]


def test_a_line_comes_again_after_a_while_and_others_are_limited() -> None:
    now_s = [0.0]
    hush = LogLimit(lines=2, clock=lambda: now_s[0])
    assert [hush.lets(line) for line in ("a", "a", "b", "c")] == [True, False, True, False]
    now_s[0] = HUSH_S
    assert hush.lets("a")


def test_grants_of_a_host_that_has_gone_are_not_carried_out() -> None:
    class Hasty(World):
        """A host that asks for hours, and goes as soon as the first is there."""

        def send(self, message: wire.Message, t_ms: int) -> None:
            super().send(message, t_ms)
            self.connected = self.connected and not isinstance(message, wire.Granted)

    grants = [(0.0, wire.Grant(loop.GRANT_LIMIT_MS * k)) for k in range(1, 1000)]
    bench = Bench(await_host=True)
    bench.world = world = Hasty((0.0, GRANTING), *grants, (0.0, wire.Bye("gone")))
    bench.loop._link = world
    bench.loop.run(world.after(1.0))
    assert len(bench.messages(wire.Granted)) == 1
    assert len(bench.sensors[0].reads) == 10 * loop.GRANT_LIMIT_MS // 1000


def recorded(tmp_path: Path, *requests: tuple[float, wire.Message], seconds: float) -> list[Path]:
    """What is in a folder after a run in which each session has a file of its own."""
    bench = Bench(*requests, await_host=True)
    opened, sessions = bench.open, iter(range(1, 1000))

    def open_device() -> Device:
        device = opened()
        device.recorder = bench.tape(tmp_path / f"{next(sessions)}.npz", device.pipeline)
        return device

    bench.loop._open = open_device
    bench.run(seconds)
    return sorted(tmp_path.iterdir())


def test_short_sessions_leave_no_files(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    short = [(k / 10, m) for k in range(9) for m in (GRANTING, wire.Grant(40), wire.Grant(900))]
    with caplog.at_level(logging.INFO):
        kept = recorded(tmp_path, *short, (1.0, GRANTING), (1.0, wire.Grant(1200)), seconds=2.0)
    assert [path.name for path in kept] == ["10.npz"]
    assert len(reader.load(kept[0]).t) == 12
    assert caplog.messages[0] == "nothing was recorded: there was less than a second to keep"
    assert len(caplog.messages) == 2  # and the one that was


def test_a_peer_that_may_correct_nothing_leaves_no_marks_in_a_recording(tmp_path: Path) -> None:
    path = tmp_path / "one.npz"
    bench = Bench(*[(1.5, wire.Correction("press"))] * 50, record=path)
    upload = UploadReceiver(tmp_path, "no key")
    bench.loop._handlers = (BundleUpdater(upload, lambda path: "", lambda label, seen: ""),)
    bench.run(3.0)
    assert bench.messages(wire.UploadStatus) == [wire.UploadStatus(wire.DECLINED, 0, "no key")] * 50
    assert not reader.load(path).marks
