"""Strength of the bots: Dellacherie on a small board, and the look-ahead against it.

    python -m tests.benchmarks.bots [--games N] [--pairs N] [--out FILE] [--json]

Two experiments, each with fixed seeds; games that are in FILE already are not played again.

1. `dellacherie`: 10x10, uniform pieces, hard drops only, no hold; a placement is legal when all
   four cells lie below row 10, and the game is over when none is. Features as Thiery and Scherrer
   define them, and equals are settled by Dellacherie's own priority (docs/tetris-modes.md, "bots").
2. `pairs`: both bots on the same seeds through the engine's inputs: ten columns and eight rows,
   uniform pieces, five previews, hold, 5,000 pieces at most. About ten minutes.
"""

import json
import math
import statistics
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, Final

from tetris.bots import BOTS, STRONGEST
from tetris.bots.greedy import DELLACHERIE, settled, surface
from tetris.engine.board import empty_bits
from tetris.engine.game import Config
from tetris.engine.moves import landed
from tetris.engine.pieces import COLUMNS, KINDS, SHAPES, Kind, Piece, piece_at
from tetris.history.replay import Recorder, play_bot

from .results import command_line

ROWS: Final = 10  # of the first experiment
PAIRED_ROWS: Final = 8
GAMES: Final = 200
PAIRS: Final = 20
CAP: Final = 5_000  # pieces
EXPECTED: Final = 1_394  # lines, the figure to be found again
FIRST_SEED: Final = 1
PAIRED: Final = Config(rows=PAIRED_ROWS, randomiser="uniform", partial_lock_out=True, gravity=False)
_PRIORITY: Final = 1e-6  # less than any difference between two values


@cache
def _entrances(kind: Kind) -> tuple[tuple[Piece, float], ...]:
    """Return a piece above each column and in each turn, with Dellacherie's priority."""
    found: dict[tuple[int, ...], tuple[Piece, float]] = {}
    for turn in range(4):
        xs = [x for x, _ in SHAPES[kind][turn]]
        width = max(xs) - min(xs) + 1
        middle_x = (COLUMNS - width) // 2
        for left in range(COLUMNS - width + 1):
            piece = piece_at(kind, left - min(xs), ROWS + 2, turn)
            priority = 100 * abs(left - middle_x) + 10 * (left < middle_x) - turn
            lowest = piece.lowest_row
            shape = tuple(sorted((y - lowest) * COLUMNS + x for x, y in piece.cells))
            found.setdefault(shape, (piece, priority * _PRIORITY))
    return tuple(found.values())


def small_game(seed: int) -> int:
    """Return the lines that Dellacherie's player clears in one game of the first experiment."""
    number = Random(seed).random
    worth = surface(DELLACHERIE, COLUMNS, ROWS)
    bits, lines = empty_bits(), 0
    while True:
        best, after, cleared = -math.inf, 0, 0
        for piece, priority in _entrances(KINDS[int(number() * len(KINDS))]):
            landing = landed(bits, piece)
            if landing.highest_row >= ROWS:
                continue
            board, eroded = settled(bits, landing)
            value = eroded - landing.highest_row + worth(board) + priority
            if value > best:
                best, after = value, board
                cleared = (bits.bit_count() + 4 - board.bit_count()) // COLUMNS
        if best == -math.inf:
            return lines
        bits, lines = after, lines + cleared


def paired_game(name: str, seed: int) -> int:
    """Return the lines that a bot clears in one game of the second experiment."""
    recorder = Recorder(seed, PAIRED)
    play_bot(recorder, BOTS[name], pieces=CAP)
    return recorder.game.lines


class Kept:
    """Results by name, kept in a file after every game."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        kept = path is not None and path.exists()
        self.lines: dict[str, int] = json.loads(path.read_text()) if path and kept else {}

    def play(self, experiment: str, seeds: range) -> list[int]:
        """Return the lines of each game, in order; play those that are missing."""
        for seed in seeds:
            name = f"{experiment} {seed}"
            if name not in self.lines:
                small = experiment == "small"
                self.lines[name] = small_game(seed) if small else paired_game(experiment, seed)
                if self._path:
                    self._path.write_text(json.dumps(self.lines, indent=0), encoding="utf-8")
        return [self.lines[f"{experiment} {seed}"] for seed in seeds]


def measure(games: int, pairs: int, kept: Kept) -> dict[str, Any]:
    result: dict[str, Any] = {}
    if games > 1:
        lines = kept.play("small", range(FIRST_SEED, FIRST_SEED + games))
        mean = statistics.mean(lines)
        half = 1.96 * statistics.stdev(lines) / math.sqrt(games)
        result["dellacherie"] = {
            "games": games,
            "lines_mean": round(mean, 1),
            "interval_95": [round(mean - half, 1), round(mean + half, 1)],
            "expected": EXPECTED,
            "contained": abs(mean - EXPECTED) <= half,
        }
    if pairs:
        seeds = range(FIRST_SEED, FIRST_SEED + pairs)
        plain = kept.play("dellacherie", seeds)
        strong = kept.play(STRONGEST, seeds)
        won = sum(more > less for more, less in zip(strong, plain, strict=True))
        result["pairs"] = {
            "pairs": pairs,
            "pieces_at_most": CAP,
            "dellacherie": plain,
            STRONGEST: strong,
            "stronger_clears_more": won,
        }
    return result


def main() -> None:
    parser = command_line(__doc__, games=GAMES, pairs=PAIRS)
    parser.add_argument("--out", type=Path, help="a file that keeps the games, to go on later")
    options = parser.parse_args()
    result = measure(options.games, options.pairs, Kept(options.out))
    if options.json:
        print(json.dumps(result))
        return
    for name, figures in result.items():
        print(name)
        for key, value in figures.items():
            print(f"  {key:22} {value}")


if __name__ == "__main__":
    main()
