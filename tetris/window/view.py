"""A game drawn into a rectangle of a surface."""

from collections.abc import Iterable, Mapping
from typing import Final

import pygame

from tetris.board import EMPTY
from tetris.engine import Game, Phase
from tetris.events import Event
from tetris.pieces import COLUMNS, VISIBLE_ROWS, Kind
from tetris.scoring import goal_of
from tetris.window import theme, tiles
from tetris.window.effects import Effects
from tetris.window.layout import Layout

KEYBOARD_HINTS: Final[Mapping[Phase, str]] = {
    Phase.PAUSED: "P to go on",
    Phase.OVER: "R to play again",
}
_TITLES: Final[Mapping[Phase, str]] = {Phase.PAUSED: "PAUSED", Phase.OVER: "GAME OVER"}
_WELL: Final = (16, 20, 30)
_GRID: Final = (30, 37, 53)
_VEIL_ALPHA: Final = 205  # over the board when time does not pass
_HEADROOM_ROWS: Final = 1  # drawn above the board, for a piece that is just entering


class GameView:
    """Draws a game: the board, what is held and what comes, the score, and what happened.

    Attributes:
        layout: Where everything is, in pixels of the surface.
    """

    def __init__(self, area: pygame.Rect, *, hints: Mapping[Phase, str] = KEYBOARD_HINTS) -> None:
        """Draw into an area; hints say what to do when the game pauses or is over."""
        self._hints = hints
        self._effects = Effects()
        self.resize(area)

    def resize(self, area: pygame.Rect) -> None:
        """Draw into another area from now on."""
        self.layout = Layout.inside(area)
        self._effects.clear()  # their pictures have the old size
        self._scenery = self._draw_scenery()
        self._veil = pygame.Surface(self.layout.board.size)
        self._veil.fill(theme.BACKGROUND)
        self._veil.set_alpha(_VEIL_ALPHA)

    def show(self, events: Iterable[Event]) -> None:
        """Let what happened be seen in the next frames."""
        self._effects.show(events, self.layout.cell)

    def draw(self, surface: pygame.Surface, game: Game, time_s: float, *, reason: str = "") -> None:
        """Draw everything.

        Args:
            surface: Where to; the area lies inside.
            game: The game as it is now; it is not changed.
            time_s: The time of the game's last update, by the same clock.
            reason: Why the game pauses, such as "orb lost, reconnecting".
        """
        surface.blit(self._scenery, self.layout.area)
        self._draw_blocks(surface, game)
        self._effects.draw(surface, self.layout, time_s)
        if game.phase is not Phase.RUNNING:
            self._draw_veil(surface, game, reason)
        self._draw_hold(surface, game)
        self._draw_next(surface, game)
        self._draw_stats(surface, game)

    # -- the board ---------------------------------------------------------------------

    def _draw_blocks(self, surface: pygame.Surface, game: Game) -> None:
        cell, at = self.layout.cell, self.layout.at
        top = VISIBLE_ROWS + (_HEADROOM_ROWS if game.phase is Phase.RUNNING else 0)
        blits = [
            (tiles.mino(_kind(mark), cell), at(x, y))
            for y, row in enumerate(game.board.rows[:top])
            for x, mark in enumerate(row)
            if mark != EMPTY
        ]
        piece = game.piece
        if game.phase is not Phase.OVER:
            fall = piece.y - game.ghost_y
            shade = tiles.ghost(piece.kind, cell)
            blits += [(shade, at(x, y - fall)) for x, y in piece.cells if fall and y - fall < top]
        body = tiles.mino(piece.kind, cell)
        blits += [(body, at(x, y)) for x, y in piece.cells if y < top]
        surface.fblits(blits)

    def _draw_veil(self, surface: pygame.Surface, game: Game, reason: str) -> None:
        board, cell = self.layout.board, self.layout.cell
        surface.blit(self._veil, board)
        lines = [(_TITLES[game.phase], cell * 1.5, theme.TEXT)]
        if reason:
            lines.append((reason, cell * 0.72, theme.WARN))
        elif game.phase is Phase.OVER:
            lines.append((f"{game.score:,} points", cell * 0.85, theme.ACCENT))
        if hint := self._hints.get(game.phase):
            lines.append((hint, cell * 0.68, theme.TEXT_DIM))
        middle = board.top + round(8.6 * cell)
        band = pygame.Rect(0, 0, board.width, round((len(lines) * 1.35 + 0.9) * cell))
        band.midtop = board.centerx, middle - round(1.2 * cell)
        surface.fill(theme.BACKGROUND, band)
        surface.fill(theme.LINE, (band.left, band.top, band.width, 1))
        surface.fill(theme.LINE, (band.left, band.bottom - 1, band.width, 1))
        for words, size, colour in lines:
            picture = _fitted(words, round(size), colour, board.width - cell)
            surface.blit(picture, picture.get_rect(center=(board.centerx, middle)))
            middle += round(1.35 * cell)

    # -- beside it ---------------------------------------------------------------------

    def _draw_hold(self, surface: pygame.Surface, game: Game) -> None:
        if game.hold:
            card = self.layout.hold
            picture = tiles.preview(game.hold, self._small, dim=not game.can_hold)
            centre = (card.centerx, card.top + round(2.65 * self.layout.cell))
            surface.blit(picture, picture.get_rect(center=centre))

    def _draw_next(self, surface: pygame.Surface, game: Game) -> None:
        card = self.layout.next
        for place, kind in enumerate(game.next[:5]):
            picture = tiles.preview(kind, self._small)
            centre = card.centerx, self._slot(place)
            surface.blit(picture, picture.get_rect(center=centre))

    def _slot(self, place: int) -> int:
        """The y of the middle of a next piece."""
        return self.layout.next.top + round((2.65 + 2.75 * place) * self.layout.cell)

    @property
    def _small(self) -> int:
        """The side of a block beside the board."""
        return max(4, round(self.layout.cell * 0.82))

    def _draw_stats(self, surface: pygame.Surface, game: Game) -> None:
        card, cell = self.layout.stats, self.layout.cell
        left = card.left + round(0.6 * cell)
        widest = card.width - round(1.2 * cell)
        numbers = (game.score, game.level, game.lines, game.pieces_placed)
        for row, number in enumerate(numbers):
            size = round(cell * (1.25 if row == 0 else 1.05))
            picture = _fitted(f"{number:,}", size, theme.TEXT, widest)
            bottom = card.top + round(_STAT_BASE[row] * cell)
            surface.blit(picture, picture.get_rect(bottomleft=(left, bottom)))
        self._draw_progress(surface, game)
        chips = []
        if game.streak.b2b:
            chips.append(("BACK-TO-BACK", theme.WARN))
        if game.streak.combo > 1:
            chips.append((f"COMBO ×{game.streak.combo - 1}", theme.ACCENT_COOL))
        for row, (words, colour) in enumerate(chips):
            picture = _fitted(words, round(cell * 0.56), colour, widest)
            bottom = card.bottom - round((0.5 + 0.85 * row) * cell)
            surface.blit(picture, picture.get_rect(bottomleft=(left, bottom)))

    def _draw_progress(self, surface: pygame.Surface, game: Game) -> None:
        """Draw how far the next level is."""
        first, goal = goal_of(game.level, game.config.start_level)
        share = (game.lines - first) / (goal - first)
        bar = self._progress
        if share > 0:
            filled = pygame.Rect(
                bar.left, bar.top, max(bar.height, round(bar.width * share)), bar.height
            )
            pygame.draw.rect(surface, theme.ACCENT, filled, border_radius=bar.height // 2)

    @property
    def _progress(self) -> pygame.Rect:
        card, cell = self.layout.stats, self.layout.cell
        inset = round(0.6 * cell)
        top = card.top + round((_STAT_BASE[1] + 0.12) * cell)
        return pygame.Rect(
            card.left + inset, top, card.width - 2 * inset, max(2, round(0.14 * cell))
        )

    # -- what never changes ------------------------------------------------------------

    def _draw_scenery(self) -> pygame.Surface:
        """Return the background: cards, headings, the empty well with its grid."""
        area, cell, board = self.layout.area, self.layout.cell, self.layout.board
        scenery = pygame.Surface(area.size)
        scenery.fill(theme.BACKGROUND)
        here = -area.left, -area.top
        self._draw_well(scenery, board.move(here))
        for card, heading in ((self.layout.hold, "HOLD"), (self.layout.next, "NEXT")):
            place = card.move(here)
            _draw_card(scenery, place, cell)
            words = theme.text(heading, round(cell * 0.6), theme.TEXT_DIM)
            scenery.blit(words, (place.left + round(0.6 * cell), place.top + round(0.5 * cell)))
        nearest = self.layout.next.inflate(-round(0.7 * cell), 0)
        nearest.height = round(2.5 * cell)
        nearest.center = self.layout.next.centerx - area.left, self._slot(0) - area.top
        pygame.draw.rect(scenery, theme.SURFACE_RAISED, nearest, border_radius=cell // 3)
        stats = self.layout.stats.move(here)
        _draw_card(scenery, stats, cell)
        for row, label in enumerate(("SCORE", "LEVEL", "LINES", "PIECES")):
            words = theme.text(label, round(cell * 0.6), theme.TEXT_DIM)
            bottom = stats.top + round((_STAT_BASE[row] - 1.25) * cell)
            scenery.blit(words, words.get_rect(bottomleft=(stats.left + round(0.6 * cell), bottom)))
        bar = self._progress.move(here)
        pygame.draw.rect(scenery, theme.LINE, bar, border_radius=bar.height // 2)
        return scenery

    def _draw_well(self, scenery: pygame.Surface, well: pygame.Rect) -> None:
        cell = self.layout.cell
        frame = max(2, cell // 12)
        pygame.draw.rect(
            scenery, theme.LINE, well.inflate(2 * frame, 2 * frame), border_radius=cell // 5
        )
        scenery.fill(_WELL, well)
        for x in range(1, COLUMNS):
            pygame.draw.line(
                scenery,
                _GRID,
                (well.left + x * cell, well.top),
                (well.left + x * cell, well.bottom - 1),
            )
        for y in range(1, VISIBLE_ROWS):
            pygame.draw.line(
                scenery,
                _GRID,
                (well.left, well.top + y * cell),
                (well.right - 1, well.top + y * cell),
            )


_STAT_BASE: Final = (2.75, 5.35, 8.3, 10.9)  # the lower edge of each number in its card, in cells


def _kind(mark: str) -> Kind:
    """Read a mark of the board, which is a kind wherever it is not empty."""
    return mark  # type: ignore[return-value]


def _draw_card(scenery: pygame.Surface, card: pygame.Rect, cell: int) -> None:
    pygame.draw.rect(scenery, theme.SURFACE, card, border_radius=cell // 3)
    pygame.draw.rect(scenery, theme.LINE, card, 1, border_radius=cell // 3)


def _fitted(words: str, size: int, colour: theme.Colour, widest: int) -> pygame.Surface:
    """Return words as a picture, smaller where they would be too wide."""
    picture = theme.text(words, size, colour)
    if picture.get_width() > widest:
        picture = theme.text(words, int(size * widest / picture.get_width()), colour)
    return picture
