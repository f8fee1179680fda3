"""Lines cleared by the demo's player, by the value that it subtracts for a command.

    python -m tests.benchmarks.command_cost [--games 40] [--minutes 6] [--seconds .88]

The player of `host --demo` plays without an orb: each command takes as long as one takes the orb's
hand in the played games of docs/figures/games.json, and none goes wrong.
"""

import statistics
from itertools import pairwise
from typing import Final

from host.demo import autoplayer
from host.demo.autoplayer import LOOK_S

from . import stored
from .played_games import keyboard
from .results import Results, command_line, say

COSTS: Final = (0.0, 0.3, 0.5, 0.7, 1.0, 1.4, 2.0)
SEED: Final = 700
SIGMAS: Final = 1.96


def lines_cleared(seed: int, seconds: float, hand_s: float) -> int:
    """Return the lines of one game of the player whose gestures last so long."""
    seen: list[int] = [0]
    keyboard(seed, seconds, hand_s, seen.append)
    return sum(max(0, after - before) for before, after in pairwise(seen))


def command_s() -> float:
    """Return the seconds of a command in the stored games on `nominal`, with the pause."""
    games = stored.load("games")
    if games is None:
        raise SystemExit("games.json is missing; run: python -m tests.benchmarks.docs --only games")
    rows = games.results["results"]
    found = [row for row in rows if (row["name"], row["preset"]) == ("command", "nominal")]
    return float(found[0]["value"])


def main() -> None:
    parser = command_line(__doc__, games=40, minutes=6.0, seconds=0.0)
    arguments = parser.parse_args()
    hand_s = (arguments.seconds or command_s()) - statistics.fmean(LOOK_S)
    results = Results("command_cost")
    for cost in COSTS:
        autoplayer.COMMAND_COST = cost  # type: ignore[misc]
        found = [
            lines_cleared(SEED + number, 60.0 * arguments.minutes, hand_s)
            for number in range(arguments.games)
        ]
        mean = statistics.fmean(found)
        half = SIGMAS * statistics.stdev(found) / len(found) ** 0.5
        results.note(f"lines_at_{cost:g}", mean, "lines", cost=cost, low=mean - half,
                     high=mean + half)  # fmt: skip
        say(f"{cost:g}: {mean:.1f} lines")
    results.finish(arguments.json, hand_s=hand_s)


if __name__ == "__main__":
    main()
