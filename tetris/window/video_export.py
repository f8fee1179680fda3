"""A film that is made while other things go on: a few pictures with every frame."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tetris.history.replay import Replay
from tetris.history.video import VideoError
from tetris.window.theme_choice import ThemeChoice
from tetris.window.video import export

_STEPS: Final = 2  # pictures a frame, about 10 ms each


class VideoExport:
    """One film.

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
