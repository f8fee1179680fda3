"""Panel of the orb: its image, its recognition and its link, drawn from telemetry only."""

from dataclasses import dataclass
from textwrap import TextWrapper
from typing import Final

import pygame

from controller.protocol.messages import Contact
from host.ui import dome, ghost, sprites, zones
from host.ui.orb_state import TRACE_S, LinkState, OrbState
from host.ui.pointer_input import DomeArea
from tetris.window import theme
from tetris.window.theme import Colour

WIDTH: Final = 350  # the panel's design size; any rectangle is filled in proportion
HEIGHT: Final = 600
DOME_SHARE: Final = 0.40  # of the panel's width, the dome's radius

_LINK: Final[dict[LinkState, tuple[str, Colour]]] = {
    "connecting": ("connecting", theme.WARN),
    "live": ("live", theme.GOOD),
    "stale": ("silent", theme.WARN),
    "lost": ("link lost", theme.BAD),
}
_PILL: Final = 64  # design units that "virtual" takes
_RATE: Final = 76  # that the rate takes at most
_REASON: Final = TextWrapper(40, break_long_words=False, break_on_hyphens=False)  # below the dome
_REASON_LINES: Final = 5
_HEALTH: Final = TextWrapper(52, break_long_words=False, break_on_hyphens=False)  # in small letters
_SILENT: Final = {"connecting": "connecting", "stale": "no word from the orb", "lost": "link lost"}

WINDOW: Final = (390, 720)  # of the keyboard and gamepad targets
_STRIP: Final = 96  # design units below the panel
_MARGIN: Final = 12
_LEAST: Final = 0.05  # of the first size; in a smaller window the edges are cut off


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
    """Draws an `OrbState` into rectangles that it is given."""

    def __init__(self) -> None:
        """Make a panel; `place` it before drawing."""
        self._field = dome.HeatMap()
        self.place(pygame.Rect(0, 0, WIDTH, HEIGHT), DomeArea())

    def place(self, rect: pygame.Rect, pad: DomeArea) -> None:
        """Set where the orb is drawn, and which; changes `projection`."""
        self.rect = rect
        self._unit = sprites.SpriteScale(min(rect.width / WIDTH, rect.height / HEIGHT))
        self._inner = rect.width - 2 * self._unit.px(18)  # pixels: what a line of text may take
        self._radius = max(24, round(self._unit.factor * WIDTH * DOME_SHARE))
        centre = (
            rect.centerx,
            rect.top + self._unit.px(64) + round(self._radius * (1 + dome.PADDING)),
        )
        self.projection = Projection(pad, centre, self._radius / pad.radius)

    def draw(self, surface: pygame.Surface, view: OrbState, now_s: float) -> None:
        """Draw the orb, its probabilities and its trace; `view` has been advanced to `now_s`."""
        self._unit.card(surface, self.rect)
        self._header(surface, view)
        self._dome(surface, view, now_s)
        below = self.projection.centre[1] + self._radius * (1 + dome.PADDING)
        top = round(below) + self._unit.px(4)
        if view.link == "live":
            top = self._bars(surface, view, self._caption(surface, view, now_s, top))
        else:
            self._reason(surface, view, top + self._unit.px(20))
        self._hops(surface, view)
        self._trace(surface, view, now_s, top)

    def _header(self, surface: pygame.Surface, view: OrbState) -> None:
        left, middle = self.rect.left + self._unit.px(18), self.rect.top + self._unit.px(32)
        room = self._state(surface, view, middle) - left - self._unit.px(_PILL + 20)
        name = self._unit.text(view.welcome.name if view.welcome else "OrbTouch", 28, width=room)
        surface.blit(name, name.get_rect(midleft=(left, middle)))
        if view.welcome:
            kind = "virtual" if view.welcome.virtual else "real"
            tint = theme.ACCENT_COOL if view.welcome.virtual else theme.ACCENT
            self._pill(surface, kind, tint, (left + name.get_width() + self._unit.px(10), middle))
        if view.sure and view.link == "live":
            who = f"{view.user} {view.sure:.0%}" if view.user else "who is it?"
            tint = theme.ACCENT if view.user else theme.TEXT_DIM
            label = self._unit.text(who, 17, tint, self._inner)
            at = self.rect.right - self._unit.px(18), middle + self._unit.px(21)
            surface.blit(label, label.get_rect(midright=at))

    def _state(self, surface: pygame.Surface, view: OrbState, middle: int) -> int:
        """Draw how the link is, at the right; return where that begins."""
        state, colour = _LINK[view.link]
        right = self.rect.right - self._unit.px(18)
        label = self._unit.text(state, 20, colour)
        surface.blit(label, label.get_rect(midright=(right, middle)))
        lamp = sprites.ring(self._unit.px(9), 0, colour, 0, 50)
        core = sprites.ring(self._unit.px(4), 0, colour, 0, 255)
        at = right - label.get_width() - self._unit.px(14), middle
        surface.blit(lamp, lamp.get_rect(center=at))
        surface.blit(core, core.get_rect(center=at))
        if view.link != "live":
            return at[0] - self._unit.px(9)
        rate = self._unit.text(f"{view.rate_hz:.1f} Hz", 18, theme.TEXT_DIM, self._unit.px(_RATE))
        box = rate.get_rect(midright=(at[0] - self._unit.px(15), middle))
        surface.blit(rate, box)
        return box.left

    def _dome(self, surface: pygame.Surface, view: OrbState, now_s: float) -> None:
        place, radius = self.projection, self._radius
        balloon = dome.balloon(radius)
        surface.blit(balloon, balloon.get_rect(center=place.centre))
        rows, columns = view.shape
        field = self._field.draw(view.shown, place.pad.radius, 2 * radius)
        surface.blit(field, field.get_rect(center=place.centre))
        marks = sprites.taxels(rows, columns, place.pixels_per_unit)
        surface.blit(marks, marks.get_rect(center=place.centre))
        if view.welcome and view.welcome.virtual and view.link == "live":
            arrows = sprites.rim_arrows(round(radius * 0.90), (255, 238, 226), 120)
            surface.blit(arrows, arrows.get_rect(center=place.centre))
        if view.zones and (rules := zones.rules_in_use(view.gestures.values())):
            lit = zones.zone_at(rules, view.pointer) if view.pointer else None
            picture = zones.picture(rules, place.pad, radius, lit, theme.ACCENT)
            surface.blit(picture, picture.get_rect(center=place.centre))
        mark = view.mark(now_s)
        if mark and place.pad.on_dome(*mark[:2]):
            x, y, fresh = mark
            wide = self._unit.px(12 + 16 * (1 - fresh))
            alpha = sprites.in_steps(255 * fresh)
            halo = sprites.ring(wide, 2.2 * self._unit.factor, theme.TEXT, alpha)
            surface.blit(halo, halo.get_rect(center=place.to_screen(x, y)))
        fingers = [(one, place.to_screen(one.x, one.y), self._finger_px(one)) for one in view.ghost]
        ghost.draw(surface, fingers, theme.ACCENT)
        for contact in view.contacts:
            finger = round(self._finger_px(contact))
            tip = sprites.ring(finger, 2.0 * self._unit.factor, theme.TEXT, 230, 38)
            surface.blit(tip, tip.get_rect(center=place.to_screen(contact.x, contact.y)))
        if view.link != "live":
            veil = sprites.ring(radius, 0, theme.BACKGROUND, 0, 168)
            surface.blit(veil, veil.get_rect(center=place.centre))
            self._banner(surface, _SILENT[view.link], _LINK[view.link][1])
        elif not view.ready:
            self._banner(surface, "taking the rest image: do not touch", theme.WARN)

    def _finger_px(self, contact: Contact) -> float:
        """Return the radius of a finger in pixels."""
        place = self.projection
        return contact.radius_mm / place.pad.pitch_mm * place.pixels_per_unit

    def _banner(self, surface: pygame.Surface, message: str, colour: Colour) -> None:
        label = self._unit.text(message, 20, colour)
        box = label.get_rect(center=self.projection.centre).inflate(
            self._unit.px(28), self._unit.px(18)
        )
        plate = sprites.card(box.size, box.height // 2, theme.BACKGROUND, alpha=225)
        surface.blit(plate, box)
        surface.blit(label, label.get_rect(center=box.center))

    def _caption(self, surface: pygame.Surface, view: OrbState, now_s: float, top: int) -> int:
        """Draw below the dome what matters most; return where the next part begins."""
        if view.health and not view.gesture:
            for number, line in enumerate(_HEALTH.wrap(view.health[0])[:2]):
                label = self._unit.text(line, 16, theme.WARN, self._inner)
                at = (self.rect.centerx, top + self._unit.px(17) * number)
                surface.blit(label, label.get_rect(midtop=at))
            return top + self._unit.px(36)
        size, colour, message = 18, theme.TEXT_DIM, view.hint
        if reason := view.reason_unanswered(now_s):
            colour, message = theme.WARN, reason
        if view.gesture:
            size, colour, message = 24, theme.ACCENT, sprites.words(view.gesture)
        label = self._unit.text(message, size, colour, self._inner)
        surface.blit(label, label.get_rect(midtop=(self.rect.centerx, top)))
        return top + self._unit.px(36)

    def _reason(self, surface: pygame.Surface, view: OrbState, top: int) -> None:
        """Draw why there is no link, where the probabilities would be."""
        for line in _REASON.wrap(view.reason)[:_REASON_LINES]:
            label = self._unit.text(line, 19, theme.TEXT, self._inner)
            surface.blit(label, label.get_rect(midtop=(self.rect.centerx, top)))
            top += self._unit.px(22)

    def _bars(self, surface: pygame.Surface, view: OrbState, top: int) -> int:
        left, right = self.rect.left + self._unit.px(20), self.rect.right - self._unit.px(20)
        start, height = left + self._unit.px(118), self._unit.px(10)
        end = right - self._unit.px(42)
        order = [k for k, label in enumerate(view.labels) if label != "null"]
        order += [k for k, label in enumerate(view.labels) if label == "null"]
        room = self.rect.bottom - self._unit.px(56) - top
        step = min(self._unit.px(27), room // max(1, len(order)))
        for k in order:
            label, value = view.labels[k], float(view.probabilities[k])
            middle = top + step // 2
            held = label == view.gesture and label != "null"
            quiet = theme.TEXT_DIM if label == "null" else theme.ACCENT
            tint = theme.TEXT if held else sprites.mix(theme.TEXT_DIM, theme.TEXT, value)
            mark = sprites.icon(label, self._unit.px(17), theme.ACCENT if held else tint)
            surface.blit(mark, mark.get_rect(midleft=(left, middle)))
            name = self._unit.text(sprites.words(label), 20, tint, self._unit.px(88))
            surface.blit(name, name.get_rect(midleft=(left + self._unit.px(26), middle)))
            track = pygame.Rect(start, middle - height // 2, end - start, height)
            surface.blit(sprites.card(track.size, height // 2, theme.SURFACE_RAISED), track)
            filled = round(track.width * min(1.0, max(0.0, value)))
            if filled >= height:
                bar = sprites.card((filled, height), height // 2, quiet)
                surface.blit(bar, track.topleft)
            share = self._unit.text(f"{value:.2f}", 18, tint)
            surface.blit(share, share.get_rect(midright=(right, middle)))
            top += step
        return top

    def _hops(self, surface: pygame.Surface, view: OrbState) -> None:
        """Draw how long frames take: in half of them, and in all but one of a hundred."""
        if not view.hops or view.link != "live":
            return
        words = "   ".join(
            f"{h.name} {h.p50_ms:.0f} / {h.p95_ms:.0f} / {h.p99_ms:.0f}" for h in view.hops
        )
        if view.period_ms:
            left = view.period_ms - view.hops[0].p99_ms
            words += f" ms   left {left:.0f} of {view.period_ms:.0f}"
        line = self._unit.text(words, 13, theme.TEXT_DIM, self._inner)
        middle = self.rect.centerx, self.rect.bottom - self._unit.px(15)
        surface.blit(line, line.get_rect(center=middle))

    def _trace(self, surface: pygame.Surface, view: OrbState, now_s: float, top: int) -> None:
        """Draw how far the membrane was from rest over the last seconds."""
        left, right = self.rect.left + self._unit.px(20), self.rect.right - self._unit.px(20)
        top = max(top + self._unit.px(8), self.rect.bottom - self._unit.px(64))
        bottom = self.rect.bottom - self._unit.px(32)
        caption = self._unit.text("deviation", 16, theme.TEXT_DIM)
        surface.blit(caption, caption.get_rect(bottomleft=(left, bottom)))
        start = left + self._unit.px(66)
        pygame.draw.line(surface, theme.LINE, (start, bottom), (right, bottom))
        if len(view.trace) < 2:
            return
        high = max(0.08, max(value for _, value in view.trace))
        points = [
            (
                right - (now_s - at_s) / TRACE_S * (right - start),
                bottom - value / high * (bottom - top),
            )
            for at_s, value in view.trace
        ]
        pygame.draw.aalines(surface, theme.ACCENT_COOL, False, points)

    def _pill(
        self, surface: pygame.Surface, word: str, tint: Colour, midleft: tuple[int, int]
    ) -> None:
        label = self._unit.text(word, 17, tint)
        box = pygame.Rect(0, 0, label.get_width() + self._unit.px(16), self._unit.px(22))
        box.midleft = midleft
        surface.blit(
            sprites.card(box.size, box.height // 2, sprites.mix(theme.SURFACE, tint, 0.16)), box
        )
        surface.blit(label, label.get_rect(center=box.center))


class OrbWindow:
    """Content of the small window.

    Attributes:
        drawn: Its last place and size in the surface; empty before the first drawing.
    """

    def __init__(self) -> None:
        """Begin without a picture."""
        self.drawn = pygame.Rect(0, 0, 0, 0)
        self._panel = Panel()

    @property
    def projection(self) -> Projection:
        """Rectangle of the dome in the window."""
        return self._panel.projection

    def draw(
        self,
        surface: pygame.Surface,
        now_s: float,
        orb: OrbState,
        dome: DomeArea,
        *,
        armed: bool,
        lines: tuple[str, ...],
    ) -> None:
        """Draw the orb, and below it the state of arming and some lines of text."""
        self.drawn = surface.get_rect()
        factor = min(self.drawn.width / WINDOW[0], self.drawn.height / WINDOW[1])
        unit = sprites.SpriteScale(max(_LEAST, factor))
        surface.fill(theme.BACKGROUND)
        page = pygame.Rect(0, 0, unit.px(WINDOW[0]), unit.px(WINDOW[1]))
        page.center = self.drawn.center
        inner = page.inflate(-2 * unit.px(_MARGIN), -2 * unit.px(_MARGIN))
        strip = pygame.Rect(inner.left, 0, inner.width, unit.px(_STRIP))
        strip.bottom = inner.bottom
        inner.height -= strip.height + unit.px(_MARGIN)
        self._panel.place(inner, dome)
        self._panel.draw(surface, orb, now_s)
        unit.card(surface, strip)
        left, top = strip.left + unit.px(18), strip.top + unit.px(12)
        word, colour = ("ARMED", theme.WARN) if armed else ("DISARMED", theme.TEXT_DIM)
        surface.blit(unit.text(word, 28, colour), (left, top))
        for line in lines:
            top += unit.px(26)
            shown = unit.text(line, 18, theme.TEXT, strip.width - 2 * unit.px(18))
            surface.blit(shown, (left, top))
