"""Lines of both bots on the same seeds, through the engine's inputs.

    python -m tests.benchmarks.bots [--pairs N] [--json]

Ten columns and eight rows, uniform pieces, five previews, hold, 5,000 pieces at most. About ten
minutes.
"""

from typing import Final

from tetris.bots import BOTS, STRONGEST
from tetris.engine.game import Config
from tetris.history.replay import Recorder, play_bot

from .results import Results, command_line, say

RULES: Final = Config(rows=8, randomiser="uniform", partial_lock_out=True, gravity=False)
PIECES: Final = 5_000
PLAIN: Final = "dellacherie"


def lines_cleared(bot: str, seed: int) -> int:
    """Return the lines that a bot clears in one game."""
    recorder = Recorder(seed, RULES)
    play_bot(recorder, BOTS[bot], pieces=PIECES)
    return recorder.game.lines


def main() -> None:
    """Play the pairs, and count on how many seeds the stronger bot clears more."""
    options, results = command_line(__doc__, pairs=20).parse_args(), Results("bots")
    pairs = []
    for seed in range(1, options.pairs + 1):
        pairs.append((lines_cleared(PLAIN, seed), lines_cleared(STRONGEST, seed)))
        say(f"seed {seed}: {PLAIN} {pairs[-1][0]}, {STRONGEST} {pairs[-1][1]} lines")
    results.spread(f"lines@{PLAIN}", [plain for plain, _ in pairs], "lines")
    results.spread(f"lines@{STRONGEST}", [strong for _, strong in pairs], "lines")
    won = sum(strong > plain for plain, strong in pairs)
    results.note("stronger_clears_more", won, f"of {len(pairs)}", goal=len(pairs))
    results.finish(options.json)


if __name__ == "__main__":
    main()
