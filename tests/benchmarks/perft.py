"""Count the boards that a queue of pieces can lead to, to compare generators of placements.

    python -m tests.benchmarks.perft [--queue IOLJSZT] [--depth N] [--kicks srs|srs+] [--json]

`ways` counts sequences of placements, `boards` the different boards that they end in. The
convention: the empty board of ten columns, no hold; each piece enters as in the game, in rows 20
and 21 and at once a row down where that is free, moves by shifts, falls and turns with kicks, and
locks; full rows are taken away. A placement counts once for the cells that it fills, however it was
reached, in whichever turn, and with or without a spin. A game that is lost ends its count. How many
placements a piece alone has is known from drawing them by hand.
"""

import argparse
import json
import time
from collections.abc import Iterable, Iterator
from typing import Final, get_args

from tetris.bots.greedy import settled
from tetris.bots.placements import find
from tetris.engine.board import EMPTY_BITS
from tetris.engine.moves import entered
from tetris.engine.pieces import KINDS, Kicks, Kind, Piece

from .results import command_line

# 7 + 10, 9, 8 + 9 (S, Z), 2 * (8 + 9)
ALONE: Final[dict[Kind, int]] = {"I": 17, "O": 9, "T": 34, "S": 17, "Z": 17, "J": 34, "L": 34}
_MANY: Final = 100_000  # boards before the last piece
_PASSES: Final = 7


def leaves(queue: Iterable[Kind], kicks: Kicks = "srs", bits: int = EMPTY_BITS) -> int:
    """Return the number of ways to place the pieces in this order."""
    kinds = list(queue)
    if not kinds:
        return 1
    kind, *others = kinds
    piece = entered(bits, Piece.entering(kind))
    if piece is None:
        return 0
    places = find(bits, piece, kicks)
    if not others:
        return len(places)
    return sum(leaves(others, kicks, after) for after in _after(bits, places))


def boards(queue: Iterable[Kind], kicks: Kicks = "srs", bits: int = EMPTY_BITS) -> int:
    """Return the number of different boards that the ways end in."""
    *kinds, last = queue
    reached = {bits}
    for kind in kinds:
        reached = set(_grown(reached, kind, kicks))
    if len(reached) < _MANY:
        return len(set(_grown(reached, last, kicks)))
    # The last boards are too many for the memory: each pass keeps those of one remainder.
    return sum(
        len({after for after in _grown(reached, last, kicks) if after % _PASSES == remainder})
        for remainder in range(_PASSES)
    )


def _grown(reached: set[int], kind: Kind, kicks: Kicks) -> Iterator[int]:
    entering = Piece.entering(kind)
    for bits in reached:
        if piece := entered(bits, entering):
            yield from _after(bits, find(bits, piece, kicks))


def _after(bits: int, places: list[Piece]) -> Iterator[int]:
    return (settled(bits, piece)[0] for piece in places)


def queue_of(letters: str) -> list[Kind]:
    """Read a queue such as IOLJSZT."""
    kinds = [kind for letter in letters for kind in KINDS if kind == letter]
    if len(kinds) != len(letters) or not kinds:
        raise argparse.ArgumentTypeError(f"{letters!r} must be letters of {''.join(KINDS)}")
    return kinds


def main() -> None:
    parser = command_line(__doc__, depth=5)
    parser.add_argument("--queue", type=queue_of, default="IOLJSZT", metavar="PIECES")
    parser.add_argument("--kicks", choices=get_args(Kicks), default="srs")
    arguments = parser.parse_args()
    queue: list[Kind] = arguments.queue
    alone = {kind: leaves([kind], arguments.kicks) for kind in KINDS}
    verdict = "as known" if alone == ALONE else f"NOT as known: {ALONE}"
    print("alone  " + "  ".join(f"{kind} {count}" for kind, count in alone.items()), verdict)
    print(f"{'queue':8} {'ways':>12} {'boards':>12} {'s':>7}")
    results = []
    for depth in range(1, min(arguments.depth, len(queue)) + 1):
        start_s = time.process_time()
        part = queue[:depth]
        ways, ends = leaves(part, arguments.kicks), boards(part, arguments.kicks)
        spent_s = time.process_time() - start_s
        print(f"{''.join(part):8} {ways:12,} {ends:12,} {spent_s:7.2f}")
        results.append({"queue": "".join(part), "ways": ways, "boards": ends})
    if arguments.json:
        print(json.dumps({"benchmark": "perft", "alone": alone, "results": results}))


if __name__ == "__main__":
    main()
