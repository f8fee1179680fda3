"""A replay as a film: the game's own pictures, drawn where nobody sees them."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pygame

from tetris.engine.game import Phase
from tetris.history.replay import Player, Replay
from tetris.history.video import Picture, Size, VideoFile
from tetris.window.theme_choice import ThemeChoice
from tetris.window.view import GameView

SIZE: Final[Size] = (640, 576)  # pixels
GIF_RATE_HZ: Final = 20  # pictures a second
MP4_RATE_HZ: Final = 30
_REST_S: Final = 2.0  # how long the last picture stays
_SAMPLES: Final = 9  # pictures from which a GIF takes its colours
_US: Final = 1_000_000


def export(
    replay: Replay,
    path: Path,
    *,
    size: Size = SIZE,
    speed: float = 1.0,
    look: ThemeChoice | None = None,
) -> Iterator[float]:
    """Save a replay as a film, and yield the share that is done, 0 to 1, picture by picture.

    Pauses are left out. Stop asking, and there is no film.

    Args:
        replay: What to show.
        path: The film's file, `.gif` or `.mp4`.
        size: Of the pictures, even numbers.
        speed: How many times faster than it was played.
        look: Colours, language and the like.

    Raises:
        FilmError: The kind of file is unknown, or its library is not installed.
        OSError: The file cannot be written.
    """
    rate_hz = GIF_RATE_HZ if path.suffix.lower() == ".gif" else MP4_RATE_HZ
    surface, view = pygame.Surface(size), GameView(pygame.Rect((0, 0), size), hints={}, look=look)
    sample = _sample(replay, surface, view)
    player = Player(replay)
    view = GameView(pygame.Rect((0, 0), size), hints={}, look=look)
    view.show(player.first_events)
    end_s = player.end_s + _REST_S * speed
    time_s = player.start_s
    with VideoFile(path, size, rate_hz, sample) as film:
        while time_s <= end_s:
            view.show(player.advance(time_s))
            if player.game.phase is Phase.PAUSED and not player.at_end:
                time_s = max(time_s, _next_s(player))
                view.show(player.advance(time_s))
            film.add(_drawn(surface, view, player, time_s))
            yield min(1.0, (time_s - player.start_s) / (end_s - player.start_s))
            time_s += speed / rate_hz


def unseen() -> None:
    """Prepare pygame for drawing in a program that opens no window."""
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    pygame.display.init()
    pygame.font.init()
    pygame.display.set_mode((1, 1))


def _next_s(player: Player) -> float:
    """Return the time of the replay's next moment, or of its end."""
    moments = player.replay.moments
    if player.moments_played < len(moments):
        return moments[player.moments_played].time_us / _US
    return player.end_s


def _sample(replay: Replay, surface: pygame.Surface, view: GameView) -> list[Picture]:
    """Return pictures from all over the replay."""
    player = Player(replay)
    pictures = []
    for number in range(_SAMPLES):
        time_s = player.start_s + player.duration_s * (number + 0.5) / _SAMPLES
        view.show(player.advance(time_s))
        pictures.append(_drawn(surface, view, player, time_s))
    return pictures


def _drawn(surface: pygame.Surface, view: GameView, player: Player, time_s: float) -> Picture:
    view.draw(surface, player.game, time_s)
    return pygame.image.tobytes(surface, "RGB")
