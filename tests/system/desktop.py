"""A screen of its own (Xvfb) with a real pointer and keyboard (xdotool), and the window on it.

The program runs in a process of its own, by `tests.system.window_app`, which prints what is shown
where, a line of JSON at each change; everything else goes through the X server.
"""

import json
import math
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Self

from controller.shared.protocol import psk

NEEDED: Final = ("Xvfb", "xdotool", "import")
_ANSWER_S: Final = 20.0
ROOT: Final = Path(__file__).parents[2]
_POLL_S: Final = 0.02
_END_S: Final = 5.0


class ScenarioError(RuntimeError):
    """The window did not do what was expected; the message says what it showed instead."""


def missing() -> list[str]:
    """Return the programs that are not installed."""
    return [name for name in NEEDED if shutil.which(name) is None]


@dataclass
class Window:
    """The program on a screen.

    Attributes:
        shown: What it printed last: screen, items, dome, history, link.
        started_s: Seconds until its first picture.
    """

    display: str  # of the X server
    home: Path  # of its settings and data
    options: Sequence[str] = ()
    python: str = sys.executable
    shown: dict[str, Any] = field(default_factory=dict)
    started_s: float = math.nan

    def __enter__(self) -> Self:
        """Start it, and wait for its first picture."""
        self.environment = {
            **environment(self.home), "DISPLAY": self.display, "SDL_AUDIODRIVER": "dummy",
            "PYGAME_HIDE_SUPPORT_PROMPT": "1",
        }  # fmt: skip
        self.environment.pop("SDL_VIDEODRIVER", None)
        begun_s = time.monotonic()
        self.process = subprocess.Popen(
            [self.python, "-m", "tests.system.window_app", *self.options],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env=self.environment, cwd=self._folder(),
        )  # fmt: skip
        threading.Thread(target=self._read, daemon=True).start()
        self.until(lambda shown: bool(shown), "its first picture")
        self.started_s = time.monotonic() - begun_s
        return self

    def __exit__(self, *_: object) -> None:
        """End it, if that has not happened."""
        self.close()

    def close(self) -> None:
        """End it as a window manager does."""
        if self.process.poll() is None:
            self.process.terminate()
        try:
            self.process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def _folder(self) -> Path | None:
        """Return where an installed program is started: a folder with the tests, not the project.

        None: here, for this project's own.
        """
        if self.python == sys.executable:
            return None
        folder = self.home / "elsewhere"
        folder.mkdir(exist_ok=True)
        (folder / "tests").symlink_to(ROOT / "tests")
        self.environment.pop("PYTHONPATH", None)
        return folder

    def _read(self) -> None:
        assert self.process.stdout
        for line in self.process.stdout:
            self.shown = json.loads(line)

    # -- what is seen ----------------------------------------------------------------------

    def until(
        self, holds: Callable[[dict[str, Any]], bool], what: str, seconds: float = _ANSWER_S
    ) -> float:
        """Wait until something holds of what is shown; return the seconds that took."""
        begun_s = time.monotonic()
        while not holds(self.shown):
            if self.process.poll() is not None:
                assert self.process.stderr
                said = self.process.stderr.read().strip()[-500:]
                raise ScenarioError(f"the program ended before {what}: {said}")
            if time.monotonic() - begun_s > seconds:
                seen = {key: self.shown.get(key) for key in ("screen", "title", "notice", "labels")}
                raise ScenarioError(f"no {what} in {seconds:g} s; it shows {seen}")
            time.sleep(_POLL_S)
        return time.monotonic() - begun_s

    def at(self, screen: str, seconds: float = _ANSWER_S) -> None:
        """Wait for a screen by its class, or its title."""
        self.until(lambda shown: screen in (shown["screen"], shown["title"]), screen, seconds)

    def picture(self, path: Path) -> None:
        """Save what the screen shows."""
        subprocess.run(["import", "-window", "root", str(path)], env=self.environment, check=True)

    # -- what a hand does ------------------------------------------------------------------

    def do(self, *words: object) -> None:
        """Run one xdotool command."""
        subprocess.run(["xdotool", *map(str, words)], env=self.environment, check=True)

    def key(self, *names: str) -> None:
        """Press keys, one after the other."""
        for name in names:
            self.do("key", name)
            time.sleep(0.06)

    def pad(self, button: str) -> None:
        """Press a button of a game pad."""
        assert self.process.stdin
        self.process.stdin.write(f"{button}\n")
        self.process.stdin.flush()
        time.sleep(0.1)

    def choose(self, label: str) -> None:
        """Click the item of a menu."""
        self.until(lambda shown: label in shown["items"], f"item {label!r}")
        left, top, width, height = self.shown["items"][label]
        self.do("mousemove", left + width // 3, top + height // 2, "click", 1)
        time.sleep(0.1)

    def press(self, x: float, y: float, seconds: float = 0.1, button: int = 1) -> None:
        """Hold the mouse's button on the dome, at shares of its radius right and up."""
        self.stroke([(x, y)], seconds, button)

    def twist(self, degrees: float, seconds: float = 0.4) -> None:
        """Drag along the rim from its top, by degrees to the right."""
        self.stroke(arc(90, 90 - degrees), seconds)

    def stroke(self, path: Sequence[tuple[float, float]], seconds: float, button: int = 1) -> None:
        """Drag along a path on the dome, shares of its radius right and up."""
        centre_x, centre_y, radius = self.shown["dome"]
        points = [(round(centre_x + radius * x), round(centre_y - radius * y)) for x, y in path]
        words: list[object] = ["mousemove", *points[0], "mousedown", button]
        for point in points[1:]:
            words += ["sleep", f"{seconds / len(points):.4f}", "mousemove", *point]
        self.do(*words, "sleep", f"{seconds / len(points):.4f}", "mouseup", button)


class VirtualOrb:
    """A virtual orb in a process of its own, which listens on loopback with a key.

    Attributes:
        options: Options of `host` with which it is reached.
    """

    def __init__(self, home: Path) -> None:
        """Prepare one; its data is kept apart from that of the window."""
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self._port = free.getsockname()[1]
        self._home, self._key = home / "orb", home / "orb.key"
        self.options = ("--link", f"socket://127.0.0.1:{self._port}", "--key", str(self._key))

    def __enter__(self) -> Self:
        """Make its key, and start it."""
        psk.read_or_make(self._key)
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End it."""
        self.kill()

    def start(self) -> None:
        """Start its process."""
        self._process = subprocess.Popen(
            [sys.executable, "-m", "controller", "--sensor", "virtual", "--seed", "1", "--link",
             f"listen://127.0.0.1:{self._port}", "--key", str(self._key)],
            env=environment(self._home), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def kill(self) -> None:
        """End its process without a warning."""
        self._process.kill()
        self._process.wait()


class Desk:
    """A screen, a home folder, and the windows that a scenario opens.

    Attributes:
        seen: What it measured, by name.
    """

    def __init__(self, display: str, home: Path, stack: ExitStack) -> None:
        self._display, self.home, self._stack = display, home, stack
        self.seen: dict[str, float] = {}
        self.window: Window | None = None

    def open(self, *options: str, python: str = sys.executable, introduced: bool = True) -> Window:
        """Open the application, and wait until its orb can be touched."""
        window = Window(self._display, self.home, options, python)
        self.window = self._stack.enter_context(window)
        window.until(lambda shown: shown["link"] == "live" and shown["ready"], "the orb", 30.0)
        if introduced and "Later" in window.shown["items"]:  # the introduction is offered once
            window.choose("Later")
        return window

    def orb(self) -> VirtualOrb:
        """Start a virtual orb that listens on loopback."""
        return self._stack.enter_context(VirtualOrb(self.home))


Scenario = Callable[[Desk], None]


def environment(home: Path) -> dict[str, str]:
    """Return variables with which a program keeps everything in a folder."""
    folders = {f"XDG_{kind}_HOME": str(home / kind.lower()) for kind in _FOLDERS}
    return {**os.environ, **folders}


def installed(folder: Path) -> str:
    """Return the Python of a new environment with the project as users install it."""
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    python = str(folder / "bin" / "python")
    subprocess.run([python, "-m", "pip", "install", "-q", str(ROOT)], check=True)
    return python


def arc(
    first_deg: float, last_deg: float, radius: float = 0.86, steps: int = 12
) -> list[tuple[float, float]]:
    """Return points on a circle, shares of the dome's radius; degrees from the right, upwards."""
    angles = [
        math.radians(first_deg + (last_deg - first_deg) * k / steps) for k in range(steps + 1)
    ]
    return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]


_FOLDERS: Final = ("CONFIG", "DATA", "STATE", "CACHE")
