"""Rows of the panel's card: a gesture each, its probability, and the commands it leads to."""

from typing import Final

import pygame

from host.ui import dome, naming, sprites
from host.ui.orb_state import OrbState
from host.ui.thumbnails import Base, thumbnail
from host.ui.zones import NONE
from tetris.kit.language import Words

FADE_S: Final = 2.5  # in which the row of a recognised gesture fades
_STEPS: Final = 16
_COMMANDS: Final = 3  # icons of commands that a row shows at most
_NARROW: Final = 120  # pixels: a narrower row shows icons and the bar alone
_TEXT: Final = 18


class GestureRows:
    """The rows of one panel."""

    def __init__(
        self, rows: tuple[pygame.Rect, ...], unit: sprites.SpriteScale, words: Words, view: OrbState
    ) -> None:
        """Show an orb's gestures in rectangles, in their order; those without one are left out."""
        self._unit, self._words, self._view = unit, words, view
        self._rows = list(zip((k for k in range(len(view.labels)) if k), rows, strict=False))

    def fresh(self, now_s: float) -> tuple[int, int]:
        """Return the class of the newest recognised gesture, and how fresh it is, 0 to _STEPS."""
        view = self._view
        if view.gesture in view.labels:
            return view.labels.index(view.gesture), _STEPS
        passed_s = max(0.0, now_s - view.last_s)
        if view.last is None or view.last.label not in view.labels or passed_s >= FADE_S:
            return 0, 0
        return view.labels.index(view.last.label), round((1.0 - passed_s / FADE_S) * _STEPS)

    def bars(self) -> tuple[int, ...]:
        """Return the lengths of the filled bars, pixels; 0 where none is seen."""
        lengths = []
        for k, row in self._rows:
            track, share = self._track(row), float(self._view.probabilities[k])
            length = round(track.width * min(1.0, max(0.0, share)))
            lengths.append(length if length >= track.height else 0)
        return tuple(lengths)

    def draw(self, surface: pygame.Surface, now_s: float) -> None:
        """Draw all rows, that of a recognised gesture highlighted."""
        palette = self._unit.palette
        newest, level = self.fresh(now_s)
        for (k, row), filled in zip(self._rows, self.bars(), strict=True):
            fresh = k == newest and level > 0
            if fresh:
                fill = sprites.mix(palette.surface, palette.raised, level / _STEPS)
                edge = sprites.mix(palette.surface, palette.accent, level / _STEPS)
                plate = sprites.card(row.size, min(8, row.height // 3), fill, edge)
                surface.blit(plate, row)
            self._draw(surface, row, k)
            track = self._track(row)
            if filled:
                tint = palette.accent if fresh else palette.dim
                bar = sprites.card((filled, track.height), track.height // 2, tint)
                surface.blit(bar, track)

    # -- one row ---------------------------------------------------------------------------

    def _icon(self, row: pygame.Rect) -> int:
        return min(row.height - 6, max(14, self._unit.px(22)))

    def _track(self, row: pygame.Rect) -> pygame.Rect:
        """Return the rectangle of the bar: below the name, or between the icons."""
        icon, high = self._icon(row), max(3, self._unit.px(4))
        left = row.left + icon + 10
        right = row.right - 6 - _COMMANDS * (icon + 2)
        track = pygame.Rect(left, 0, max(8, right - left), high)
        if row.width < _NARROW:
            track.width, track.centery = max(8, row.right - 8 - icon - left), row.centery
        else:
            track.bottom = row.bottom - max(1, row.height // 10)
        return track

    def _draw(self, surface: pygame.Surface, row: pygame.Rect, k: int) -> None:
        label, icon, palette = self._view.labels[k], self._icon(row), self._unit.palette
        mark = self._mark(label, icon)
        surface.blit(mark, mark.get_rect(midleft=(row.left + 4, row.centery)))
        track = self._track(row)
        plate = sprites.card(track.size, track.height // 2, palette.track)
        surface.blit(plate, track)
        narrow = row.width < _NARROW
        right = row.right - 4
        for command in reversed(self._commands(label)[: 1 if narrow else _COMMANDS]):
            picture = sprites.icon(command, round(icon * 0.8), palette.dim)
            surface.blit(picture, picture.get_rect(midright=(right, row.centery)))
            right -= icon + 2
        if not narrow:
            room = max(0, right - track.left)
            name = self._unit.text(naming.gesture(self._words, label), _TEXT, palette.text, room)
            middle = (row.top + track.top) // 2
            surface.blit(name, name.get_rect(midleft=(track.left, middle)))

    def _mark(self, label: str, side: int) -> pygame.Surface:
        """Return a gesture's icon; of a taught one its own mean image."""
        info, shape = self._view.gestures.get(label), self._view.shape
        own = info and (info.taught or not sprites.has_icon(label))
        if info and own and len(info.image) == shape[0] * shape[1]:
            palette = self._unit.palette
            radius = max(1, round(side / 2 / (1 + dome.PADDING)))
            return thumbnail(info.image, *shape, Base(radius, palette.raised, palette.line))
        return sprites.icon(label, side, self._unit.palette.text)

    def _commands(self, label: str) -> list[str]:
        info = self._view.gestures.get(label)
        rules = info.rules if info else ()
        if self._view.columns and len(rules) > 1:
            return []  # in Aim its place is the column
        return list(dict.fromkeys(one.command for one in rules if one.command not in NONE))
