"""Orb marathons of simulated hands: whether they end, and in which order of results.

    python -m tests.benchmarks.modes [--hands 32] [--minutes 10] [--seed N] [--json]

A hand gives one to three commands a second, at intervals that vary by a quarter, and pauses before
each piece. Every second hand gives one command in twenty at random in place of the one it meant.
The greedy bot says what each means; time is virtual. The rank correlation is Spearman's, of
the commands a second with the pace that was reached.
"""

import statistics
from random import Random
from typing import Final

from tetris.bots import greedy
from tetris.bots.greedy import Plan
from tetris.engine.game import Action, Phase
from tetris.engine.modes import MODES, pace_of
from tetris.kit.settings import Settings
from tetris.window.game_session import Session

from .results import Results, command_line

RATES_HZ: Final = (1.0, 3.0)
SLIPS: Final = 0.05  # of every second hand
LOOK_S: Final = (0.15, 0.45)  # before the first command of a piece
SPREAD: Final = 0.25  # of the logarithm of an interval
GIVEN: Final = (
    Action.LEFT, Action.RIGHT, Action.ROTATE_CW, Action.ROTATE_CCW, Action.HARD_DROP, Action.HOLD
)  # fmt: skip


def play(mode: str, rate_hz: float, slips: float, seed: int, limit_s: float) -> Session:
    """Return the session of one hand, at its end or at the limit."""
    draw, session = Random(seed), Session.new(MODES[mode], seed, Settings())
    game, now_s, placed = session.game, 0.0, -1
    plan: Plan | None = None
    session.update(now_s)
    while game.phase is Phase.RUNNING and now_s < limit_s:
        if game.pieces_placed != placed:
            placed, plan = game.pieces_placed, None
            now_s += draw.uniform(*LOOK_S)
        else:
            plan = greedy.plan(game, target=plan.landing if plan else None)
            action = draw.choice(GIVEN) if draw.random() < slips else plan.actions[0]
            session.update(now_s, [action], commands=1)
            now_s += draw.lognormvariate(0.0, SPREAD) / rate_hz
        session.update(now_s)
    return session


def ranks(values: list[float]) -> list[float]:
    """Return the place of each value among all, the mean of their places for equal ones."""
    return [sum(other < value for other in values) + values.count(value) / 2 for value in values]


def main() -> None:
    parser = command_line(__doc__, hands=32, minutes=10.0, seed=0)
    arguments = parser.parse_args()
    hands, limit_s = arguments.hands, 60.0 * arguments.minutes
    least_hz, most_hz = RATES_HZ
    rates_hz = [
        least_hz + (most_hz - least_hz) * (number // 2) / max(1, (hands - 1) // 2)
        for number in range(hands)
    ]
    played = [
        play("orb_marathon", rate_hz, SLIPS * (number % 2), arguments.seed + number, limit_s)
        for number, rate_hz in enumerate(rates_hz)
    ]
    results = Results("modes")
    ended = sum(session.game.phase is Phase.OVER for session in played)
    results.note("ended", ended, f"of {hands}", goal=float(hands - 1))
    paces_hz = [pace_of(session.game.row_us) for session in played]
    order = statistics.correlation(ranks(rates_hz), ranks(paces_hz))
    results.note("rank_correlation", order, goal=0.9)
    shares = [pace_hz / rate_hz for pace_hz, rate_hz in zip(paces_hz, rates_hz, strict=True)]
    results.spread("pace_to_rate", shares, "")
    results.spread("minutes", [session.game.time_s / 60 for session in played], "min")
    results.spread("lines", [float(session.game.lines) for session in played], "")
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
