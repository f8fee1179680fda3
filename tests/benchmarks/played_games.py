"""What a player notices of games with the virtual orb: the demo's, and the keyboard's.

    python -m tests.benchmarks.played_games [--games N] [--minutes M] [--json]

plays the demo on both presets, and the same player at a keyboard: the same decisions, with the same
pauses to look, but each command a key that is held for `KEY_S`, an assumption, and never goes
wrong. A command takes its gesture, and a pause between two. Half an hour of play takes a minute or
two.
"""

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from statistics import fmean, median
from typing import Any, Final

from controller.shared.event_metric import Answer, Event, Score, judge
from controller.simulator.orb import PRESETS
from host.actions import ACTIONS
from host.demo import demo
from host.demo.autoplayer import Autoplayer
from host.demo.demo import PACE
from tetris.engine.game import Game

from .results import Results, command_line

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


def play(who: str, seed: int, seconds: float) -> dict[str, Any]:
    """Play one game, and return it as `host --demo --json` prints it."""
    return keyboard(seed, seconds) if who == KEYBOARD else orb(who, seed, seconds)


def note(results: Results, who: str, games: Sequence[dict[str, Any]]) -> None:
    """Note the figures of a player's games."""
    score, lasts, pauses = Score(), list[float](), list[float]()
    for game in games:
        events = [Event(on / 1000, off / 1000, name) for on, off, name in game["events"]]
        answers = [Answer(ms / 1000, name) for ms, name in game["commands"]]
        score.add(judge(events, answers))
        lasts += [one.release_s - one.onset_s for one in events]
        pauses += [after.onset_s - before.release_s for before, after in pairwise(events)]
    minutes = sum(game["seconds"] for game in games) / 60.0
    right, alarms = score.recall, score.false_alarms / minutes
    results.note("right", right, preset=who, gestures=score.intended, minutes=minutes)
    results.note("alarms", alarms, "per minute", preset=who)
    results.note("command", fmean(lasts) + median(pauses), "s", preset=who)
    results.note("latency", median(score.latencies_s), "s", preset=who)


def main() -> None:
    parser = command_line(__doc__, games=5, minutes=6.0)
    arguments = parser.parse_args()
    results = Results("played_games")
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context) as pool:
        seeds, seconds = range(SEED, SEED + arguments.games), 60.0 * arguments.minutes
        jobs = {who: [pool.submit(play, who, seed, seconds) for seed in seeds] for who in PLAYERS}
        for who, own in jobs.items():
            note(results, who, [job.result() for job in own])
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
