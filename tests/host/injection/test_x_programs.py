"""Keys in real X programs, under an X server of our own: Xvfb, xev, and the game in its window.

    pytest -m system tests/host/injection/test_x_programs.py

They need Debian's xvfb and x11-utils, and the [keys] extra.
"""

from __future__ import annotations

import json
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.benchmarks import key_signals
from tests.support.x_programs import PATIENCE_S, Orb, Player, Screen, server, until
from tetris.window.play_screen import READY_S

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not shutil.which("Xvfb"), reason="needs Debian's xvfb"),
    pytest.mark.skipif(not shutil.which("xev"), reason="needs Debian's x11-utils"),
]

GUARD_S = 0.3  # the game takes no second drop right after the first
RELEASE_S = 0.5  # after whatever happens to the sender
# On a machine so busy that `host` stands still for 0.3 s, its watchdog lifts every key and disarms:
# what has not come by then does not come, and is tried again.
ATTEMPTS, LOST_S = 5, 3.0
MAPPING = """
[everywhere]
menu = { arm = true }

[profile.game]
down = { key = "down", mode = "hold" }
drop = "space"
left = { key = "shift+a" }
right = "b"
"""


@pytest.fixture(scope="module")
def screen() -> Iterator[Screen]:
    pytest.importorskip("Xlib", reason="needs the [keys] extra")
    with server() as screen:
        yield screen


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
    host = Player(screen.environment, orb, mapping)
    yield host
    host.end()


def test_keys_and_chords_arrive_in_x(screen: Screen, orb: Orb, player: Player) -> None:
    command = ["xev", "-event", "keyboard", "-name", "listener"]
    xev = subprocess.Popen(command, env=screen.environment, stdout=subprocess.PIPE)
    try:
        screen.focus("listener")
        orb.say("tap drop")  # it is disarmed, so this must not arrive
        for _ in range(ATTEMPTS):
            orb.say("tap menu")
            orb.say("tap left")
            typed = listen(xev, "A A ")
            orb.say("tap right")
            if (typed := typed + listen(xev, "b b ")).endswith("b b "):
                break
        assert typed == "A A b b "
        until(lambda: not screen.down())
    finally:
        xev.kill()
        xev.communicate()


def listen(xev: subprocess.Popen[bytes], last: str) -> str:
    """Return the key symbols that have come, until the last ones, or none for some seconds."""
    assert xev.stdout is not None
    handle, heard, typed = xev.stdout.fileno(), b"", ""
    while not typed.endswith(last) and select.select([handle], [], [], LOST_S)[0]:
        heard += os.read(handle, 65536)
        symbols = re.findall(rb"keysym 0x\w+, (\w+)\)", heard)
        typed = "".join(f"{name.decode()} " for name in symbols if b"Shift" not in name)
    return typed


def test_drops_arrive_in_the_game(screen: Screen, orb: Orb, player: Player, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tetris", "--mode", "endless", "--seed", "1", "--json"]
    own = {**screen.environment, "XDG_DATA_HOME": str(tmp_path)}
    game = subprocess.Popen(command, env=own, stdout=subprocess.PIPE, text=True)
    try:
        window = screen.focus("Tetris")
        orb.say("tap menu")
        player.until("armed by the orb")
        time.sleep(2 * READY_S)  # the first piece waits for its player
        for _ in range(3):
            orb.say("tap drop")
            until(screen.down)
            until(lambda: not screen.down())
            time.sleep(GUARD_S)
        screen.ask_to_close(window)
        result = json.loads(game.communicate(timeout=PATIENCE_S)[0])
        assert result["pieces"] == 3
    finally:
        game.kill()
        game.communicate()


def held(screen: Screen, orb: Orb, player: Player) -> None:
    """Arm, and hold a key down."""
    assert screen.down() == []
    for _ in range(ATTEMPTS):
        orb.say("tap menu")
        orb.say("hold down")
        end_s = time.monotonic() + LOST_S
        while time.monotonic() < end_s:
            if screen.down():
                return
        orb.say("let go")
    raise AssertionError("the key did not go down")


def released_s(screen: Screen, after: str) -> float:
    """Return how long the keys took to go up, and print it."""
    began_s = time.monotonic()
    until(lambda: not screen.down())
    took_s = time.monotonic() - began_s
    print(f"{after}: up after {took_s * 1000:.1f} ms")
    return took_s


def test_keys_of_a_killed_sender_go_up_within_half_a_second(
    screen: Screen, orb: Orb, player: Player
) -> None:
    held(screen, orb, player)
    player.process.kill()
    assert released_s(screen, "SIGKILL of the host") <= RELEASE_S


def test_death_of_watchdog_lifts_keys_and_disarms(screen: Screen, orb: Orb, player: Player) -> None:
    held(screen, orb, player)
    os.kill(player.guard(), signal.SIGKILL)
    released_s(screen, "SIGKILL of the watchdog")
    assert "the watchdog has died" in player.until("disarmed with every key up")
    orb.say("let go")
    orb.say("tap menu")
    player.until("armed by the orb")
    orb.say("hold down")
    until(screen.down)


def test_keys_go_up_when_the_orb_falls_silent(screen: Screen, orb: Orb, player: Player) -> None:
    held(screen, orb, player)
    orb.process.send_signal(signal.SIGSTOP)
    released_s(screen, "silence of the orb")
    assert "every key is up" in player.until("silent")
    orb.process.send_signal(signal.SIGCONT)


def test_no_key_stays_down_after_random_signals(screen: Screen, tmp_path: Path) -> None:
    mapping = tmp_path / "keys.toml"
    mapping.write_text(key_signals.MAPPING)
    played = key_signals.rounds(
        screen, lambda orb: Player(screen.environment, orb, mapping), seed=1, count=12
    )
    print(key_signals.summary(played))
    assert [str(plan) for plan, outcome in played if outcome.survivor and not outcome.ok] == []
