"""The link usb:, on folders that stand for configfs, and pipes that stand for /dev/hidgN."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import tomllib
from pathlib import Path

import pytest

from controller.links import open_link, usb
from controller.links.base import LinkError
from controller.links.bluetooth.hid.held_keys import HeldKeys
from controller.links.bluetooth.hid.reports import (
    GAMEPAD,
    KEYBOARD,
    OUTPUTS,
    RELEASED,
    Report,
    axes,
    gamepad,
    keyboard,
)
from controller.links.usb import CONFIGFS, FUNCTIONS, PATIENCE_S, UDCS, Gadget, UsbLink, UsbReports
from controller.shared.keymap import keymap
from controller.shared.protocol.messages import Bye, Command, ContactState, Hello, State
from tests.reference import hid
from tests.support.fake_device import welcome
from tests.support.waiting import until

PAD = keymap.load(Path("gamepad"), OUTPUTS)
KEYS = keymap.load(Path("keyboard"), OUTPUTS)
ALL_UP = list(RELEASED)
LEFT = Command("left", "press", 1.0, None, 1)


class Kernel:
    """Folders as the kernel has them, with one controller, and a pipe for each interface."""

    def __init__(self, folder: Path) -> None:
        self.root = folder
        self.configfs, self.udcs, self.dev = folder / CONFIGFS, folder / UDCS, folder / "dev"
        for path in (self.configfs, self.udcs / "dummy", self.dev):
            path.mkdir(parents=True)
        self.gadget = self.configfs / "orbtouch"
        self.plug("configured")
        self.pipes = {}
        for minor, number in enumerate(FUNCTIONS):
            os.mkfifo(self.dev / f"hidg{minor}")
            pipe = os.open(self.dev / f"hidg{minor}", os.O_RDONLY | os.O_NONBLOCK)
            self.pipes[number] = pipe

    def open(self) -> Gadget:
        """Return a gadget whose attributes appear and vanish with their folders."""
        dev = {self.gadget / path: f"236:{n}\n" for n, path in enumerate(FUNCTIONS.values())}

        class FakeGadget(Gadget):
            def _make(self, folder: Path) -> None:
                super()._make(folder)
                if folder in dev:
                    (folder / "dev").write_text(dev[folder])

            def _remove(self, folder: Path) -> None:
                shutil.rmtree(folder)

        return FakeGadget("Orb", root=self.root)

    def plug(self, state: str) -> None:
        (self.udcs / "dummy" / "state").write_text(f"{state}\n")

    def read(self, number: int) -> bytes:
        """Return what a host has read from an interface since the last time."""
        try:
            return os.read(self.pipes[number], 4096)
        except BlockingIOError:
            return b""

    def bound(self) -> str:
        return (self.gadget / "UDC").read_text().strip()


@pytest.fixture
def kernel(tmp_path: Path) -> Kernel:
    return Kernel(tmp_path)


class Host:
    """What a host reads, on a virtual clock."""

    def __init__(self) -> None:
        self.read: list[Report] = []
        self.errors: dict[int, int] = {}  # by interface

    def write(self, report: Report) -> None:
        if report.id in self.errors:
            raise OSError(self.errors[report.id], "as the kernel says it")
        self.read.append(report)

    def heard(self) -> list[Report]:
        heard, self.read = self.read, []
        return heard


# --- reports ---


def test_a_host_is_sent_the_release_of_all_keys_before_any_press() -> None:
    host = Host()
    orb = UsbReports(HeldKeys(PAD), host.write)
    orb.take(LEFT, 0.0)  # nobody is there
    orb.step(0.0, configured=False)
    assert not orb.ready
    orb.step(0.1, configured=True)
    assert orb.ready
    assert host.heard() == ALL_UP
    orb.take(LEFT, 0.2)
    orb.step(0.2, configured=True)
    assert host.heard() == [gamepad({"left"})]
    orb.step(0.2 + orb.pause_s(0.2) + 0.1, configured=True)
    assert host.heard() == [gamepad(())]


@pytest.mark.parametrize("gone", [errno.ESHUTDOWN, errno.ENODEV])
def test_a_host_that_comes_back_gets_nothing_of_before(gone: int) -> None:
    host = Host()
    orb = UsbReports(HeldKeys(PAD), host.write)
    orb.step(0.0, configured=True)
    host.errors = {GAMEPAD: gone}
    orb.take(LEFT, 0.1)
    orb.step(0.1, configured=True)
    assert not orb.ready
    orb.take(LEFT, 0.2)
    host.errors = {}
    host.heard()
    orb.step(0.3, configured=True)
    assert host.heard() == ALL_UP


def test_an_interface_that_is_not_read_holds_nothing_up_and_keeps_no_presses() -> None:
    """Firmware reads the keyboard only; a sleeping host reads nothing for a while."""
    host = Host()
    orb = UsbReports(HeldKeys(PAD), host.write)
    orb.step(0.0, configured=True)
    host.heard()
    host.errors = {GAMEPAD: errno.EAGAIN}
    orb.take(LEFT, 0.1)
    orb.step(0.1, configured=True)
    assert orb.pause_s(0.1) < 0.01  # it is tried again soon
    orb.step(0.1 + PATIENCE_S, configured=True)
    host.errors = {}
    orb.step(0.2 + PATIENCE_S, configured=True)
    assert host.heard() == [gamepad(())]


def test_the_newest_contact_alone_waits_for_a_host_that_does_not_read() -> None:
    host = Host()
    orb = UsbReports(HeldKeys(PAD), host.write)
    orb.step(0.0, configured=True)
    host.heard()
    host.errors = {GAMEPAD: errno.EAGAIN}
    for frame in range(1, 9):
        contact = ContactState(frame, frame / 2, 2.0, depth_mm=6.0, fingers=1)
        orb.take(contact, 0.02 * frame)
        orb.step(0.02 * frame, configured=True)
    host.errors = {}
    orb.step(0.2, configured=True)
    assert host.heard() == [gamepad((), axes(contact, (5, 5)))]


@pytest.mark.parametrize(("rate_hz", "release_s"), [(40.0, 0.3), (10.0, 0.3), (5.0, 0.6)])
def test_a_held_key_goes_up_when_the_loop_stands_still(rate_hz: float, release_s: float) -> None:
    host = Host()
    hold = '[profile.a]\nleft = { key = "left", mode = "hold" }\n'
    orb = UsbReports(HeldKeys(keymap.parse(tomllib.loads(hold), OUTPUTS), rate_hz), host.write)
    orb.step(0.0, configured=True)
    orb.take(LEFT, 0.1)
    orb.take(State(("left",)), 0.1)
    orb.step(0.1, configured=True)
    assert host.heard() == [*ALL_UP, keyboard(["left"])]
    orb.step(0.1 + release_s - 0.01, configured=True)
    assert host.heard() == []
    orb.step(0.1 + release_s, configured=True)
    assert host.heard() == [keyboard(())]


def test_a_fault_of_the_kernel_is_no_missing_host() -> None:
    host = Host()
    orb = UsbReports(HeldKeys(PAD), host.write)
    host.errors = {GAMEPAD: errno.EIO}
    with pytest.raises(OSError, match="kernel"):
        orb.step(0.0, configured=True)


# --- the gadget ---


def test_the_gadget_is_a_pad_and_a_boot_keyboard(kernel: Kernel) -> None:
    gadget = kernel.open()

    def value(path: str) -> bytes:
        return (kernel.gadget / path).read_bytes()

    assert kernel.bound() == "dummy"
    assert value("idVendor") == b"0x1209"
    assert value("bcdDevice")[2:].isdigit()  # the kernel refuses digits above 9
    assert value("functions/hid.keyboard/protocol") == b"1"  # HID 1.11, 4.3: keyboard
    assert value("functions/hid.pad/subclass") == b"0"
    assert (kernel.gadget / "configs/c.1/hid.pad").readlink() == kernel.gadget / FUNCTIONS[GAMEPAD]
    for number, function in FUNCTIONS.items():
        host = hid.parse(value(f"{function}/report_desc"))
        length = int(value(f"{function}/report_length"))
        assert host.ids(hid.INPUT) == {0}  # no report ids
        assert host.bits(hid.INPUT, 0) == 8 * length
        gadget.write(next(report for report in RELEASED if report.id == number))
        assert len(kernel.read(number)) == length
    gadget.remove()
    assert not kernel.gadget.exists()


def test_a_stale_gadget_is_unbound_and_replaced(kernel: Kernel) -> None:
    (kernel.gadget / "functions/hid.pad").mkdir(parents=True)
    (kernel.gadget / "configs/c.1").mkdir(parents=True)
    (kernel.gadget / "configs/c.1/hid.pad").symlink_to("away")
    (kernel.gadget / "UDC").write_text("dummy")
    gadget = kernel.open()
    assert kernel.bound() == "dummy"
    gadget.remove()


def test_the_guard_unbinds_the_gadget_of_a_killed_process(kernel: Kernel) -> None:
    child = os.fork()
    if not child:
        kernel.open()
        signal.pause()
        os._exit(1)
    try:
        until(lambda: kernel.bound() == "dummy", passing=(FileNotFoundError,))
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    until(lambda: not kernel.bound())


def test_a_second_controller_is_refused(kernel: Kernel) -> None:
    gadget = kernel.open()
    with pytest.raises(LinkError, match="another controller has the USB gadget"):
        kernel.open()
    assert kernel.bound() == "dummy"
    gadget.remove()


def test_what_is_missing_is_said_in_a_sentence(kernel: Kernel, tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"dev: no such file.*usb_f_hid") as refused:
        Gadget("Orb", root=tmp_path)  # no kernel makes the attribute
    assert refused.value.status == 2
    with pytest.raises(LinkError, match="there is no USB device controller x; there is dummy"):
        Gadget("Orb", "x", tmp_path)
    shutil.rmtree(kernel.udcs)
    with pytest.raises(LinkError, match="no USB port of this computer can"):
        Gadget("Orb", root=tmp_path)
    with pytest.raises(LinkError, match="modprobe libcomposite"):
        Gadget("Orb", root=tmp_path / "none")
    with pytest.raises(LinkError, match="cannot understand usb:\\?host=x"):
        open_link("usb:?host=x", welcome())


# --- the link ---


def test_the_link_follows_its_host_and_releases_at_the_end(kernel: Kernel) -> None:
    kernel.plug("not attached")
    link = UsbLink(HeldKeys(KEYS), kernel.open())
    link.send(LEFT, 0)
    assert link.dropped == 1
    kernel.plug("configured")
    link.wait(10.0)
    assert isinstance(link.poll()[-1], Hello)
    assert kernel.read(KEYBOARD) == keyboard(()).data
    link.send(LEFT, 0)
    heard = until(lambda: kernel.read(KEYBOARD))
    assert heard[:8] == keyboard(["left"]).data
    kernel.plug("suspended")
    link.wait(10.0)
    assert isinstance(link.poll()[-1], Bye)
    kernel.plug("configured")
    link.wait(10.0)
    link.poll()
    assert kernel.read(KEYBOARD)[-8:] == keyboard(()).data
    link.close()
    assert not kernel.gadget.exists()
    assert not link.problem


def test_a_fault_ends_the_link_and_removes_the_gadget(
    kernel: Kernel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(usb, "Gadget", lambda name, udc: kernel.open())
    link = open_link("usb:", welcome())
    (kernel.udcs / "dummy/state").unlink()
    until(lambda: link.problem)
    link.close()
    assert link.problem == "the USB gadget failed: no such file or directory"
    assert not kernel.gadget.exists()
