"""Look of the window: the chosen theme and language, and the settings of what is shown."""

from typing import Final

from tetris.kit import language
from tetris.kit.settings import Settings
from tetris.kit.theme import PALETTES

_PLAIN: Final = Settings(language=language.FALLBACK)


class Look:
    """Palette and words that every picture is drawn with, and the settings that chose them."""

    def __init__(self, settings: Settings = _PLAIN) -> None:
        self.settings = settings
        self.palette = PALETTES[settings.theme]
        self.words = language.load(settings.language or language.of_system())

    @property
    def scale(self) -> float:
        """Size of letters beside the board, 1.0 the one that suits the cells."""
        return self.settings.scale / 100
