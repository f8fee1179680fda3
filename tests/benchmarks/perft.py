"""Count the boards that a queue of pieces can lead to, depth by depth.

`tests.reference.tetris_perft` has the convention.

    python -m tests.benchmarks.perft [--queue IOLJSZT] [--depth N] [--kicks srs|srs+] [--json]

`ways` counts sequences of placements, `boards` the different boards that they end in. A piece
alone on the empty board has a number of placements that is known from drawing them by hand: the
columns that each of its turns leaves free. Deeper counts depend on the convention, above all on
kicks and on what counts as one placement: compare them with those of another generator only where
it says the same of both.
"""

import argparse
import json
import time
from typing import Final, get_args

from tests.reference.tetris_perft import boards, leaves
from tetris.engine.pieces import KINDS, Kicks, Kind

from .results import command_line

ALONE: Final[dict[Kind, int]] = {  # 7 + 10, 9, 8 + 9 (S, Z), 2 * (8 + 9)
    "I": 17,
    "O": 9,
    "T": 34,
    "S": 17,
    "Z": 17,
    "J": 34,
    "L": 34,
}


def queue_of(letters: str) -> list[Kind]:
    """Read a queue such as IOLJSZT."""
    kinds = [kind for letter in letters for kind in KINDS if kind == letter]
    if len(kinds) != len(letters) or not kinds:
        raise argparse.ArgumentTypeError(f"{letters!r} must be letters of {''.join(KINDS)}")
    return kinds


def main() -> None:
    """Count and print."""
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
