"""Keys in real X programs, under an X server of our own: Xvfb, xev, and the game in its window.

    pytest -m system tests/test_keys_system.py

They need Debian's xvfb and x11-utils, and the [keys] extra.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from x_programs import PATIENCE_S, Orb, Player, Screen, until

from tetris.window.screens.play_screen import READY_S

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not shutil.which("Xvfb"), reason="needs Debian's xvfb"),
    pytest.mark.skipif(not shutil.which("xev"), reason="needs Debian's x11-utils"),
]

GUARD_S = 0.3  # the game takes no second drop right after the first
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


def test_drops_arrive_in_the_game_s_window(
    screen: Screen, orb: Orb, player: Player, tmp_path: Path
) -> None:
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
