"""An X server, an orb and a host for tests, each a process of its own."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.support.processes import LineProcess
from tests.support.waiting import PATIENCE_S, until

__all__ = ["PATIENCE_S", "Orb", "Player", "Screen", "server", "until"]
DEVICE = Path(__file__).with_name("fake_device.py")


@contextlib.contextmanager
def xvfb(width: int = 1280, height: int = 800) -> Iterator[str]:
    """Run an X server without a monitor, pixels; yield its display, such as ":1"."""
    reading, writing = os.pipe()
    size = f"{width}x{height}x24"
    process = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", size, "-nolisten", "tcp"],
        pass_fds=[writing], stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(writing)
    with os.fdopen(reading) as told:
        display = f":{told.readline().strip()}"
    try:
        yield display
    finally:
        process.terminate()
        process.wait()


@contextlib.contextmanager
def server() -> Iterator[Screen]:
    """Run an X server whose keys can be looked at."""
    with xvfb() as display:
        screen = Screen(display)
        yield screen
        screen.close()


class Screen:
    """An X server that nobody sees."""

    def __init__(self, display: str) -> None:
        from Xlib.display import Display

        self.environment = {**os.environ, "DISPLAY": display, "PYTHONUNBUFFERED": "1"}
        for name in ("WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER"):
            self.environment.pop(name, None)
        self._display = Display(display)

    def close(self) -> None:
        self._display.close()

    def down(self) -> list[int]:
        """Return the codes of the keys that the server holds to be down."""
        rows = self._display.query_keymap()
        return [code for code in range(256) if rows[code // 8] >> (code % 8) & 1]

    def lift(self) -> None:
        """Release every key that is down."""
        from Xlib import X
        from Xlib.ext import xtest

        for code in self.down():
            xtest.fake_input(self._display, X.KeyRelease, code)
        self._display.sync()

    def focus(self, title: str) -> Any:
        """Give the keyboard to the window of a title, once it is there; return the window."""
        from Xlib import X
        from Xlib.error import XError

        def find() -> Any:
            for window in self._display.screen().root.query_tree().children:
                with contextlib.suppress(XError):  # some last for moments only
                    viewable = window.get_attributes().map_state == X.IsViewable
                    names = window.get_wm_name(), window.get_full_text_property(name)
                    if viewable and title in names:
                        return window
            return None

        name = self._display.intern_atom("_NET_WM_NAME")

        window = until(find)
        window.set_input_focus(X.RevertToParent, X.CurrentTime)
        self._display.sync()
        until(lambda: self._display.get_input_focus().focus == window)
        return window

    def ask_to_close(self, window: Any) -> None:
        """Do what a window manager does for its cross."""
        from Xlib.protocol.event import ClientMessage

        protocols, delete = map(self._display.intern_atom, ("WM_PROTOCOLS", "WM_DELETE_WINDOW"))
        window.send_event(
            ClientMessage(window=window, client_type=protocols, data=(32, [delete, 0, 0, 0, 0]))
        )
        self._display.sync()


class Orb(LineProcess):
    """A device that does what it is told."""

    def __init__(self) -> None:
        super().__init__([sys.executable, str(DEVICE), "listen://127.0.0.1:0", "--scripted"])
        self.url = str(json.loads(self.line())["listening"])

    def until(self, wanted: str) -> None:
        """Wait until it prints a line."""
        while self.line() != wanted:
            pass

    def say(self, line: object) -> None:
        """Tell it what to do, and wait until it has."""
        super().say(line)
        self.until("done")


class Player:
    """`host` with the keyboard as its target."""

    def __init__(
        self,
        environment: dict[str, str],
        orb: Orb,
        mapping: Path,
        *,
        backend: str = "x11",
        target: str = "keyboard",
    ) -> None:
        command = [sys.executable, "-m", "host", "--target", target, "--headless"]
        command += ["--backend", backend, "--mapping", str(mapping), "--link", orb.url]
        self.process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
        orb.until("hello")

    def guard(self) -> int:
        """Return the process id of its watchdog."""
        found = subprocess.check_output(["pgrep", "-P", str(self.process.pid)], text=True)
        return int(found.split()[0])

    def until(self, words: str) -> str:
        """Return the next line on standard error that has these words."""
        assert self.process.stderr is not None
        for line in self.process.stderr:
            if words in line:
                return line
        raise AssertionError(f"it ended without a word of {words!r}")

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        assert self.process.stderr is not None
        self.process.stderr.close()
