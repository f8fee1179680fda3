"""Drawing of menus: a column of items with a cursor, a table above, a sentence below."""

from dataclasses import dataclass
from typing import Final

import pygame

from tetris.window import theme
from tetris.window.menu import Item, Menu, Row
from tetris.window.tiles import ThemeChoice

# All in design units: a window 720 high has as many.
_TITLE: Final = 58
_ITEM: Final = 48  # height of a line
_TABLE: Final = 36
_FIRST: Final = 0.07  # of a table's width: its first column, of places
_BELOW: Final = 14  # a table
_FOOT: Final = 94
_MARGIN: Final = 30
_HEIGHT: Final = 720
# All in design units: a window 720 high has as many.
_LETTERS: Final = 30
_VALUE: Final = 27
_CAP: Final = 23  # the letters on keycaps
_EDGE: Final = 18  # from a line's end to what stands on it
_ARROW: Final = 7
_BESIDE: Final = 26  # the place of an arrow
_BAR: Final = 110
_NUMBER: Final = 62  # beside a bar, so that bars stand below each other
_MOST: Final = 0.56  # of a line, for its value


@dataclass(frozen=True, slots=True)
class Spot:
    """Rectangle in which an item was drawn."""

    place: pygame.Rect
    number: int


class MenuView:
    """Draws menus into a rectangle.

    Attributes:
        spots: Where the items were drawn last, for the mouse.
    """

    def __init__(self, look: ThemeChoice) -> None:
        self._look = look
        self._first = 0  # the uppermost item, when not all have room
        self.spots: list[Spot] = []

    def draw(
        self, surface: pygame.Surface, area: pygame.Rect, menu: Menu, selected: int, unit: float
    ) -> None:
        """Draw a menu.

        Args:
            surface: Where to.
            area: The part of it that is the menu's.
            menu: What to draw.
            selected: The number of the chosen item.
            unit: Pixels in a 720th of the window's height.
        """
        palette = self._look.palette
        inner = area.inflate(-2 * round(_MARGIN * unit), 0)
        top = area.top
        if menu.title:
            title = theme.fitted(menu.title, round(_TITLE * unit), palette.text, inner.width)
            surface.blit(title, (inner.left, top))
            top += round(_TITLE * 1.15 * unit)
        if menu.table:
            top = self._draw_table(surface, inner, top, menu, unit)
        foot = pygame.Rect(inner.left, area.bottom, inner.width, round(_foot(menu) * unit))
        foot.bottom = area.bottom
        self._draw_items(surface, area, inner, top, foot.top, menu, selected, unit)
        hint = menu.notice or menu.items[selected].hint
        colour = palette.warn if menu.notice else palette.dim
        self._draw_sentence(surface, foot, hint, colour, unit)

    def height(self, menu: Menu, unit: float) -> int:
        """Return how high a menu is that shows all it has."""
        title = _TITLE * 1.15 if menu.title else 0
        table = len(menu.table) * _TABLE + _BELOW if menu.table else 0
        return round((title + table + len(menu.items) * _ITEM + _foot(menu)) * unit)

    def _draw_items(
        self,
        surface: pygame.Surface,
        area: pygame.Rect,
        inner: pygame.Rect,
        top: int,
        bottom: int,
        menu: Menu,
        selected: int,
        unit: float,
    ) -> None:
        high = round(_ITEM * unit)
        room = max(1, (bottom - top) // high)
        most = max(0, len(menu.items) - room)
        self._first = max(min(self._first, selected, most), selected - room + 1)
        shown = menu.items[self._first : self._first + room]
        self.spots = []
        for place, item in enumerate(shown):
            number = self._first + place
            line = pygame.Rect(inner.left, top + place * high, inner.width, high)
            line.inflate_ip(round(_MARGIN * unit), 0)
            self.spots.append(Spot(line, number))
            draw_item(surface, line, item, number == selected, self._look, unit)
        self._draw_more(surface, area, top, room * high, len(menu.items), room, unit)

    def _draw_more(
        self,
        surface: pygame.Surface,
        area: pygame.Rect,
        top: int,
        height: int,
        count: int,
        room: int,
        unit: float,
    ) -> None:
        """Draw a bar that shows which part of a long menu is seen."""
        if count <= room:
            return
        track = pygame.Rect(area.right - round(8 * unit), top, max(2, round(4 * unit)), height)
        pygame.draw.rect(surface, self._look.palette.line, track, border_radius=track.width)
        thumb = track.copy()
        thumb.height = round(height * room / count)
        thumb.top = top + round(height * self._first / count)
        pygame.draw.rect(surface, self._look.palette.dim, thumb, border_radius=track.width)

    def _draw_table(
        self, surface: pygame.Surface, inner: pygame.Rect, top: int, menu: Menu, unit: float
    ) -> int:
        high = round(_TABLE * unit)
        columns = max(len(row.cells) for row in menu.table)
        # The last item of a long menu is to be seen, so a table gives up its last rows first.
        room = inner.bottom - top - round((_foot(menu) + len(menu.items) * _ITEM + _BELOW) * unit)
        rows = menu.table[: max(1, room // high)]
        for place, row in enumerate(rows):
            line = pygame.Rect(inner.left, top + place * high, inner.width, high)
            self._draw_row(surface, line, row, columns, unit)
        return top + len(rows) * high + round(_BELOW * unit)

    def _draw_row(
        self, surface: pygame.Surface, line: pygame.Rect, row: Row, columns: int, unit: float
    ) -> None:
        """Draw a row: the first cell at the left, the others end where their columns do."""
        palette, size = self._look.palette, round((21 if row.quiet else 25) * unit)
        first = round(line.width * _FIRST) if columns > 2 else 0
        wide = (line.width - first) // max(1, columns - 1)
        for column, words in enumerate(row.cells):
            second = row.quiet or (column == 0 and columns == 2)
            colour = palette.accent if row.marked else palette.dim if second else palette.text
            if len(row.cells) == 1:
                widest = line.width
            else:
                share = 0.9 if first else 0.64 if column == 0 else 0.36
                widest = first if first and column == 0 else max(1, round(wide * share))
            picture = theme.fitted(words, size, colour, widest)
            place = picture.get_rect(midleft=line.midleft)
            if column:
                place.right = line.left + first + column * wide
            surface.blit(picture, place)

    def _draw_sentence(
        self,
        surface: pygame.Surface,
        foot: pygame.Rect,
        sentence: str,
        colour: theme.Colour,
        unit: float,
    ) -> None:
        size = round(22 * unit)
        for row, line in enumerate(wrapped(sentence, size, foot.width)[:3]):
            picture = theme.text(line, size, colour)
            surface.blit(picture, (foot.left, foot.top + round((4 + 24 * row) * unit)))


def _foot(menu: Menu) -> int:
    """Return how high the place for a sentence is, in design units."""
    return _FOOT if menu.notice or any(item.hint for item in menu.items) else 0


def wrapped(sentence: str, size: int, widest: int) -> list[str]:
    """Return a sentence as lines that are not wider than so many pixels."""
    lines: list[str] = []
    for word in sentence.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and theme.font(size).size(longer)[0] <= widest:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def draw_item(
    surface: pygame.Surface,
    line: pygame.Rect,
    item: Item,
    chosen: bool,
    look: ThemeChoice,
    unit: float,
) -> None:
    """Draw an item into its line.

    Args:
        surface: Where to.
        line: Its place.
        item: What to draw.
        chosen: Whether the cursor is on it.
        look: The colours.
        unit: Pixels in a 720th of the window's height.
    """
    palette = look.palette
    if chosen:
        bar = line.inflate(0, -round(4 * unit))
        pygame.draw.rect(surface, palette.raised, bar, border_radius=round(10 * unit))
        mark = pygame.Rect(bar.left, bar.top, round(5 * unit), bar.height)
        pygame.draw.rect(surface, palette.accent, mark, border_radius=round(3 * unit))
    left, right = line.left + round(_EDGE * unit), line.right - round(_EDGE * unit)
    plain = not (item.value or item.caps)
    colour = palette.text if chosen or plain else palette.dim
    place = pygame.Rect(left, line.top, right - left, line.height)
    value = _draw_value(surface, place, item, chosen, look, unit)
    widest = max(1, value - left - round(12 * unit))
    label = theme.fitted(item.label, round(_LETTERS * unit), colour, widest)
    surface.blit(label, label.get_rect(midleft=(left, line.centery)))


def _draw_value(
    surface: pygame.Surface,
    place: pygame.Rect,
    item: Item,
    chosen: bool,
    look: ThemeChoice,
    unit: float,
) -> int:
    """Draw an item's value at the right end of its place; return where it begins."""
    accent, right = look.palette.accent, place.right
    arrow = round(_ARROW * unit)
    if item.step:
        if chosen:
            _draw_arrow(surface, (right - arrow, place.centery), arrow, 1, accent)
        right -= round(_BESIDE * unit)
    widest = round(place.width * _MOST)
    colour = look.palette.text if chosen else look.palette.dim
    if item.caps:
        right = _draw_caps(surface, (right, place.centery), item.caps, colour, look, unit)
    elif item.value:
        value = theme.fitted(item.value, round(_VALUE * unit), colour, widest)
        surface.blit(value, value.get_rect(midright=(right, place.centery)))
        right -= value.get_width() if item.share is None else round(_NUMBER * unit)
    if item.share is not None:
        right = _draw_bar(surface, (right, place.centery), item.share, chosen, look, unit)
    if item.step:
        right -= round(_BESIDE * unit)
        if chosen:
            _draw_arrow(surface, (right + arrow, place.centery), arrow, -1, accent)
    return right


def _draw_caps(
    surface: pygame.Surface,
    end: tuple[int, int],
    caps: tuple[str, ...],
    colour: theme.Colour,
    look: ThemeChoice,
    unit: float,
) -> int:
    """Draw keycaps side by side that end at a point; return where they begin."""
    right, middle = end
    for words in reversed(caps):
        letters = theme.text(words, round(_CAP * unit), colour)
        cap = pygame.Rect(0, 0, 0, round(34 * unit))
        cap.width = max(cap.height, letters.get_width() + round(16 * unit))
        cap.midright = right, middle
        radius = round(6 * unit)
        pygame.draw.rect(surface, look.palette.background, cap, border_radius=radius)
        pygame.draw.rect(surface, look.palette.line, cap, max(1, round(unit)), border_radius=radius)
        surface.blit(letters, letters.get_rect(center=cap.center))
        right = cap.left - round(6 * unit)
    return right


def _draw_bar(
    surface: pygame.Surface,
    end: tuple[int, int],
    share: float,
    chosen: bool,
    look: ThemeChoice,
    unit: float,
) -> int:
    """Draw a bar that ends near a point; return where it begins."""
    high = max(3, round(6 * unit))
    track = pygame.Rect(0, 0, round(_BAR * unit), high)
    track.midright = end[0] - round(10 * unit), end[1]
    left = track.left
    pygame.draw.rect(surface, look.palette.track, track, border_radius=high // 2)
    if share > 0:
        track.width = max(high, round(track.width * share))
        colour = look.palette.accent if chosen else look.palette.dim
        pygame.draw.rect(surface, colour, track, border_radius=high // 2)
    return left


def _draw_arrow(
    surface: pygame.Surface, tip: tuple[int, int], size: int, way: int, colour: theme.Colour
) -> None:
    x, y = tip
    back = x - way * size
    pygame.draw.polygon(surface, colour, ((x, y), (back, y - size), (back, y + size)))
