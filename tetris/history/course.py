"""Course of a game: how its score or its lines grew over the time played, from its replay."""

from typing import Final, Literal

from tetris.history.replay import Player, Replay

Course = tuple[tuple[float, float], ...]

_STEPS: Final = 60
_MOST_MOMENTS: Final = 20_000  # of a replay; playing more would make the window wait


def course(replay: Replay, figure: Literal["score", "lines"]) -> Course:
    """Return points (seconds played, figure), from the start to the end; none of a huge replay."""
    if len(replay.moments) > _MOST_MOMENTS:
        return ()
    player = Player(replay)
    points = [(0.0, 0.0)]
    for step in range(1, _STEPS + 1):
        player.advance(player.start_s + player.duration_s * step / _STEPS)
        points.append((player.game.time_s, float(getattr(player.game, figure))))
    return tuple(points)
