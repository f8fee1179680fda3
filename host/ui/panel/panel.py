"""Panel of the orb: its image, its recognition and its link, drawn from telemetry only.

It is drawn into a picture when something on it has changed visibly, and copied otherwise.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pygame

from controller.shared.protocol.messages import Contact
from host.ui import dome, ghost, naming, sprites, zones
from host.ui.orb_state import Deviation, LinkState, OrbState
from host.ui.panel.gesture_rows import GestureRows
from host.ui.panel.panel_layout import HEIGHT, WIDTH, PanelLayout
from host.ui.pointer_input import DomeArea
from tetris.kit.language import FALLBACK
from tetris.kit.settings import Look
from tetris.kit.theme import Colour

_COLOURS: Final[dict[LinkState, str]] = {
    "connecting": "warn",
    "live": "good",
    "stale": "warn",
    "lost": "bad",
}
_TEXT: Final = 18  # size of most text, in design units
_LINES: Final = 4  # of a sentence below the dome at most
_LIGHT: Final[Colour] = (255, 238, 226)  # marks on the dome, whose colours no theme changes
_USUAL: Final = 4  # gestures
_LEAST: Final = 80  # pixels; nothing is drawn into a narrower or lower panel
_VISIBLE: Final = 0.012  # change of z - 1 from which the heat map is drawn anew
_RESTS: Final = 0.03  # |z - 1| that is noise: the map of a dome below it is empty


@dataclass(frozen=True, slots=True)
class Projection:
    """Grid units on the membrane to pixels of the window, and back."""

    pad: DomeArea
    centre: tuple[float, float]  # pixels
    pixels_per_unit: float

    def to_screen(self, x: float, y: float) -> tuple[float, float]:
        """Return the pixel of a point of the grid."""
        middle = self.pad.centre
        return (
            self.centre[0] + (x - middle[0]) * self.pixels_per_unit,
            self.centre[1] - (y - middle[1]) * self.pixels_per_unit,
        )

    def to_grid(self, x: float, y: float) -> tuple[float, float]:
        """Return the point of the grid at a pixel."""
        middle = self.pad.centre
        return (
            middle[0] + (x - self.centre[0]) / self.pixels_per_unit,
            middle[1] - (y - self.centre[1]) / self.pixels_per_unit,
        )


class Panel:
    """Draws an `OrbState` into a rectangle that it is given.

    Attributes:
        rect: The rectangle, pixels.
        layout: Its parts, from its corner.
        projection: Grid units to pixels of the window.
    """

    def __init__(self) -> None:
        self._field = dome.HeatMap()
        self._heat: pygame.Surface | None = None  # as drawn last, of `_felt`
        self._felt: Deviation | None = None
        self._heats = 0  # heat maps drawn
        self._picture = pygame.Surface((1, 1))
        self._picture_key: tuple[Any, ...] = ()  # what it shows
        self._look = Look()
        self._asked: tuple[Any, ...] = ()  # of `place`
        self.place(pygame.Rect(0, 0, WIDTH, HEIGHT), DomeArea())

    def place(
        self, rect: pygame.Rect, pad: DomeArea, *, gestures: int = 0, scale: float = 1.0
    ) -> None:
        """Set where the orb is drawn, which, and for how many gestures; 0: not known yet.

        `scale` enlarges text, 1.0 is the usual size.
        """
        asked = rect.copy(), pad, gestures, scale
        if asked == self._asked:
            return
        self.rect, self._asked = rect.copy(), asked
        self._picture, self._picture_key = pygame.Surface(rect.size), ()
        inside = self._picture.get_rect()
        self.layout = layout = PanelLayout.of(inside, gestures or _USUAL, scale)
        x, y = layout.dome.center
        self._inner = Projection(pad, (x, y), layout.radius / pad.radius)
        middle = x + rect.left, y + rect.top
        self.projection = Projection(pad, middle, layout.radius / pad.radius)

    def draw(self, surface: pygame.Surface, view: OrbState, now_s: float, look: Look) -> None:
        """Draw the orb in a theme and a language; `view` has been advanced to `now_s`."""
        if min(self.rect.size) < _LEAST:
            return
        self._look = look
        self._unit = sprites.SpriteScale(self.layout.factor, look.palette)
        rows = GestureRows(self.layout.rows, self._unit, look.words, view)
        self._keep_heat(view)
        caption, colour = self._caption(view, now_s)
        pulse = sprites.in_steps(255 * view.rim.level(now_s))
        key: tuple[Any, ...] = (
            *(look.palette, look.words.name, self._heats, caption, colour),
            *(rows.fresh(now_s), rows.bars(), view.contacts, view.ghost),
            *(self._lit(view), view.columns, self._mark(view, now_s), pulse, view.ready),
            *(view.link, view.reason, view.welcome, view.shape, view.badge),
            *(view.user, round(view.sure, 2), tuple(view.gestures.values())),
        )
        if key != self._picture_key:
            self._picture_key = key
            self._compose(view, now_s, rows)
        surface.blit(self._picture, self.rect)

    # -- what is drawn when ----------------------------------------------------------------

    def _keep_heat(self, view: OrbState) -> None:
        """Draw the heat map anew if it differs visibly."""
        side = 2 * self.layout.radius
        rests = float(np.abs(view.shown).max(initial=0.0)) < _RESTS
        shown = np.zeros_like(view.shown) if rests else view.shown
        same = (
            self._heat is not None
            and self._felt is not None
            and self._heat.get_width() == side
            and self._felt.shape == shown.shape
            and float(np.abs(self._felt - shown).max(initial=0.0)) < _VISIBLE
        )
        if not same:
            self._felt = shown.copy()
            self._heats += 1
            self._heat = self._field.draw(shown, self.projection.pad.radius, side)

    def _compose(self, view: OrbState, now_s: float, rows: GestureRows) -> None:
        words, palette = self._look.words, self._look.palette
        self._picture.fill(palette.background)
        self._header(view)
        self._dome(view)
        self._light(view, now_s)
        self._fingers(view)
        if view.link == "live":
            self._unit.card(self._picture, self.layout.card)
            rows.draw(self._picture, now_s)
            if not view.ready:
                self._banner("dome.calibrating", palette.warn)
            self._say(*self._caption(view, now_s))
            return
        veil = sprites.ring(self.layout.radius, 0, palette.background, 0, 168)
        self._blit(veil, center=self._inner.centre)
        self._banner(f"dome.{view.link}", self._tint(view.link))
        if words.name == FALLBACK:  # the reason is an English sentence
            self._say(view.reason, palette.text)

    def _blit(self, image: pygame.Surface, **place: Any) -> None:
        """Copy an image, a point of its rectangle at a place."""
        self._picture.blit(image, image.get_rect(**place))

    # -- the parts -------------------------------------------------------------------------

    def _tint(self, link: LinkState) -> Colour:
        colour: Colour = getattr(self._look.palette, _COLOURS[link])
        return colour

    def _header(self, view: OrbState) -> None:
        words, unit, box = self._look.words, self._unit, self.layout.header
        live = view.link == "live"
        pad, tint = unit.px(6), self._tint("connecting" if live and not view.ready else view.link)
        said = []  # without a link the dome says so
        if live and view.sure:
            sure = words.number(view.sure, ".0%")
            said.append(f"{view.user} {sure}" if view.user else words("dome.who"))
        if live and view.welcome and view.welcome.virtual:
            said.append(words("dome.virtual"))
        dim = self._look.palette.dim
        label = unit.text(" · ".join(said), _TEXT, dim, round(0.55 * box.width))
        self._blit(label, midright=(box.right - pad, box.centery))
        lamp = max(4, unit.px(5))
        at = box.right - 2 * pad - label.get_width() - 2 * lamp, box.centery
        self._blit(sprites.ring(2 * lamp, 0, tint, 0, 50), center=at)
        self._blit(sprites.ring(lamp, 0, tint, 0, 255), center=at)
        room = max(0, at[0] - 2 * lamp - 2 * pad - box.left)
        at = box.left + pad, box.centery
        if view.badge:
            word = words(f"dome.{view.badge}")
            colour = self._look.palette.warn if view.badge == "armed" else dim
            badge = unit.badge(word, _TEXT, colour, room // 2)
            self._blit(badge, midleft=at)
            at, room = (at[0] + badge.get_width() + 2 * pad, at[1]), room - badge.get_width()
        name = unit.text(view.welcome.name if view.welcome else "OrbTouch", 24, None, room)
        self._blit(name, midleft=at)

    def _dome(self, view: OrbState) -> None:
        palette, place, radius = self._look.palette, self._inner, self.layout.radius
        self._blit(dome.balloon(radius, palette.raised, palette.line), center=place.centre)
        self._blit(sprites.taxels(*view.shape, place.pixels_per_unit), center=place.centre)
        if view.welcome and view.welcome.virtual and view.link == "live":
            self._blit(sprites.rim_arrows(round(radius * 0.90), _LIGHT, 120), center=place.centre)

    def _light(self, view: OrbState, now_s: float) -> None:
        """Draw the pulse round the dome, the zones, the heat map over them, and the last touch."""
        place, palette = self._inner, self._look.palette
        if level := sprites.in_steps(255 * view.rim.level(now_s)):
            light = dome.rim(self.layout.radius, palette.accent)
            light.set_alpha(level)
            self._blit(light, center=place.centre)
        if view.columns:
            marks = zones.columns_picture(view.columns, place.pad, self.layout.radius)
            self._blit(marks, center=place.centre)
        elif shown := self._lit(view):
            rules, lit = shown
            self._blit(
                zones.picture(rules, place.pad, self.layout.radius, lit), center=place.centre
            )
        assert self._heat
        self._blit(self._heat, center=place.centre)
        if mark := self._mark(view, now_s):
            at, wide, alpha = mark
            self._blit(sprites.ring(wide, 2.2 * self._line, _LIGHT, alpha), center=at)

    @property
    def _line(self) -> float:
        """Pixels that a fine line on the dome is wide, as a factor."""
        return max(1.0, self.layout.radius / 140)

    def _lit(self, view: OrbState) -> tuple[zones.Rules, int | None] | None:
        """Return the zones to show, and which one is lit; None without zones."""
        rules = zones.rules_in_use(view.gestures.values()) if view.zones else ()
        if not rules or view.link != "live":
            return None
        return rules, zones.zone_at(rules, view.pointer) if view.pointer else None

    def _mark(self, view: OrbState, now_s: float) -> tuple[tuple[float, float], int, int] | None:
        """Return place, radius and opacity of the ring round the last recognised touch."""
        mark = view.mark(now_s)
        if not mark or not self._inner.pad.on_dome(*mark[:2]):
            return None
        x, y, fresh = mark
        wide = round(self.layout.radius * (0.09 + 0.11 * (1 - fresh)))
        return self._inner.to_screen(x, y), wide, sprites.in_steps(255 * fresh)

    def _fingers(self, view: OrbState) -> None:
        place = self._inner
        shown = [(one, place.to_screen(one.x, one.y), self._finger_px(one)) for one in view.ghost]
        ghost.draw(self._picture, shown, _LIGHT)
        for contact in view.contacts:
            wide = round(self._finger_px(contact))
            tip = sprites.ring(wide, 2.0 * self._line, _LIGHT, 230, 38)
            self._blit(tip, center=place.to_screen(contact.x, contact.y))

    def _finger_px(self, contact: Contact) -> float:
        place = self._inner
        return contact.radius_mm / place.pad.pitch_mm * place.pixels_per_unit

    def _banner(self, key: str, colour: Colour) -> None:
        unit, room = self._unit, round(1.9 * self.layout.radius)
        lines = unit.lines(self._look.words(key), _TEXT, room - unit.px(28), 3)
        labels = [unit.text(line, _TEXT, colour, room - unit.px(28)) for line in lines]
        high = labels[0].get_height()
        box = pygame.Rect(0, 0, max(one.get_width() for one in labels), high * len(labels))
        box = box.inflate(unit.px(28), unit.px(16))
        plate = sprites.card(
            box.size, min(box.height // 2, 2 * high), self._look.palette.background
        )
        middle = self._inner.centre
        self._blit(plate, center=middle)
        top = middle[1] - high * (len(labels) - 1) / 2
        for number, label in enumerate(labels):
            self._blit(label, center=(middle[0], top + number * high))

    def _caption(self, view: OrbState, now_s: float) -> tuple[str, Colour]:
        """Return what matters most, a sentence, and its colour."""
        words, palette = self._look.words, self._look.palette
        last = view.latest(now_s)
        if view.note:
            return view.note, palette.text
        if last:
            understood, done = (
                naming.gesture(words, last.label),
                naming.command(words, last.name),
            )
            return f"{understood} → {done}", palette.accent
        if view.gesture:
            return naming.gesture(words, view.gesture), palette.accent
        if reason := view.reason_unanswered(now_s):
            return naming.unanswered(words, reason), palette.warn
        if view.health:
            return naming.said(words, view.health[0]), palette.warn
        return view.hint, palette.dim

    def _say(self, caption: str, colour: Colour) -> None:
        box, unit = self.layout.caption, self._unit
        lines = unit.lines(caption, _TEXT, box.width - 8, _LINES)
        step = box.height // 2
        if len(lines) > 2:  # a long sentence covers the first gestures
            box = pygame.Rect(box.left, box.top, box.width, len(lines) * step + 8)
            unit.card(self._picture, box)
        for number, line in enumerate(lines):
            label = unit.text(line, _TEXT, colour, box.width - 8)
            middle = box.centery + (number - (len(lines) - 1) / 2) * step
            self._blit(label, center=(box.centerx, middle))
