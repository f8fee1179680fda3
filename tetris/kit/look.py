"""Look of the window: the chosen theme and language, and what is shown."""

from dataclasses import dataclass, field

from tetris.kit import language
from tetris.kit.language import Words
from tetris.kit.settings import Settings
from tetris.kit.theme import DARK, PALETTES, Palette


@dataclass(frozen=True, eq=False)
class Look:
    """Palette and words that every picture is drawn with, and what is shown."""

    palette: Palette = DARK
    words: Words = field(default_factory=lambda: language.load(language.FALLBACK))
    patterns: bool = False
    motion: bool = True
    ghost: bool = True
    grid: bool = True
    scale: float = 1.0  # of letters beside the board

    @classmethod
    def chosen(cls, settings: Settings) -> "Look":
        """Return the look that the settings ask for; an unknown theme is the first."""
        return cls(
            PALETTES.get(settings.theme, DARK),
            language.load(settings.language or language.of_system()),
            patterns=settings.patterns,
            motion=settings.motion,
            ghost=settings.ghost,
            grid=settings.grid,
            scale=settings.scale / 100,
        )
