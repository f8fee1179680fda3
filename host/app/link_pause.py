"""The pause of a game while the orb is away."""

from tetris.kit.menu import MenuStep
from tetris.kit.stage import Screen, Stage
from tetris.window.screens.play_screen import PlayScreen


class LinkPause:
    """Pauses a game played by hand when the link is lost, and ends that pause with it."""

    def __init__(self) -> None:
        self._paused: Screen | None = None  # the menu of the pause

    def begin(self, stage: Stage, *, silent: bool) -> None:
        """Pause a game that is being played; `silent` if the link is open, but nothing comes."""
        screen = stage.screen
        if self._paused is None and isinstance(screen, PlayScreen) and screen.by_hand:
            screen.pause(stage.look.words("orb.silent" if silent else "orb.lost"))
            if stage.screen is not screen:
                self._paused = stage.screen

    def end(self, stage: Stage, now_s: float) -> None:
        """End the pause that the link made; one that the player made stays."""
        paused, self._paused = self._paused, None
        if paused is not None and stage.screen is paused:
            paused.nav(MenuStep.BACK, now_s)
