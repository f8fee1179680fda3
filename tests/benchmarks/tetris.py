"""Speed of the game beside Tetris-Gymnasium, a random policy each, interleaved in one run.

    python -m tests.benchmarks.tetris [--peer PYTHON] [--rounds N] [--games N] [--json]

The peer needs an environment of its own, for it brings old libraries:

    python3 -m venv peer && peer/bin/pip install tetris-gymnasium
    python -m tests.benchmarks.tetris --peer peer/bin/python

All figures are steps per CPU second: `steps` through `Game.update`, one input and 1/60 s each, with
gravity, lock delay, points and events; `env` through our environment's `step`, observation
included; `kernel` through `Kernel.step`. Ratios are to Tetris-Gymnasium's `step`, which returns an
observation too, both without wrappers: of each round, then their median; without the peer there
are none. Before that the kernel is held against the engine on random games. `placements_us` is the
time to find all placements of each piece, mean over boards of games played well and of games played
at random.
"""

import random
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Final

from tests.reference.tetris_kernel import MOVES, Kernel, agree
from tests.support.processes import LineProcess
from tetris.bots.greedy import plan
from tetris.bots.placements import find
from tetris.engine.game import Action, Game, Phase
from tetris.engine.pieces import KINDS, Piece

from .results import Results, command_line

PEER: Final = "tetris-gymnasium"
PEER_STEPS: Final = 4_000
# It prints its version, and its steps per CPU second for each number of steps that it reads.
PEER_SCRIPT: Final = """
import importlib.metadata, random, sys, time
from tetris_gymnasium.envs.tetris import Tetris
env, chooser = Tetris(), random.Random(1)
env.reset(seed=1)
print(importlib.metadata.version("tetris-gymnasium"), flush=True)
for line in sys.stdin:
    choices = [chooser.randrange(8) for _ in range(int(line))]
    start_s = time.process_time()
    for choice in choices:
        if env.step(choice)[2]:
            env.reset()
    print(len(choices) / (time.process_time() - start_s), flush=True)
"""
GOALS: Final = {"steps": 60.0, "env": 20.0, "kernel": 200.0}
PLACEMENTS_GOAL_US: Final = 12.0
STEPS: Final = 100_000


def per_second(play: Callable[[], None], steps: int = STEPS) -> float:
    """Return steps per CPU second of this process."""
    start_s = time.process_time()
    play()
    return steps / (time.process_time() - start_s)


def steps_rate(seed: int) -> float:
    """Play through the engine's `update`."""
    chooser = random.Random(seed)
    inputs = [chooser.choice(((), *((move,) for move in MOVES))) for _ in range(STEPS)]
    game, over, again = Game(seed), Phase.OVER, (Action.RESTART,)

    def play() -> None:
        time_s, update = 0.0, game.update
        for given in inputs:
            time_s += 1 / 60
            update(time_s, given)
            if game.phase is over:
                update(time_s, again)

    return per_second(play)


def env_rate(seed: int) -> float:
    """Play through the environment's `step`."""
    from tetris.bots.gym_env import INPUTS, TetrisEnv

    chooser = random.Random(seed)
    actions = [chooser.randrange(len(INPUTS)) for _ in range(STEPS // 4)]
    env = TetrisEnv()
    env.reset(seed=seed)

    def play() -> None:
        for action in actions:
            if env.step(action)[2]:
                env.reset()

    return per_second(play, len(actions))


def kernel_rate(seed: int) -> float:
    """Play through the kernel's `step`."""
    chooser = random.Random(seed)
    actions = [chooser.choice((Action.PAUSE, *MOVES)) for _ in range(STEPS)]  # it ignores a pause
    kernel = Kernel(seed)

    def play() -> None:
        step = kernel.step
        for action in actions:
            step(action)
            if kernel.over:
                kernel.restart()

    return per_second(play)


def differences(games: int) -> tuple[int, int]:
    """Play random games in kernel and engine; return the moves, and after how many they differ."""
    chooser = random.Random(1)
    game, kernel = Game(1), Kernel(1)
    moves = wrong = 0
    for _ in range(games):
        while not kernel.over:
            action = chooser.choice(MOVES)
            game.update(0.0, (action,))
            kernel.step(action)
            moves += 1
            wrong += not agree(kernel, game)
        kernel.restart()
        game.update(0.0, (Action.RESTART,))
    return moves, wrong


def boards() -> dict[str, list[int]]:
    """Return boards of games played well, and of games played at random."""
    well: list[int] = []
    wild: list[int] = []
    chooser = random.Random(1)
    for seed in range(5):
        game = Game(seed)
        for _ in range(60):
            game.update(0.0, plan(game).actions)
            well.append(game.board.bits)
    game, turns_and_shifts = Game(1), MOVES[:2] + MOVES[4:6]
    while len(wild) < len(well):
        game.update(0.0, [*chooser.choices(turns_and_shifts, k=6), Action.HARD_DROP])
        if game.phase is Phase.OVER:
            game.update(0.0, [Action.RESTART])
        wild.append(game.board.bits)
    return {"played well": well, "at random": wild}


def placements_us(sets: dict[str, list[int]]) -> dict[str, float]:
    """Return the mean time to find all placements, for each set of boards and over all."""
    entering = [Piece.entering(kind) for kind in KINDS]
    times: dict[str, float] = {}
    for name, some in sets.items():
        pairs = [(bits, piece) for bits in some for piece in entering if not bits & piece.mask]
        start_s = time.process_time()
        for bits, piece in pairs:
            find(bits, piece)
        times[name] = (time.process_time() - start_s) / len(pairs) * 1e6
    return {"placements_us": statistics.mean(times.values()), **times}


def main() -> int:
    """Measure and print; 1 if the kernel differs from the engine."""
    parser = command_line(__doc__, rounds=7, games=100_000)
    parser.add_argument("--peer", metavar="PYTHON", help="with Tetris-Gymnasium")
    arguments = parser.parse_args()
    moves, wrong = differences(arguments.games)
    print(f"kernel against engine: {arguments.games:,} games, {moves:,} moves, {wrong} differ")
    ours: dict[str, Callable[[int], float]] = {
        "steps": steps_rate,
        "env": env_rate,
        "kernel": kernel_rate,
    }
    version, peer = "", None
    if arguments.peer:
        peer = LineProcess([arguments.peer, "-I", "-c", PEER_SCRIPT], cwd=tempfile.gettempdir())
        version = peer.line()
    rates: dict[str, list[float]] = {name: [] for name in (*ours, *([PEER] if peer else []))}
    sets = boards()
    placements: list[dict[str, float]] = []
    for number in range(-1, arguments.rounds):  # the first only warms up
        found = {name: rate(number + 1) for name, rate in ours.items()}
        if peer:
            peer.say(PEER_STEPS)
            found[PEER] = float(peer.line())
        times = placements_us(sets)
        if number >= 0:
            placements.append(times)
            for name, rate in found.items():
                rates[name].append(rate)
    if peer:
        peer.close()
    results = Results("tetris")
    for name, values in rates.items():
        note(results, name, values, "steps/s")
    reference = rates.get(PEER, [])
    for name, goal in GOALS.items():
        ratios = [mine / theirs for mine, theirs in zip(rates[name], reference, strict=False)]
        note(results, f"tetris_{name}_ratio", ratios, goal=goal)
    for name in placements[0]:
        aim = PLACEMENTS_GOAL_US if name == "placements_us" else None
        note(results, name, [times[name] for times in placements], "µs", goal=aim)
    results.finish(arguments.json, moves=moves, wrong=wrong, peer=version)
    return 1 if wrong else 0


def note(
    results: Results, name: str, values: list[float], unit: str = "", goal: float | None = None
) -> None:
    """Note the median, the least and the greatest of some values; None of none."""
    if values:
        span = {"low": min(values), "high": max(values)}
        results.note(name, statistics.median(values), unit, goal=goal, **span)
    else:
        results.note(name, None, unit, goal=goal)


if __name__ == "__main__":
    sys.exit(main())
