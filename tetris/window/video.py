"""Export of a replay as a video file, drawn off screen."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pygame

from tetris.engine.game import Phase
from tetris.history.replay import Player, Replay
from tetris.history.video import Picture, Size, VideoError, VideoFile
from tetris.window.theme_choice import ThemeChoice
from tetris.window.view import GameView

SIZE: Final[Size] = (640, 576)  # pixels
GIF_RATE_HZ: Final = 20  # pictures a second
MP4_RATE_HZ: Final = 30
_REST_S: Final = 2.0  # how long the last picture stays
_SAMPLES: Final = 9  # pictures from which a GIF takes its colours
_US: Final = 1_000_000
_STEPS: Final = 2  # pictures a frame of the window, about 10 ms each


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
        VideoError: The kind of file is unknown, or its library is not installed.
        OSError: The file cannot be written.
    """
    rate_hz = GIF_RATE_HZ if path.suffix.lower() == ".gif" else MP4_RATE_HZ
    surface, view = pygame.Surface(size), GameView(pygame.Rect((0, 0), size), look=look)
    sample = _sample(replay, surface, view)
    player = Player(replay)
    view = GameView(pygame.Rect((0, 0), size), look=look)
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


class VideoExport:
    """Export beside the window: a few pictures with every frame.

    Attributes:
        path: Its file.
        share: How much of it is done, 0 to 1.
        trouble: A sentence if it cannot be made, "" when all is well.
    """

    def __init__(self, replay: Replay, path: Path, look: ThemeChoice) -> None:
        """Begin a film of a replay."""
        self.path, self.share, self.trouble = path, 0.0, ""
        self._steps: Iterator[float] | None = export(replay, path, look=look)

    @property
    def going_on(self) -> bool:
        """Whether there is more to do."""
        return self._steps is not None

    def step(self) -> None:
        """Go on a little."""
        try:
            if self.share == 0:
                self.path.parent.mkdir(parents=True, exist_ok=True)
            for _ in range(_STEPS):
                if self._steps is not None:
                    self.share = next(self._steps)
        except StopIteration:
            self.share, self._steps = 1.0, None
        except (VideoError, OSError) as error:
            self.trouble, self._steps = str(error), None
