"""Themes: sets of colours, each with a colour for every piece; all but the dark one from a file."""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Final

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


def _load() -> Iterator[Palette]:
    """Yield the themes of the colour file."""
    file = files("assets") / "tetris" / "palettes.toml"
    for name, table in tomllib.loads(file.read_text("utf-8")).items():
        pieces = zip((*KINDS, DEBRIS), map(tuple, table.pop("pieces")), strict=True)
        values: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in table.items()
        }
        yield Palette(name=name, pieces=MappingProxyType(dict(pieces)), **values)


PALETTES: Final[Mapping[str, Palette]] = MappingProxyType(
    {palette.name: palette for palette in (DARK, *_load())}
)
"""By name, in the order of the menu."""
