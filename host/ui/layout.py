"""Layout of game, orb and cards in a window of any size, and the cards beside the game."""

from collections.abc import Mapping
from typing import Final

import pygame

from host.ui import sprites
from host.ui.orb_state import OrbState, RecentCommand
from host.ui.panel import Panel
from host.ui.pause_menu import PauseMenu
from host.ui.pointer_input import DomeArea
from tetris.engine.game import Game, Phase
from tetris.window import theme
from tetris.window.tiles import ThemeChoice
from tetris.window.view import GameView

DESIGN: Final = (1280, 720)  # the window's first size; any other is filled in proportion
_LEAST: Final = 0.05  # of the first size; in a smaller window the edges are cut off
_MARGIN, _LEFT, _RIGHT, _GAP, _TOUCH_CARD = 20, 358, 222, 8, 214  # design units

ENTRY_FADE_S: Final = 25.0  # an entry of the list has faded after so long
ENTRY_LEAST: Final = 0.4  # but stays readable
ROW: Final = 40  # design units from one row of a card to the next

# Icon, what to do, what the default table makes of it, how a mouse does it.
_TOUCHES: Final = (
    ("press", "press", "moves: left, right, down", "click; hold to repeat"),
    ("pinch", "pinch", "drops the piece", "click right, or 2 and left"),
    ("twist_cw", "twist", "turns the piece", "drag round the rim"),
)
_SHOWN: Final = {"press", "pinch", "twist_cw", "twist_ccw"}  # by these rows
_FURTHER: Final = 2  # gestures of an orb that have room below them
_KEYS: Final = (
    ("arrows", "move and turn"),
    ("Z", "turn left"),
    ("space", "drop"),
    ("C", "hold"),
    ("P", "pause"),
    ("R", "new game"),
    ("F11", "full screen"),
    ("ctrl 1–9", "that was ..."),
    ("ctrl backspace", "take that back"),
)


class WindowLayout:
    """Rectangles of all parts in a window of one size."""

    def __init__(
        self, size: tuple[int, int], look: ThemeChoice, hints: Mapping[Phase, str]
    ) -> None:
        """Lay everything out; hints say what to do when the game pauses or is over."""
        self.size, self.look = size, look
        factor = max(_LEAST, min(size[0] / DESIGN[0], size[1] / DESIGN[1]))
        self.unit = unit = sprites.SpriteScale(factor)
        page = pygame.Rect(0, 0, round(DESIGN[0] * factor), round(DESIGN[1] * factor))
        page.center = size[0] // 2, size[1] // 2
        inner = page.inflate(-2 * unit.px(_MARGIN), 0)
        left, right = unit.px(_LEFT), unit.px(_RIGHT)
        area = pygame.Rect(inner.left + left, page.top + unit.px(6), 0, page.height - unit.px(42))
        area.width = inner.width - left - right
        self.game = GameView(area, hints=hints, look=look)
        # Everything stands on the board's lower edge and hangs from its upper one.
        top, bottom = self.game.layout.board.top, self.game.layout.board.bottom
        self.panel = Panel()
        self.orb = pygame.Rect(inner.left, top, left - unit.px(_GAP), bottom - top)
        column = pygame.Rect(0, top, right - unit.px(_GAP), bottom - top)
        column.right = inner.right
        self.touches = column.copy()
        self.touches.height = unit.px(_TOUCH_CARD)
        self.touches.bottom = bottom
        self.history = column
        self.history.height = self.touches.top - unit.px(2 * _GAP) - top
        self.keys = pygame.Rect(page.left, bottom, page.width, page.bottom - bottom)

    def draw(
        self,
        surface: pygame.Surface,
        game: Game,
        orb: OrbState,
        pad: DomeArea,
        now_s: float,
        reason: str,
        menu: PauseMenu | None,
    ) -> None:
        """Draw the whole window; the reason says why the link made the game pause."""
        surface.fill(theme.BACKGROUND)
        self.game.draw(surface, game, now_s, reason=reason, words=menu is None)
        self.panel.place(self.orb, pad)
        self.panel.draw(surface, orb, now_s)
        draw_history(surface, self.history, self.unit, orb, now_s)
        draw_touches(surface, self.touches, self.unit, orb)
        draw_keys(surface, self.keys, self.unit)
        if menu:
            menu.draw(surface, self.game.layout.area, self.look)


def draw_history(
    surface: pygame.Surface,
    rect: pygame.Rect,
    unit: sprites.SpriteScale,
    view: OrbState,
    now_s: float,
) -> None:
    """Draw the last gestures and the commands they became, the newest on top."""
    unit.card(surface, rect)
    left, top = _heading(surface, rect, unit, "UNDERSTOOD")
    if not view.history:
        for line in ("Touch the orb: what it", "understands appears here."):
            surface.blit(unit.text(line, 18, theme.TEXT_DIM), (left, top))
            top += unit.px(20)
    for entry in reversed(view.history):
        if top + unit.px(ROW) > rect.bottom:
            break
        _draw_entry(surface, pygame.Rect(left, top, rect.right - left, 1), unit, entry, now_s)
        top += unit.px(ROW)


def draw_touches(
    surface: pygame.Surface, rect: pygame.Rect, unit: sprites.SpriteScale, view: OrbState
) -> None:
    """Draw how to touch: on a virtual orb, how a mouse does it."""
    unit.card(surface, rect)
    left, top = _heading(surface, rect, unit, "TOUCH")
    virtual = view.welcome is None or view.welcome.virtual
    further = [label for label in view.labels[1:] if label not in _SHOWN][:_FURTHER]
    rows = (*_TOUCHES, *((label, sprites.words(label), "", "") for label in further))
    step = unit.px(56 * len(_TOUCHES) / len(rows))
    for name, gesture, meaning, way in rows:
        picture = sprites.icon(name, unit.px(20), theme.ACCENT)
        surface.blit(picture, picture.get_rect(midleft=(left, top + unit.px(14))))
        column = left + unit.px(32)
        room = rect.right - unit.px(18) - column
        surface.blit(unit.text(gesture, 20, width=room), (column, top))
        surface.blit(unit.text(meaning, 17, theme.TEXT_DIM), (column, top + unit.px(18)))
        if virtual and len(further) < _FURTHER:
            surface.blit(unit.text(way, 17, theme.TEXT_DIM), (column, top + unit.px(33)))
        top += step


def draw_keys(surface: pygame.Surface, rect: pygame.Rect, unit: sprites.SpriteScale) -> None:
    """Draw the keys in one quiet line, centred."""
    pieces = []
    for key, meaning in _KEYS:
        pieces.append((unit.text(key, 18, theme.TEXT), unit.px(6)))
        pieces.append((unit.text(meaning, 18, theme.TEXT_DIM), unit.px(20)))
    x = rect.centerx - (sum(p.get_width() + gap for p, gap in pieces) - pieces[-1][1]) // 2
    for picture, gap in pieces:
        surface.blit(picture, picture.get_rect(midleft=(x, rect.centery)))
        x += picture.get_width() + gap


def _heading(
    surface: pygame.Surface, rect: pygame.Rect, unit: sprites.SpriteScale, words: str
) -> tuple[int, int]:
    left, top = rect.left + unit.px(18), rect.top + unit.px(16)
    surface.blit(unit.text(words, 18, theme.TEXT_DIM), (left, top))
    return left, top + unit.px(28)


def _draw_entry(
    surface: pygame.Surface,
    row: pygame.Rect,
    unit: sprites.SpriteScale,
    entry: RecentCommand,
    now_s: float,
) -> None:
    age_s = max(0.0, now_s - entry.time_s)
    fresh = max(ENTRY_LEAST, 1.0 - age_s / ENTRY_FADE_S)
    bright = sprites.mix(theme.SURFACE, theme.TEXT, fresh)
    dim = sprites.mix(theme.SURFACE, theme.TEXT_DIM, fresh)
    warm = sprites.mix(theme.SURFACE, theme.ACCENT, fresh)
    size, middle, x = unit.px(18), row.top + unit.px(16), row.left
    for name, colour, wide in (
        (entry.label, warm, size),
        ("to", dim, size // 2),
        (entry.command, bright, size),
    ):
        picture = sprites.icon(name, wide, colour)
        surface.blit(picture, picture.get_rect(midleft=(x, middle)))
        x += wide + unit.px(7)
    column = x + unit.px(3)
    age = unit.text("now" if age_s < 1 else f"{age_s:.0f} s", 17, dim)
    surface.blit(age, age.get_rect(topright=(row.right - unit.px(18), row.top)))
    room = row.right - unit.px(18) - column
    asked = unit.text(sprites.words(entry.command), 20, bright, room - age.get_width() - unit.px(6))
    surface.blit(asked, (column, row.top))
    share = unit.text(f"{entry.probability:.2f}", 17, dim)
    label = unit.text(sprites.words(entry.label), 17, dim, room - share.get_width() - unit.px(4))
    surface.blit(label, (column, row.top + unit.px(17)))
    surface.blit(share, (column + label.get_width() + unit.px(4), row.top + unit.px(17)))
