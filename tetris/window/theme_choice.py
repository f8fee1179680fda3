"""The chosen look of the game: a theme, and what of it is shown."""

from dataclasses import dataclass, field

from tetris.window import language
from tetris.window.language import Words
from tetris.window.palettes import DARK, PALETTES, Palette
from tetris.window.settings import Settings
from tetris.window.tiles import Tiles


@dataclass(frozen=True, eq=False)
class ThemeChoice:
    """Palette, blocks and words that every picture is drawn with.

    Attributes:
        palette: The colours.
        tiles: The blocks, in these colours.
        words: The language.
        motion: Whether things move that need not.
        ghost: Whether one sees where the piece would land.
        grid: Whether the empty cells are outlined.
    """

    palette: Palette = DARK
    tiles: Tiles = field(default_factory=lambda: Tiles(DARK))
    words: Words = field(default_factory=lambda: language.load(language.FALLBACK))
    motion: bool = True
    ghost: bool = True
    grid: bool = True

    @classmethod
    def chosen(cls, settings: Settings) -> "ThemeChoice":
        """Return the look that the settings ask for; an unknown theme is the first."""
        palette = PALETTES.get(settings.theme, DARK)
        return cls(
            palette,
            Tiles(palette, patterns=settings.patterns),
            language.load(settings.language or language.of_system()),
            motion=settings.motion,
            ghost=settings.ghost,
            grid=settings.grid,
        )
