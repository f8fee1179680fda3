"""The ledger from command to key: how long each hop takes, and the whole, to a real program.

Hops, with the keys written down by a back end that presses nothing: from the device's `send` to
the host's `poll` (link), from there to the stroke on the watchdog's pipe (map), and from there to
the back end (guard). The whole, under an X server of our own: from the device's `send` to the
moment at which a program of Xlib, and our game's loop in its window, get the key.
"""

from __future__ import annotations

import contextlib
import queue
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

from controller.shared.keymap.key_state import Stroke
from controller.shared.keymap.keymap import KEYBOARD, parse
from host.connection.receiver import Delivered, Received, Receiver
from host.connection.transport import open_transport
from host.injection.injector import Injector
from host.targets.keys import KeysTarget
from tests.support import SUPPORT
from tests.support.x_programs import server

from .link_peers import now_us
from .link_wires import WIRES, Peer
from .results import Results, say

APART_S: Final = (0.08, 0.13)  # between two presses, at random, so that no clock is in step
LOST_S: Final = 1.0  # a key that was not pressed by then will not be; it is counted
TICK_S: Final = 0.01  # as in `host.window_loop.serve`
_TABLE: Final = {"profile": {"game": {"left": {"key": "left", "down_ms": 20}}}}
_MAPPING: Final = (
    '[everywhere]\nmenu = { arm = true }\n[profile.game]\nleft = { key = "left", down_ms = 20 }\n'
)
_PAPER: Final = SUPPORT / "recording_watchdog.py"


class Timed(Injector):
    """The real sender of strokes, which notes when a key was put on the pipe."""

    at_us = 0

    def send(self, strokes: Iterable[Stroke]) -> None:
        for stroke in strokes:
            super().send([stroke])
            if stroke.down:
                self.at_us = now_us()


def measure(results: Results, count: int) -> None:
    """Note every figure; a missing part is said on stderr."""
    hops(results, count)
    for missing, words in (
        (shutil.which("Xvfb") is None, "Xvfb is missing (Debian: xvfb)"),
        (not _has_xlib(), "pynput is missing (the [keys] extra)"),
    ):
        if missing:
            say(f"the ledger to real programs is missing: {words}")
            return
    for role, title in (("xprogram", "listener"), ("tetris", "Tetris")):
        whole(results, role, title, count)


def hops(results: Results, count: int) -> None:
    """Measure hop by hop, over a TCP link, in this process and the watchdog's."""
    tcp = next(wire for wire in WIRES if wire.name == "tcp")
    took: dict[str, list[int]] = {"link": [], "map": [], "guard": [], "all": []}
    lost = 0
    with ExitStack() as stack:
        line = stack.enter_context(tcp.line("device"))
        paper = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "paper"
        paper.touch()
        key_map = parse(_TABLE, KEYBOARD)
        sender = Timed(
            "auto",
            "keyboard",
            key_map.keys,
            command=(sys.executable, str(_PAPER), str(paper), "uinput", "times"),
        )
        sender.start()
        target = KeysTarget(key_map, sender, lambda words: None, lambda armed: None)
        stack.callback(target.close)
        target.keys.arm("by the benchmark")
        receiver = Receiver(lambda: open_transport(line.url))
        stack.callback(receiver.close)
        receiver.connect()
        written = stack.enter_context(paper.open())
        for _ in range(count):
            _play(target, receiver, random.uniform(*APART_S))
            target.keys.arm("again, if this machine stood still for 300 ms")
            line.peer.say("left")
            times = _until_command(target, receiver)
            down_us = _next_line(written, target, receiver) if times else None
            if times is None or down_us is None:
                lost += 1
                continue
            sent_us, polled_us = times
            took["link"].append(polled_us - sent_us)
            took["map"].append(sender.at_us - polled_us)
            took["guard"].append(down_us - sender.at_us)
            took["all"].append(down_us - sent_us)
    for hop, us in took.items():
        results.percentiles(f"command_to_key_{hop}", [each / 1000 for each in us], "ms", "paper")
    results.note("command_to_key_lost", lost, "keys", preset="paper")


def _play(target: KeysTarget, receiver: Receiver, seconds: float) -> list[Received]:
    """Let the loop run for a while, as `host.window_loop.serve` does; return what came."""
    end_s, received = time.monotonic() + seconds, []
    while time.monotonic() < end_s:
        receiver.wait(TICK_S)
        news = receiver.poll()
        target.tick(time.monotonic(), news)
        received += news
    return received


def _until_command(target: KeysTarget, receiver: Receiver) -> tuple[int, int] | None:
    """Return when a command was sent, and when it was polled; None: too late, or not at all."""
    end_s = time.monotonic() + LOST_S
    while time.monotonic() < end_s:
        receiver.wait(TICK_S)
        news = receiver.poll()
        polled_us = now_us()
        target.tick(time.monotonic(), news)
        for item in news:
            if isinstance(item, Delivered) and (sent_us := getattr(item.message, "frame", None)):
                return int(sent_us), polled_us
    return None


def _next_line(written: Any, target: KeysTarget, receiver: Receiver) -> int | None:
    """Return when the back end pressed a key; None: it did not."""
    end_s = time.monotonic() + LOST_S
    while time.monotonic() < end_s:
        for line in written:
            if line.startswith("+"):
                return int(line.split()[1])
        _play(target, receiver, 0.001)
    return None


def whole(results: Results, role: str, title: str, count: int) -> None:
    """Measure `host --target keyboard` as a process, with a real program at its end."""
    us = []
    with ExitStack() as stack:
        place = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        screen = stack.enter_context(server())
        # Games and devices of the user are left alone.
        kept = dict.fromkeys(("XDG_CONFIG_HOME", "XDG_DATA_HOME"), str(place))
        environment = screen.environment | kept
        device = Peer("device", "listen://127.0.0.1:0")
        stack.callback(device.close)
        program = Peer(role, environment=environment)
        stack.callback(program.close)
        pressed: queue.SimpleQueue[int] = queue.SimpleQueue()
        screen.focus(title)
        threading.Thread(target=_listen, args=(program, pressed), daemon=True).start()
        (place / "keys.toml").write_text(_MAPPING)
        host = subprocess.Popen(
            [
                *(sys.executable, "-m", "host", "--target", "keyboard", "--headless"),
                *("--backend", "x11", "--mapping", str(place / "keys.toml")),
                *("--link", device.first["url"]),
            ],
            env=environment,
            stderr=subprocess.PIPE,
            text=True,
        )
        stack.callback(_end, host)
        assert host.stderr is not None
        armed = threading.Event()
        threading.Thread(target=_watch, args=(host.stderr, armed), daemon=True).start()
        lost = 0
        for _ in range(count):
            while not armed.is_set():  # at first, and if this machine stood still for 300 ms
                device.say("menu")
                armed.wait(LOST_S)
            time.sleep(random.uniform(*APART_S))
            while not pressed.empty():
                pressed.get()
            sent_us = now_us()
            device.say("left")
            try:
                us.append(pressed.get(timeout=LOST_S) - sent_us)
            except queue.Empty:
                lost += 1
    results.percentiles("command_to_key_event", [each / 1000 for each in us], "ms", role)
    results.note("command_to_key_event_lost", lost, "keys", preset=role)


def _watch(lines: Iterable[str], armed: threading.Event) -> None:
    """Keep track of whether the host presses anything."""
    with contextlib.suppress(ValueError):  # it was closed while we read
        for line in lines:
            if line.startswith("armed"):
                armed.set()
            elif line.startswith("disarmed"):
                armed.clear()


def _listen(program: Peer, pressed: queue.SimpleQueue[int]) -> None:
    with contextlib.suppress(RuntimeError, ValueError, KeyError):
        while True:
            pressed.put(int(program.read()["us"]))


def _end(process: subprocess.Popen[str]) -> None:
    process.terminate()
    process.communicate()


def _has_xlib() -> bool:
    try:
        import pynput.keyboard  # noqa: F401 - only whether it is there; without a display it fails
    except ModuleNotFoundError:
        return False
    except Exception:
        return True
    return True
