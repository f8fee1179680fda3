"""Games whose channel `models paper --games` measures: the demo's, and the keyboard's.

    python -m tests.benchmarks.information_games FOLDER [--games N] [--minutes M]

plays the demo on both presets, and the same player at a keyboard: the same decisions, with the same
pauses to look, but each command a key that is held for `KEY_S`, an assumption, and never goes
wrong. Each game is a file, as of `host --demo --json`. Half an hour of play takes a minute or two.
"""

import json
import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, Final

from controller.simulator.orb import PRESETS
from host.actions import ACTIONS
from host.demo import demo
from host.demo.autoplayer import Autoplayer
from host.demo.demo import PACE
from tetris.engine.game import Game

from .results import command_line, say

KEYBOARD: Final = "keyboard"
KEY_S: Final = 0.1
SEED: Final = 500
PLAYERS: Final = (*PRESETS, KEYBOARD)


def orb(preset: str, seed: int, seconds: float) -> dict[str, Any]:
    """Play a game with the virtual orb, as fast as it goes."""
    options = () if preset == "nominal" else ("--preset", preset)  # the demo's own hand is quick
    with demo.Demo(seed, seconds, options) as game:
        while not game.over:
            game.tick()
        return game.verdict()


def keyboard(
    seed: int, seconds: float, hand_s: float = KEY_S, cleared: Callable[[int], object] | None = None
) -> dict[str, Any]:
    """Play the same with keys, each held for `hand_s`; stray touches take no time.

    `cleared` is called with the lines of every tick.
    """
    player, game = Autoplayer(seed, seconds), Game(seed, PACE)
    events: list[tuple[int, int, str]] = []
    commands: list[tuple[int, str]] = []
    held: tuple[int, float] | None = None
    game.update(0.0)
    for tick in range(1, round(seconds * demo.TICKS_PER_S)):
        now_s = tick / demo.TICKS_PER_S
        if held is not None and now_s >= held[1]:
            player.left(held[0], now_s)
            held = None
        due = []
        if (decided := player.decide(game, now_s)) is not None:
            performed, command = decided
            held = (performed.number, now_s + (hand_s if command else 0.0))
            if command:
                ms = round(1000 * now_s)
                events.append((ms, ms + round(1000 * hand_s), command))
                commands.append((ms, command))
                due.append(ACTIONS[command])
        game.update(now_s, due)
        if cleared is not None:
            cleared(game.lines)
    return {"seed": seed, "seconds": seconds, "events": events, "commands": commands}


def play(who: str, seed: int, seconds: float, path: Path) -> Path:
    """Play one game into its file."""
    game = keyboard(seed, seconds) if who == KEYBOARD else orb(who, seed, seconds)
    path.write_text(json.dumps(game) + "\n", encoding="utf-8")
    return path


def play_all(folder: Path, games: int, minutes: float) -> None:
    """Play so many games of each player, a folder each; games that are there are kept."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context) as pool:
        jobs = []
        for who in PLAYERS:
            (folder / who).mkdir(parents=True, exist_ok=True)
            for seed in range(SEED, SEED + games):
                path = folder / who / f"game-{seed}.json"
                if not path.exists():
                    jobs.append(pool.submit(play, who, seed, 60.0 * minutes, path))
        for job in jobs:
            say(f"played {job.result()}")


def main() -> None:
    parser = command_line(__doc__, games=5, minutes=6.0)
    parser.add_argument("folder", type=Path)
    arguments = parser.parse_args()
    play_all(arguments.folder, arguments.games, arguments.minutes)


if __name__ == "__main__":
    main()
