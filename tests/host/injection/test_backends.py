"""Bytes that each back end packs for its system; none of them is there when the tests run."""

import ctypes
import errno
import os
import struct
import sys
from pathlib import Path
from typing import Any

import pytest

from controller.shared.keymap.key_names import KEYS
from host.injection import backends
from host.injection.backends import BackendError, by_pynput, windows

if sys.platform != "win32":
    from host.injection.backends import uinput
    from host.injection.backends.uinput import Uinput

linux = pytest.mark.skipif(sys.platform == "win32", reason="uinput is Linux's")


class Kernel:
    """Takes what is asked of /dev/uinput."""

    def __init__(self) -> None:
        self.asked: list[tuple[int, int | bytes]] = []

    def __call__(self, handle: int, request: int, value: int | bytes) -> None:
        self.asked.append((request, value))

    def values(self, request: int) -> list[int | bytes]:
        return [value for asked, value in self.asked if asked == request]


def events(device: Path) -> list[tuple[int, int, int]]:
    return [(t, c, v) for _, _, t, c, v in struct.iter_unpack("@llHHi", device.read_bytes())]


@pytest.fixture
def device(tmp_path: Path) -> Path:
    path = tmp_path / "uinput"
    path.touch()
    return path


@linux
def test_keyboard_is_made_with_all_its_keys_and_then_created(device: Path) -> None:
    kernel = Kernel()
    Uinput("keyboard", str(device), kernel)
    assert kernel.values(0x40045564) == [1]  # EV_KEY
    keys = kernel.values(0x40045565)
    assert {*range(1, 32), 103, 57} <= {key for key in keys if isinstance(key, int)}
    assert len(keys) == len(set(keys))
    (setup,) = kernel.values(0x405C5503)
    assert isinstance(setup, bytes)
    assert len(setup) == 92
    assert setup[8:26] == b"OrbTouch keyboard\0"
    assert kernel.asked[-1] == (0x5501, 0)  # last: UI_DEV_CREATE


@linux
def test_key_goes_down_and_up_as_events_of_the_kernel(device: Path) -> None:
    kernel = Kernel()
    keyboard = Uinput("keyboard", str(device), kernel)
    keyboard.set("a", down=True)
    keyboard.set("a", down=False)
    keyboard.close()
    assert events(device) == [(1, 30, 1), (0, 0, 0), (1, 30, 0), (0, 0, 0)]
    assert kernel.asked[-1] == (0x5502, 0)  # UI_DEV_DESTROY


@linux
def test_pad_has_buttons_a_hat_and_sticks_with_their_ends(device: Path) -> None:
    kernel = Kernel()
    pad = Uinput("gamepad", str(device), kernel)
    assert kernel.values(0x40045564) == [1, 3]  # EV_KEY, EV_ABS
    assert 0x130 in kernel.values(0x40045565)
    setups = [struct.unpack("@H2x6i", s) for s in kernel.values(0x401C5504) if isinstance(s, bytes)]
    assert (0x10, 0, -1, 1, 0, 0, 0) in setups
    assert (0, 0, -32767, 32767, 0, 0, 0) in setups
    pad.set("pad_a", down=True)
    pad.set("pad_left", down=True)
    pad.set("pad_right", down=True)
    pad.set("pad_left", down=False)  # the other direction stays
    pad.set("pad_right", down=False)
    told = [event for event in events(device) if event != (0, 0, 0)]
    assert told == [(1, 0x130, 1), *((3, 0x10, value) for value in (-1, 1, 1, 0))]


@linux
def test_missing_device_says_how_to_load_it(tmp_path: Path) -> None:
    with pytest.raises(BackendError, match="sudo modprobe uinput"):
        Uinput("keyboard", str(tmp_path / "none"), Kernel())


@linux
def test_missing_permission_names_the_rule_that_ships(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise OSError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(BackendError, match="sudo cp") as refused:
        Uinput("keyboard", "/dev/uinput", Kernel())
    assert "\n" not in str(refused.value)
    assert str(uinput.RULE) in str(refused.value)
    assert 'KERNEL=="uinput"' in uinput.RULE.read_text()


@linux
def test_kernel_that_makes_no_device_is_one_sentence(device: Path) -> None:
    def refuse(handle: int, request: int, value: int | bytes) -> None:
        raise OSError(errno.EINVAL, "Invalid argument")

    with pytest.raises(BackendError, match="makes no keyboard: Invalid argument"):
        Uinput("keyboard", str(device), refuse)


def test_windows_gets_scan_codes_with_the_extended_flag_where_it_belongs() -> None:
    sent: list[tuple[int, int, int]] = []

    def send(one: windows.Input) -> int:
        packed = bytes(one)
        assert len(packed) == ctypes.sizeof(windows.Input) == (40 if sys.maxsize > 2**32 else 28)
        start = windows.Input.union.offset
        virtual, scan, flags = struct.unpack_from("<HHI", packed, start)
        assert one.type == 1
        sent.append((virtual, scan, flags))
        return 1

    keyboard = windows.Windows(send)
    keyboard.set("a", down=True)
    keyboard.set("a", down=False)
    keyboard.set("left", down=True)
    keyboard.set("rctrl", down=True)
    assert sent == [(0, 30, 8), (0, 30, 10), (0, 0x4B, 9), (0, 0x1D, 9)]


def test_windows_that_takes_nothing_is_told() -> None:
    with pytest.raises(BackendError, match="administrator"):
        windows.Windows(lambda one: 0).set("a", down=True)


class Pynput:
    """pynput's Controller and KeyCode in one."""

    def __init__(self) -> None:
        self.done: list[tuple[str, int]] = []

    def from_vk(self, code: int) -> int:
        return code

    def press(self, code: int) -> None:
        self.done.append(("press", code))

    def release(self, code: int) -> None:
        self.done.append(("release", code))


def test_x11_gets_key_symbols_and_macos_key_codes() -> None:
    fake: Any = Pynput()
    for keyboard in (by_pynput.X11(fake, fake), by_pynput.MacOS(fake, fake)):
        keyboard.set("left", down=True)
        keyboard.set("left", down=False)
    assert fake.done == [(w, c) for c in (0xFF51, 0x7B) for w in ("press", "release")]


def test_key_that_macos_does_not_have_is_one_sentence() -> None:
    fake: Any = Pynput()
    with pytest.raises(BackendError, match="macOS has no key 'insert'"):
        by_pynput.MacOS(fake, fake).set("insert", down=True)


@pytest.mark.parametrize("back_end", [by_pynput.X11, by_pynput.MacOS])
def test_whatever_pynput_raises_is_one_sentence(back_end: Any) -> None:
    fake: Any = Pynput()
    fake.release = lambda code: 1 / 0
    with pytest.raises(BackendError, match="does not press left: division by zero"):
        back_end(fake, fake).set("left", down=False)


@pytest.mark.parametrize("name", ["x11", "windows", "macos"])
def test_only_linux_has_pads(name: str) -> None:
    with pytest.raises(BackendError, match="pad"):
        backends.open_backend(name, "gamepad")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is another way")
def test_linux_falls_back_to_x11_but_not_on_wayland(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def create(name: str, kind: str) -> object:
        tried.append(name)
        raise BackendError(f"no {name}")

    monkeypatch.setattr(backends, "_create", create)
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setenv("XDG_SESSION_TYPE", "x11")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(BackendError, match=r"^no uinput; or through X11: no x11$"):
        backends.open_backend("auto", "keyboard")
    with pytest.raises(BackendError, match=r"^no uinput$"):
        backends.open_backend("auto", "gamepad")
    monkeypatch.setenv("XDG_SESSION_TYPE", "wayland")
    with pytest.raises(BackendError, match=r"^no uinput$"):
        backends.open_backend("auto", "keyboard")
    assert tried == ["uinput", "x11", "uinput", "uinput"]


def test_every_key_has_one_code_of_each_system() -> None:
    for codes in (
        [key.evdev for key in KEYS.values()],
        [key.scan for key in KEYS.values()],
        [key.keysym for key in KEYS.values()],
        [key.mac for key in KEYS.values() if key.mac >= 0],
    ):
        assert len(codes) == len(set(codes))
