"""Drawing of menus: a column of items with a cursor, a table above, a sentence below."""

from typing import Final, NamedTuple

import pygame

from tetris.window import theme
from tetris.window.menu import Item, Menu, Row
from tetris.window.theme import Colour
from tetris.window.tiles import ThemeChoice

# All in design units: a window 720 high has as many.
_TITLE: Final = 58
_ITEM: Final = 48  # height of a line
_TABLE: Final = 36
_FIRST: Final = 0.07  # of a table's width: its first column, of places
_BELOW: Final = 14  # a table
_FOOT: Final = 94
_MARGIN: Final = 30
_LETTERS: Final = 30
_VALUE: Final = 27
_CAP: Final = 23  # the letters on keycaps
_EDGE: Final = 18  # from a line's end to what stands on it
_ARROW: Final = 7
_BESIDE: Final = 26  # the place of an arrow
_BAR: Final = 110
_NUMBER: Final = 62  # beside a bar, so that bars stand below each other
_MOST: Final = 0.56  # of a line, for its value


class Spot(NamedTuple):
    """Rectangle in which an item was drawn."""

    place: pygame.Rect
    number: int


class MenuView:
    """Draws menus into a rectangle.

    Attributes:
        spots: Where the items were drawn last, for the mouse.
    """

    def __init__(self, look: ThemeChoice) -> None:
        self._look, self._palette = look, look.palette
        self._first = 0  # the uppermost item, when not all have room
        self._surface, self._unit = pygame.Surface((0, 0)), 1.0  # of the present drawing
        self.spots: list[Spot] = []

    def draw(
        self, surface: pygame.Surface, area: pygame.Rect, menu: Menu, selected: int, unit: float
    ) -> None:
        """Draw a menu into an area; a unit is a 720th of the window's height, in pixels."""
        self._surface, self._unit = surface, unit
        inner = area.inflate(-2 * self._px(_MARGIN), 0)
        top = area.top
        if menu.title:
            size = self._px(_TITLE)
            title = theme.fitted(menu.title, size, self._palette.text, inner.width)
            surface.blit(title, (inner.left, top))
            top += self._px(_TITLE * 1.15)
        if menu.table:
            top = self._draw_table(inner, top, menu)
        foot = pygame.Rect(inner.left, 0, inner.width, self._px(_foot(menu)))
        foot.bottom = area.bottom
        self._draw_items(
            area, pygame.Rect(inner.left, top, inner.width, foot.top - top), menu, selected
        )
        sentence = menu.notice or menu.items[selected].hint
        colour = self._palette.warn if menu.notice else self._palette.dim
        size = self._px(22)
        for row, line in enumerate(wrapped(sentence, size, foot.width)[:3]):
            place = foot.left, foot.top + self._px(4 + 24 * row)
            surface.blit(theme.text(line, size, colour), place)

    def height(self, menu: Menu, unit: float) -> int:
        """Return how high a menu is that shows all it has."""
        title = _TITLE * 1.15 if menu.title else 0
        table = len(menu.table) * _TABLE + _BELOW if menu.table else 0
        return round((title + table + len(menu.items) * _ITEM + _foot(menu)) * unit)

    def _px(self, units: float) -> int:
        return round(units * self._unit)

    def _draw_items(self, area: pygame.Rect, inner: pygame.Rect, menu: Menu, selected: int) -> None:
        high, count = self._px(_ITEM), len(menu.items)
        room = max(1, inner.height // high)
        self._first = max(min(self._first, selected, max(0, count - room)), selected - room + 1)
        self.spots = []
        for place, item in enumerate(menu.items[self._first : self._first + room]):
            line = pygame.Rect(inner.left, inner.top + place * high, inner.width, high)
            line.inflate_ip(self._px(_MARGIN), 0)
            self.spots.append(Spot(line, self._first + place))
            self._draw_item(line, item, self._first + place == selected)
        if count > room:  # a bar shows which part of a long menu is seen
            width = max(2, self._px(4))
            track = pygame.Rect(area.right - self._px(8), inner.top, width, room * high)
            self._draw_rect(self._palette.line, track, width)
            thumb = track.copy()
            thumb.height = round(track.height * room / count)
            thumb.top += round(track.height * self._first / count)
            self._draw_rect(self._palette.dim, thumb, width)

    def _draw_rect(self, colour: Colour, rect: pygame.Rect, radius: int, edge: int = 0) -> None:
        pygame.draw.rect(self._surface, colour, rect, edge, border_radius=radius)

    # -- the table ---------------------------------------------------------------------

    def _draw_table(self, inner: pygame.Rect, top: int, menu: Menu) -> int:
        high = self._px(_TABLE)
        columns = max(len(row.cells) for row in menu.table)
        # The last item of a long menu is to be seen, so a table gives up its last rows first.
        below = self._px(_foot(menu) + len(menu.items) * _ITEM + _BELOW)
        rows = menu.table[: max(1, (inner.bottom - top - below) // high)]
        for place, row in enumerate(rows):
            line = pygame.Rect(inner.left, top + place * high, inner.width, high)
            self._draw_row(line, row, columns)
        return top + len(rows) * high + self._px(_BELOW)

    def _draw_row(self, line: pygame.Rect, row: Row, columns: int) -> None:
        """Draw a row: the first cell at the left, the others end where their columns do."""
        palette, size = self._palette, self._px(21 if row.quiet else 25)
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
            self._surface.blit(picture, place)

    # -- an item -----------------------------------------------------------------------

    def _draw_item(self, line: pygame.Rect, item: Item, chosen: bool) -> None:
        palette = self._palette
        if chosen:
            bar = line.inflate(0, -self._px(4))
            self._draw_rect(palette.raised, bar, self._px(10))
            mark = pygame.Rect(bar.left, bar.top, self._px(5), bar.height)
            self._draw_rect(palette.accent, mark, self._px(3))
        place = line.inflate(-2 * self._px(_EDGE), 0)
        plain = not (item.value or item.caps)
        colour = palette.text if chosen or plain else palette.dim
        widest = max(1, self._draw_value(place, item, chosen) - place.left - self._px(12))
        label = theme.fitted(item.label, self._px(_LETTERS), colour, widest)
        self._surface.blit(label, label.get_rect(midleft=place.midleft))

    def _draw_value(self, place: pygame.Rect, item: Item, chosen: bool) -> int:
        """Draw an item's value at the right end of its place; return where it begins."""
        right, middle, arrow = place.right, place.centery, self._px(_ARROW)
        if item.step:
            if chosen:
                self._draw_arrow(right - arrow, middle, arrow)
            right -= self._px(_BESIDE)
        colour = self._palette.text if chosen else self._palette.dim
        if item.caps:
            right = self._draw_caps(right, middle, item.caps, colour)
        elif item.value:
            widest = round(place.width * _MOST)
            value = theme.fitted(item.value, self._px(_VALUE), colour, widest)
            self._surface.blit(value, value.get_rect(midright=(right, middle)))
            right -= value.get_width() if item.share is None else self._px(_NUMBER)
        if item.share is not None:
            right = self._draw_bar(right, middle, item.share, chosen)
        if item.step:
            right -= self._px(_BESIDE)
            if chosen:
                self._draw_arrow(right + arrow, middle, -arrow)
        return right

    def _draw_caps(self, right: int, middle: int, caps: tuple[str, ...], colour: Colour) -> int:
        """Draw keycaps side by side that end at a point; return where they begin."""
        for words in reversed(caps):
            letters = theme.text(words, self._px(_CAP), colour)
            cap = pygame.Rect(0, 0, 0, self._px(34))
            cap.width = max(cap.height, letters.get_width() + self._px(16))
            cap.midright = right, middle
            self._draw_rect(self._palette.background, cap, self._px(6))
            self._draw_rect(self._palette.line, cap, self._px(6), max(1, self._px(1)))
            self._surface.blit(letters, letters.get_rect(center=cap.center))
            right = cap.left - self._px(6)
        return right

    def _draw_bar(self, right: int, middle: int, share: float, chosen: bool) -> int:
        """Draw a bar that ends near a point; return where it begins."""
        track = pygame.Rect(0, 0, self._px(_BAR), max(3, self._px(6)))
        track.midright = right - self._px(10), middle
        self._draw_rect(self._palette.track, track, track.height // 2)
        if share > 0:
            filled = track.copy()
            filled.width = max(track.height, round(track.width * share))
            colour = self._palette.accent if chosen else self._palette.dim
            self._draw_rect(colour, filled, track.height // 2)
        return track.left

    def _draw_arrow(self, x: int, y: int, size: int) -> None:
        """Draw an arrow to the right, or to the left for a size below 0."""
        back = x - size
        corners = ((x, y), (back, y - size), (back, y + size))
        pygame.draw.polygon(self._surface, self._palette.accent, corners)


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
