"""Keys in real X programs, under an X server of our own: Xvfb, xev, and the game in its window.

    pytest -m system tests/test_keys_system.py

They need Debian's xvfb and x11-utils, and the [keys] extra.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not shutil.which("Xvfb"), reason="needs Debian's xvfb"),
    pytest.mark.skipif(not shutil.which("xev"), reason="needs Debian's x11-utils"),
]

PATIENCE_S = 30.0  # an upper bound; nothing here takes seconds on an idle machine
RELEASE_S = 0.5  # after whatever happens to the sender
MAPPING = """
[everywhere]
menu = { arm = true }

[profile.game]
down = { key = "down", mode = "hold" }
drop = "space"
left = { key = "shift+a" }
right = { text = "Orb!" }
"""
DEVICE = Path(__file__).with_name("played_device.py")


class Screen:
    """An X server that nobody sees."""

    def __init__(self, number: str) -> None:
        from Xlib.display import Display

        self.environment = {**os.environ, "DISPLAY": f":{number}", "PYTHONUNBUFFERED": "1"}
        for name in ("WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER"):
            self.environment.pop(name, None)
        self._display = Display(f":{number}")

    def close(self) -> None:
        self._display.close()

    def down(self) -> list[int]:
        """Return the codes of the keys that the server holds to be down."""
        rows = self._display.query_keymap()
        return [code for code in range(256) if rows[code // 8] >> (code % 8) & 1]

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


class Orb:
    """A device that does what it is told."""

    def __init__(self) -> None:
        command = [sys.executable, str(DEVICE), "listen://127.0.0.1:0"]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )
        self.url = str(json.loads(self._line())["listening"])

    def met(self) -> None:
        """Wait until a host has come."""
        while self._line() != "hello":
            pass

    def say(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        while self._line() != "done":
            pass

    def _line(self) -> str:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line, "the device has ended"
        return line.strip()


class Player:
    """`host` with the keyboard as its target."""

    def __init__(self, screen: Screen, orb: Orb, mapping: Path) -> None:
        command = [sys.executable, "-m", "host", "--target", "keyboard", "--headless"]
        command += ["--backend", "x11", "--keys", str(mapping), "--link", orb.url]
        self.process = subprocess.Popen(
            command, env=screen.environment, stderr=subprocess.PIPE, text=True
        )
        orb.met()

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


def until(condition: Callable[[], Any]) -> Any:
    """Return what a condition becomes when it is true."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        if found := condition():
            return found
        time.sleep(0.001)
    raise AssertionError("it did not happen")


@pytest.fixture(scope="module")
def screen() -> Iterator[Screen]:
    pytest.importorskip("Xlib", reason="needs the [keys] extra")
    reading, writing = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x800x24", "-nolisten", "tcp"],
        pass_fds=[writing],
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    with os.fdopen(reading) as told:
        number = told.readline().strip()
    screen = Screen(number)
    yield screen
    screen.close()
    server.terminate()
    server.wait()


@pytest.fixture
def orb() -> Iterator[Orb]:
    device = Orb()
    yield device
    device.process.kill()
    device.process.communicate()


@pytest.fixture
def player(screen: Screen, orb: Orb, tmp_path: Path) -> Iterator[Player]:
    mapping = tmp_path / "keys.toml"
    mapping.write_text(MAPPING)
    host = Player(screen, orb, mapping)
    yield host
    host.end()


def test_keys_chords_and_texts_arrive_in_an_x_program(
    screen: Screen, orb: Orb, player: Player
) -> None:
    command = ["xev", "-event", "keyboard", "-name", "listener"]
    xev = subprocess.Popen(command, env=screen.environment, stdout=subprocess.PIPE, text=True)
    assert xev.stdout is not None
    screen.focus("listener")
    orb.say("tap drop")  # it is disarmed, so this must not arrive
    orb.say("tap menu")
    player.until("armed by the orb")
    orb.say("tap left")
    orb.say("tap right")
    typed = ""
    for line in xev.stdout:
        if "keysym" in line and "Shift" not in line:
            symbol = line.split("keysym")[1].split()[1].strip("),")
            typed += symbol + " "
        if typed.endswith("exclam exclam "):
            break
    assert typed == "A A O O r r b b exclam exclam "
    until(lambda: not screen.down())
    xev.kill()
    xev.communicate()


def test_drops_arrive_in_the_game_s_window(screen: Screen, orb: Orb, player: Player) -> None:
    command = [sys.executable, "-m", "tetris", "--seed", "1", "--json"]
    game = subprocess.Popen(command, env=screen.environment, stdout=subprocess.PIPE, text=True)
    try:
        window = screen.focus("Tetris")
        orb.say("tap menu")
        player.until("armed by the orb")
        for _ in range(3):
            orb.say("tap drop")
            until(screen.down)
            until(lambda: not screen.down())
        screen.ask_to_close(window)
        result = json.loads(game.communicate(timeout=PATIENCE_S)[0])
        assert result["pieces"] == 3
    finally:
        game.kill()
        game.communicate()


def held(screen: Screen, orb: Orb, player: Player) -> None:
    """Arm, and hold a key down."""
    assert screen.down() == []
    orb.say("tap menu")
    orb.say("hold down")
    until(screen.down)


def released_s(screen: Screen) -> float:
    began_s = time.monotonic()
    until(lambda: not screen.down())
    return time.monotonic() - began_s


@pytest.mark.parametrize("attempt", range(5))
def test_keys_of_a_killed_sender_go_up_within_half_a_second(
    attempt: int, screen: Screen, orb: Orb, player: Player
) -> None:
    held(screen, orb, player)
    player.process.kill()
    took_s = released_s(screen)
    print(f"SIGKILL of the host: up after {took_s * 1000:.1f} ms")
    assert took_s <= RELEASE_S


@pytest.mark.parametrize("ended_by", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_keys_go_up_when_the_host_is_ended(
    ended_by: signal.Signals, screen: Screen, orb: Orb, player: Player
) -> None:
    held(screen, orb, player)
    player.process.send_signal(ended_by)
    took_s = released_s(screen)
    print(f"{ended_by.name} of the host: up after {took_s * 1000:.1f} ms")
    assert player.process.wait(timeout=PATIENCE_S) == 128 + ended_by


def test_keys_of_a_sender_that_hangs_go_up_and_stay_up(
    screen: Screen, orb: Orb, player: Player
) -> None:
    held(screen, orb, player)
    player.process.send_signal(signal.SIGSTOP)
    took_s = released_s(screen)
    print(f"SIGSTOP of the host: up after {took_s * 1000:.1f} ms")
    player.process.send_signal(signal.SIGCONT)
    assert "hung" in player.until("disarmed with every key up")
    assert screen.down() == []


def test_death_of_the_watchdog_lifts_the_keys_and_disarms_until_it_is_armed_again(
    screen: Screen, orb: Orb, player: Player
) -> None:
    held(screen, orb, player)
    os.kill(player.guard(), signal.SIGKILL)
    took_s = released_s(screen)
    print(f"SIGKILL of the watchdog: up after {took_s * 1000:.1f} ms")
    assert "the watchdog has died" in player.until("disarmed with every key up")
    orb.say("let go")
    orb.say("tap menu")
    player.until("armed by the orb")
    orb.say("hold down")
    until(screen.down)


def test_watchdog_that_hangs_is_replaced(screen: Screen, orb: Orb, player: Player) -> None:
    held(screen, orb, player)
    os.kill(player.guard(), signal.SIGSTOP)
    assert "the watchdog has hung" in player.until("disarmed with every key up")
    assert screen.down() == []


def test_keys_go_up_when_the_orb_falls_silent(screen: Screen, orb: Orb, player: Player) -> None:
    held(screen, orb, player)
    orb.process.send_signal(signal.SIGSTOP)
    took_s = released_s(screen)
    print(f"silence of the orb: up after {took_s * 1000:.1f} ms")
    assert "every key is up" in player.until("silent")
    orb.process.send_signal(signal.SIGCONT)
