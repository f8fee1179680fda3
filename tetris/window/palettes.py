"""The themes: four sets of colours, each with a colour for every piece."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from tetris.engine.pieces import KINDS
from tetris.window import theme
from tetris.window.theme import Colour

DEBRIS: Final = "?"  # the colour of blocks that no piece left, such as those to be dug away


@dataclass(frozen=True, eq=False)
class Palette:
    """The colours of a theme.

    Attributes:
        name: What settings and language files call it.
        background: Behind everything.
        surface: Cards.
        raised: What is chosen or nearest on a card.
        line: Edges of cards and of the well.
        text: What is read.
        dim: What is read second.
        accent: What matters most; grand clears.
        cool: Combos.
        good: A new level, a perfect clear, a best result.
        warn: Back-to-back, and why a game pauses.
        bad: Danger.
        well: The empty board.
        grid: The lines between its cells.
        flash: What a locking piece and a clear light up in.
        pieces: By piece, and `DEBRIS`.
        edge: Around each block, or None.
        bevel: How far the blocks' edges are lit and shaded, 0 (flat) to 1.
        ghost_alpha: How opaque the ghost's outline is, 0 to 255.
    """

    name: str
    background: Colour
    surface: Colour
    raised: Colour
    line: Colour
    text: Colour
    dim: Colour
    accent: Colour
    cool: Colour
    good: Colour
    warn: Colour
    bad: Colour
    well: Colour
    grid: Colour
    flash: Colour
    pieces: Mapping[str, Colour]
    edge: Colour | None = None
    bevel: float = 1.0
    ghost_alpha: int = 170

    @property
    def track(self) -> Colour:
        """The empty part of a bar."""
        return theme.mix(self.line, self.surface, 0.55 if self.edge else 0.1)


def _pieces(*colours: Colour) -> Mapping[str, Colour]:
    """Return colours in the order of `KINDS`, the last one for debris."""
    return MappingProxyType(dict(zip((*KINDS, DEBRIS), colours, strict=True)))


DARK: Final = Palette(
    name="dark",
    background=theme.BACKGROUND,
    surface=theme.SURFACE,
    raised=theme.SURFACE_RAISED,
    line=theme.LINE,
    text=theme.TEXT,
    dim=theme.TEXT_DIM,
    accent=theme.ACCENT,
    cool=theme.ACCENT_COOL,
    good=theme.GOOD,
    warn=theme.WARN,
    bad=theme.BAD,
    well=(16, 20, 30),
    grid=(30, 37, 53),
    flash=theme.WHITE,
    pieces=MappingProxyType({**theme.PIECES, DEBRIS: (112, 120, 140)}),
)

LIGHT: Final = Palette(
    name="light",
    background=(231, 234, 241),
    surface=(246, 247, 251),
    raised=(221, 227, 240),
    line=(190, 197, 213),
    text=(27, 32, 46),
    dim=(88, 97, 120),
    accent=(203, 72, 22),
    cool=(0, 105, 168),
    good=(13, 124, 66),
    warn=(148, 92, 0),
    bad=(196, 38, 55),
    well=(252, 252, 254),
    grid=(230, 233, 241),
    flash=(255, 176, 66),
    pieces=_pieces(
        (20, 172, 196),
        (240, 186, 20),
        (160, 82, 184),
        (98, 172, 62),
        (224, 74, 72),
        (64, 104, 214),
        (245, 136, 36),
        (140, 147, 163),
    ),
    bevel=0.8,
    ghost_alpha=220,
)

CONTRAST: Final = Palette(
    name="contrast",
    background=theme.BLACK,
    surface=theme.BLACK,
    raised=(64, 64, 64),
    line=theme.WHITE,
    text=theme.WHITE,
    dim=(215, 215, 215),
    accent=(255, 221, 0),
    cool=(0, 229, 255),
    good=(64, 255, 96),
    warn=(255, 196, 0),
    bad=(255, 96, 96),
    well=theme.BLACK,
    grid=(52, 52, 52),
    flash=theme.WHITE,
    pieces=_pieces(
        (0, 240, 255),
        (255, 232, 0),
        (232, 96, 255),
        (48, 255, 48),
        (255, 64, 64),
        (96, 128, 255),
        (255, 152, 0),
        (176, 176, 176),
    ),
    edge=theme.WHITE,
    bevel=0.0,
    ghost_alpha=255,
)

# M. Okabe and K. Ito, Color Universal Design (2008), their blue lightened for a dark board.
SAFE: Final = Palette(
    name="safe",
    background=(14, 15, 20),
    surface=(24, 26, 34),
    raised=(42, 46, 60),
    line=(66, 72, 92),
    text=(240, 241, 245),
    dim=(164, 170, 188),
    accent=(240, 228, 66),
    cool=(86, 180, 233),
    good=(86, 180, 233),
    warn=(230, 159, 0),
    bad=(230, 112, 20),
    well=(16, 17, 23),
    grid=(36, 39, 50),
    flash=theme.WHITE,
    pieces=_pieces(
        (110, 200, 250),
        (245, 234, 80),
        (222, 150, 195),
        (0, 158, 115),
        (213, 94, 0),
        (24, 104, 196),
        (240, 172, 20),
        (128, 130, 138),
    ),
)

PALETTES: Final[Mapping[str, Palette]] = MappingProxyType(
    {palette.name: palette for palette in (DARK, LIGHT, CONTRAST, SAFE)}
)
"""By name, in the order of the menu."""
