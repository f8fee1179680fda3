"""Drawing of a game into a rectangle of a surface, and the figures beside its board."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import pygame

from tetris.bots.greedy import Plan
from tetris.engine.board import EMPTY
from tetris.engine.events import Action, Event
from tetris.engine.game import Finish, Game, Phase, TopOut
from tetris.engine.modes import PACE_LINES, pace_of
from tetris.engine.pieces import Piece
from tetris.engine.scoring import goal_of
from tetris.kit import theme
from tetris.kit.settings import Look
from tetris.window.effects import Effects
from tetris.window.scenery import Layout, draw_scenery
from tetris.window.tiles import tiles_of

_TITLES: Final[Mapping[TopOut | Finish | None, str]] = {
    None: "view.paused",
    Finish.GOAL: "over.won",
    Finish.TIME: "over.time",
}
_VEIL_ALPHA: Final = 205  # over the board when time does not pass
_HEADROOM_ROWS: Final = 1  # drawn above the board, for a piece that is just entering
_DANGER_ROWS: Final = 4  # a stack so near to the top lights the well's frame
_Line = tuple[str, float, theme.Colour]  # words on the board, and their size in cells
_Part = tuple[pygame.Rect, object, Callable[[], object]]  # where, what it shows, and its drawing


@dataclass(frozen=True, slots=True)
class Figure:
    """One number beside the board; the key is that of its label in the language files."""

    key: str
    value: str
    share: float | None = None  # how much of a bar below it is filled, 0 to 1


def figures_of(
    game: Game,
    chosen: Sequence[str],
    *,
    by_time: bool = False,
    rate_hz: float | None = None,
    commands_per_piece: float | None = None,
) -> list[Figure]:
    """Return what matters most in a game first, then what the player chose of `FIGURES`.

    `by_time` is whether it is a race to its goal, `rate_hz` the player's commands a second.
    """
    config, time_s, goal = game.config, game.time_s, game.config.lines_goal
    time = Figure("figures.time", clock(time_s))
    score = Figure("figures.score", f"{game.score:,}")
    lines = Figure("figures.lines", f"{game.lines:,}")
    if goal is not None:
        to_go = f"{max(0, goal - game.lines):,}"
        lines = Figure("figures.lines_left", to_go, min(1.0, game.lines / goal))
    if config.time_limit_s is not None:
        left_s = max(0.0, config.time_limit_s - time_s)
        left = Figure("figures.time_left", clock(left_s), left_s / config.time_limit_s)
        figures = [left, score, lines]
    elif config.dig:
        figures = [
            time,
            Figure("figures.garbage", f"{game.garbage_rows:,}"),
            lines,
        ]
    elif by_time and goal is not None:
        figures = [time, lines]
    elif game.row_us is not None:
        share = game.lines % PACE_LINES / PACE_LINES
        speed = Figure("figures.speed", per_second(pace_of(game.row_us)), share)
        figures = [speed, Figure("figures.pace", per_second(rate_hz)), lines]
    else:
        begun, end = goal_of(game.level, config.start_level)
        share = (game.lines - begun) / (end - begun)
        figures = [score, Figure("figures.level", f"{game.level:,}", share), lines]
    per_piece = "–" if commands_per_piece is None else f"{commands_per_piece:.2f}"
    pieces = Figure("figures.pieces", f"{game.pieces_placed:,}")
    more = {
        "time_s": Figure(time.key, time.value[:-3]),
        "pieces_per_s": Figure("figures.pieces_per_s", f"{game.pieces_per_s:.2f}"),
        "pieces": pieces,
        "commands_per_piece": Figure("figures.commands_per_piece", per_piece),
        "score": score,
    }
    taken = {figure.key.replace("time_left", "time") for figure in figures}
    further = [more[name] for name in chosen if name in more]
    return figures + [pieces if figure.key in taken else figure for figure in further]


def clock(seconds: float) -> str:
    """Write seconds as minutes, seconds and hundredths: 1:05.20."""
    hundredths = int(seconds * 100 + 1e-6)
    minutes, rest = divmod(hundredths, 6000)
    return f"{minutes}:{rest // 100:02}.{rest % 100:02}"


def per_second(rate_hz: float | None) -> str:
    """Write a rate, or a dash for None."""
    return "–" if rate_hz is None else f"{rate_hz:.2f}/s"


def in_danger(game: Game) -> bool:
    """Return whether the stack is near the top."""
    return game.board.height > game.config.rows - _DANGER_ROWS


class GameView:
    """Draws a game: the board, what is held and what comes, the figures, and what happened."""

    def __init__(
        self,
        area: pygame.Rect,
        *,
        look: Look | None = None,
        card: bool = True,
    ) -> None:
        """Draw into an area; `card` is whether there is a card for figures."""
        self._card = card
        self._paced = False  # whether that game's gravity is its own, not that of its level
        self._dress(look or Look())
        self._lay_out(Layout.inside(area, scale=self._look.scale))

    def _dress(self, look: Look) -> None:
        self._look, self._tiles = look, tiles_of(look)
        self._effects = Effects(look)

    def place(self, area: pygame.Rect, look: Look) -> None:
        """Draw into this area and in this look from now on."""
        layout = self.layout
        if area != layout.area or look is not self._look:
            self._dress(look)
            self._lay_out(Layout.inside(area, layout.columns, layout.rows, look.scale))

    def clear(self) -> None:
        """Forget what happened."""
        self._effects.clear()

    def _lay_out(self, layout: Layout) -> None:
        if not self._card:
            layout = replace(layout, stats=pygame.Rect(layout.board.topleft, (0, 0)))
        self.layout = layout
        self.clear()  # effects have pictures of the old size
        self._seen: list[object] = []  # what each part showed in the last picture
        self._around = layout.board.inflate(layout.cell, layout.cell)  # with what glows there
        top = (
            layout.hold.bottom
            if layout.tall
            else max(layout.area.top, layout.board.top - 2 * layout.cell)
        )
        self._around.top, self._around.height = top, self._around.bottom - top
        self._scenery = draw_scenery(layout, self._look)
        self._veil = pygame.Surface(layout.board.size)
        self._veil.fill(self._look.palette.background)
        self._veil.set_alpha(_VEIL_ALPHA)

    @property
    def lively(self) -> bool:
        """Whether an effect is going on, so that the next picture differs from the last one."""
        return self._effects.lit

    def show(self, events: Iterable[Event]) -> None:
        """Let what happened be seen in the next frames."""
        self._effects.show(events, self.layout.cell, paced=self._paced)

    def draw(
        self,
        surface: pygame.Surface,
        game: Game,
        time_s: float,
        *,
        figures: Sequence[Figure] | None = None,
        hint: Plan | None = None,
        ready: str = "",
        kept: bool = False,
    ) -> list[pygame.Rect]:
        """Draw a game as it was at its last update; return the parts that were drawn.

        Args:
            surface: Where to; the area lies inside.
            game: It is not changed.
            time_s: The time of its last update.
            figures: The numbers beside the board; None takes those that suit the game.
            hint: Where a piece would lie well, and whether it is held first, if the player asked.
            ready: A word on the board before the pieces move; a pause does not cover it then.
            kept: Whether the surface still has the last picture; only what changed is drawn.
        """
        columns, rows = game.config.columns, game.config.rows
        if (columns, rows) != (self.layout.columns, self.layout.rows):
            area = self.layout.area
            self._lay_out(Layout.inside(area, columns, rows, self._look.scale))
        figures = figures_of(game, self._look.settings.figures) if figures is None else figures
        lit = hint is not None and hint.actions[0] is Action.HOLD and game.in_play
        landing = hint.landing if hint and game.in_play else None
        veiled = game.phase is not Phase.RUNNING and not ready
        light_s = time_s if self._effects.alive else None
        self._paced = game.row_us is not None
        board = tuple(game.board.rows), game.piece, game.in_play, game.phase
        layout = self.layout

        def draw_board() -> None:
            self._draw_danger(surface, game)
            self._draw_blocks(surface, game, landing)
            self._effects.draw(surface, layout, time_s)
            if veiled:
                surface.blit(self._veil, layout.board)
                self._draw_words(surface, *self._verdict(game))
            if ready:
                self._draw_words(surface, (ready, 1.6, self._look.palette.accent))

        return self._repaint(
            surface,
            kept,
            (self._around, (board, landing, veiled, ready, light_s), draw_board),
            (
                layout.hold,
                (game.hold, game.can_hold, lit),
                partial(self._draw_hold, surface, game, lit),
            ),
            (layout.next, tuple(game.next), partial(self._draw_next, surface, game)),
            (layout.stats, tuple(figures), partial(self._draw_figures, surface, figures)),
        )

    def _repaint(self, surface: pygame.Surface, kept: bool, *parts: _Part) -> list[pygame.Rect]:
        """Draw the parts that do not show what they did; return where they are."""
        seen, self._seen = self._seen if kept else [], [shows for _, shows, _ in parts]
        area, clip = self.layout.area, surface.get_clip()
        changed = [] if seen else [area]
        if not seen:
            surface.blit(self._scenery, area)
        for number, (place, shows, draw) in enumerate(parts):
            if not seen or seen[number] != shows:
                surface.set_clip(place.clip(clip))
                if seen:
                    surface.blit(self._scenery, area)
                draw()
                changed.append(place)
        surface.set_clip(clip)
        return changed

    # -- the board ---------------------------------------------------------------------

    def _draw_blocks(self, surface: pygame.Surface, game: Game, hint: Piece | None) -> None:
        cell, at, tiles = self.layout.cell, self.layout.at, self._tiles
        rows = self.layout.rows
        top = rows + (_HEADROOM_ROWS if game.phase is Phase.RUNNING else 0)
        blits = [
            (tiles.mino(mark, cell), at(x, y))
            for y, row in enumerate(game.board.rows[:top])
            for x, mark in enumerate(row)
            if mark != EMPTY
        ]
        piece = game.piece
        if game.in_play or game.phase is Phase.OVER:
            fall = piece.y - game.ghost_y if game.in_play and self._look.settings.ghost else 0
            shade = tiles.ghost(piece.kind, cell)
            blits += [(shade, at(x, y - fall)) for x, y in piece.cells if fall and y - fall < top]
            if hint and game.in_play:
                blits += [(tiles.hint(hint.kind, cell), at(x, y)) for x, y in hint.cells if y < top]
            if game.in_play or piece.mask & ~game.board.bits:  # it is not among the blocks yet
                body = tiles.mino(piece.kind, cell)
                blits += [(body, at(x, y)) for x, y in piece.cells if y < top]
        surface.fblits(blits)

    def _draw_danger(self, surface: pygame.Surface, game: Game) -> None:
        """Light the frame while the stack is near the top."""
        if in_danger(game) and game.phase is Phase.RUNNING:
            wide = max(2, self.layout.cell // 12)
            frame = self.layout.board.inflate(2 * wide, 2 * wide)
            radius = self.layout.cell // 5
            pygame.draw.rect(surface, self._look.palette.bad, frame, wide, border_radius=radius)

    def _verdict(self, game: Game) -> Iterator[_Line]:
        palette, words = self._look.palette, self._look.words
        yield words(_TITLES.get(game.result, "view.over")), 1.5, palette.text
        if game.phase is Phase.OVER:
            yield words("view.points", points=words.number(game.score, ",")), 0.85, palette.accent

    def _draw_words(self, surface: pygame.Surface, *lines: _Line) -> None:
        board, cell, palette = self.layout.board, self.layout.cell, self._look.palette
        middle = board.top + round(0.43 * board.height)
        band = pygame.Rect(0, 0, board.width, round((len(lines) * 1.35 + 0.9) * cell))
        band.midtop = board.centerx, middle - round(1.2 * cell)
        surface.fill(palette.background, band)
        surface.fill(palette.line, (band.left, band.top, band.width, 1))
        surface.fill(palette.line, (band.left, band.bottom - 1, band.width, 1))
        for words, size, colour in lines:
            picture = theme.fitted(words, round(size * cell), colour, board.width - cell)
            surface.blit(picture, picture.get_rect(center=(board.centerx, middle)))
            middle += round(1.35 * cell)

    # -- beside it ---------------------------------------------------------------------

    def _draw_hold(self, surface: pygame.Surface, game: Game, lit: bool) -> None:
        if lit:
            wide, radius = max(2, self.layout.cell // 10), self.layout.cell // 3
            accent = self._look.palette.accent
            pygame.draw.rect(surface, accent, self.layout.hold, wide, border_radius=radius)
        if game.hold:
            draw = self._tiles.preview if game.can_hold else self._tiles.dimmed
            picture = draw(game.hold, self._small)
            centre = self.layout.hold.centerx, self.layout.slots[0][1]
            surface.blit(picture, picture.get_rect(center=centre))

    def _draw_next(self, surface: pygame.Surface, game: Game) -> None:
        for kind, centre in zip(game.next, self.layout.slots, strict=False):
            picture = self._tiles.preview(kind, self._small)
            surface.blit(picture, picture.get_rect(center=centre))

    @property
    def _small(self) -> int:
        return max(4, round(self.layout.cell * 0.82))

    def _draw_figures(self, surface: pygame.Surface, figures: Sequence[Figure]) -> None:
        letter, palette, words = self.layout.letter, self._look.palette, self._look.words
        places = self.layout.figures
        for row, (figure, place) in enumerate(zip(figures, places, strict=False)):
            left, widest, bottom = place.left, max(1, place.width), place.bottom
            size = round(letter * (1.25 if row == 0 and not self.layout.tall else 1.05))
            number = theme.fitted(words.number(figure.value), size, palette.text, widest)
            surface.blit(number, number.get_rect(bottomleft=(left, bottom)))
            label = theme.fitted(words(figure.key), round(letter * 0.6), palette.dim, widest)
            above = bottom - max(round(1.2 * letter), number.get_height() - 2)
            surface.blit(label, label.get_rect(bottomleft=(left, above)))
            if figure.share is not None:
                high = max(2, round(0.14 * letter))
                bar = pygame.Rect(left, bottom + round(0.06 * letter), widest, high)
                theme.draw_bar(surface, palette, bar, figure.share)
