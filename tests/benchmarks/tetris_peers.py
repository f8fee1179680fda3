"""Other people's games as `tests.benchmarks.tetris` runs them: a process each, in their own Python.

    PYTHON -I tetris_peers.py NAME

Nothing of ours is imported here. For each line of standard input, a number of steps, the process
plays so many steps of a random policy through the game's public interface, beginning a new game
whenever one is over, and answers with steps per CPU second. The policy's choices are made before.
"""

import importlib
import importlib.metadata
import random
import sys
import time
from collections.abc import Callable
from typing import Any

Play = Callable[[list[int]], None]
CHOICES = 8  # wait, left, right, down, turn, turn back, hard drop, hold


def tetris_gymnasium() -> Play:
    """Step the environment, without the wrappers that `gymnasium.make` adds."""
    env: Any = importlib.import_module("tetris_gymnasium.envs.tetris").Tetris()
    env.reset(seed=1)

    def play(choices: list[int]) -> None:
        for choice in choices:
            if env.step(choice)[2]:
                env.reset()

    return play


def tetris() -> Play:
    """Push moves, with the time that its gravity needs taken from the clock."""
    library: Any = importlib.import_module("tetris")

    def play(choices: list[int]) -> None:
        game = library.BaseGame(seed=1)
        moves = (
            game.tick, game.left, game.right, game.soft_drop, game.rotate, lambda: game.rotate(-1),
            game.hard_drop, game.swap,
        )  # fmt: skip
        for choice in choices:
            try:
                moves[choice]()
            except AssertionError:  # a held piece that comes back where blocks are
                game.reset()
            if game.lost:
                game.reset()

    return play


def tetris_terminal() -> Play:
    """Act, and let a twentieth of a second pass."""
    core_module: Any = importlib.import_module("tetris.core")
    over: list[bool] = []
    config = core_module.Config()
    mode = next(iter(core_module.GameMode))

    def begin() -> Any:
        over.clear()
        return core_module.TetrisCore(
            mode, config, lambda _: None, lambda *_: over.append(True), seed=1
        )

    def play(choices: list[int]) -> None:
        core = begin()
        for choice in choices:
            name = TERMINAL[choice]
            if name and core.controllable():
                getattr(core, name)()
            core.process(0.05)
            if over:
                core = begin()

    return play


TERMINAL = (
    None, "do_move_left", "do_move_right", "do_soft_drop", "do_rotate_cw", "do_rotate_ccw",
    "do_hard_drop", "do_hold",
)  # fmt: skip
PEERS: dict[str, Callable[[], Play]] = {
    "tetris-gymnasium": tetris_gymnasium,
    "tetris": tetris,
    "tetris-terminal": tetris_terminal,
}


def main() -> None:
    """Say which version it is, and then how fast, as often as asked."""
    name = sys.argv[1]
    play = PEERS[name]()
    print(importlib.metadata.version(name), flush=True)
    chooser = random.Random(1)
    for line in sys.stdin:
        choices = [chooser.randrange(CHOICES) for _ in range(int(line))]
        start = time.process_time()
        play(choices)
        print(len(choices) / (time.process_time() - start), flush=True)


if __name__ == "__main__":
    main()
