"""The figures beside the board: which ones a game shows, and how they are written."""

from dataclasses import dataclass

from tetris.engine.game import Game
from tetris.engine.scoring import goal_of


@dataclass(frozen=True, slots=True)
class Figure:
    """One number beside the board.

    Attributes:
        key: The key of its label in the language files.
        value: How it is written.
        share: How much of a bar below it is filled, 0 to 1; None draws no bar.
    """

    key: str
    value: str
    share: float | None = None


def figures_of(
    game: Game, *, by_time: bool = False, pieces_per_s: float | None = None
) -> list[Figure]:
    """Return what matters most in a game first; at most five figures.

    Args:
        game: The game as it is now.
        by_time: Whether the game is a race to its goal.
        pieces_per_s: How quick the player is, where it is measured.
    """
    config = game.config
    first: list[Figure]
    if config.time_limit_s is not None:
        left_s = max(0.0, config.time_limit_s - game.time_s)
        first = [
            Figure("figures.time_left", clock(left_s), left_s / config.time_limit_s),
            Figure("figures.score", f"{game.score:,}"),
            Figure("figures.lines", f"{game.lines:,}"),
        ]
    elif config.dig:
        first = [
            Figure("figures.time", clock(game.time_s)),
            Figure("figures.garbage", f"{game.garbage_rows:,}"),
            Figure("figures.lines", f"{game.lines:,}"),
        ]
    elif by_time and config.lines_goal is not None:
        first = [
            Figure("figures.time", clock(game.time_s)),
            _lines_left(game, config.lines_goal),
        ]
    else:
        goal = config.lines_goal
        lines = Figure("figures.lines", f"{game.lines:,}")
        first = [
            Figure("figures.score", f"{game.score:,}"),
            Figure("figures.level", f"{game.level:,}", _share_of_level(game)),
            lines if goal is None else _lines_left(game, goal),
        ]
    first.append(Figure("figures.pieces", f"{game.pieces_placed:,}"))
    if pieces_per_s is not None:
        first.append(Figure("figures.pieces_per_s", f"{pieces_per_s:.2f}"))
    return first


def _lines_left(game: Game, goal: int) -> Figure:
    return Figure(
        "figures.lines_left", f"{max(0, goal - game.lines):,}", min(1.0, game.lines / goal)
    )


def _share_of_level(game: Game) -> float:
    first, goal = goal_of(game.level, game.config.start_level)
    return (game.lines - first) / (goal - first)


def clock(seconds: float) -> str:
    """Write seconds as minutes, seconds and hundredths: 1:05.20."""
    hundredths = int(seconds * 100 + 1e-6)
    minutes, rest = divmod(hundredths, 6000)
    return f"{minutes}:{rest // 100:02}.{rest % 100:02}"
