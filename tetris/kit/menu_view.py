"""Drawing of menus: a column of items with a cursor, a table above, a sentence below."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import pygame

from tetris.kit import theme
from tetris.kit.menu import Item, Menu, Row
from tetris.kit.settings import Look
from tetris.kit.theme import Colour

# All in design units: a window 720 high has as many.
_TITLE: Final = 58
_ITEM: Final = 48  # height of a line
_TABLE: Final = 36
_BETWEEN: Final = 12  # columns of a table, at least
_BELOW: Final = 14  # a table
_FOOT: Final = 94
_SENTENCE: Final = 22
_MARGIN: Final = 30
_LETTERS: Final = 30
_VALUE: Final = 27
_CAP: Final = 23  # the letters on keycaps
_EDGE: Final = 18  # from a line's end to what stands on it
_ARROW: Final = 7
_BESIDE: Final = 26  # the place of an arrow
_BAR: Final = 110
_NUMBER: Final = 62  # beside a bar, so that bars stand below each other
_LEAST_TARGET: Final = 24  # pixels: what a pointer can hit, WCAG 2.5.8
_MOST: Final = 0.64  # of a line, for its value


class Spot(NamedTuple):
    """Rectangle in which an item was drawn."""

    place: pygame.Rect
    number: int
    arrows: tuple[pygame.Rect, ...] = ()  # where a click turns the value back, and on


class MenuView:
    """Draws menus into a rectangle.

    Attributes:
        spots: Where the items were drawn last, for the mouse.
    """

    def __init__(self, look: Look) -> None:
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
        foot = pygame.Rect(inner.left, 0, inner.width, self._foot(menu))
        foot.bottom = area.bottom
        if menu.table:
            top = self._draw_table(inner, top, menu, foot.height)
        if foot.top - top < 2 * self._high:  # what is chosen matters more than what is said of it
            foot.top = foot.bottom
        room = pygame.Rect(inner.left, top, inner.width, foot.top - top)
        items = menu.items[: len(menu.items) - menu.corner]
        self._draw_items(area, room, items, selected)
        if menu.corner:
            self._draw_corner(inner, area.top, menu, selected)
        self._draw_sentence(foot, menu, selected)

    def height(self, menu: Menu, unit: float) -> int:
        """Return how high a menu is that shows all it has."""
        self._unit = unit
        title = self._px(_TITLE * 1.15) if menu.title else 0
        table = len(menu.table) * self._row + self._px(_BELOW) if menu.table else 0
        return title + table + (len(menu.items) - menu.corner) * self._high + self._foot(menu)

    @property
    def _high(self) -> int:
        """Height of an item; its letters are not smaller than the least that can be read."""
        return max(self._px(_ITEM), theme.font(self._px(_LETTERS)).get_linesize() + 2)

    @property
    def _row(self) -> int:
        return max(self._px(_TABLE), theme.font(self._px(25)).get_linesize())

    @property
    def _line(self) -> int:
        size = self._px(_SENTENCE)
        return max(self._px(_SENTENCE + 2), theme.font(size).get_linesize())

    def _foot(self, menu: Menu) -> int:
        if menu.notice or any(item.hint for item in menu.items):
            return max(self._px(_FOOT), 3 * self._line + self._px(4))
        return 0

    def _draw_sentence(self, foot: pygame.Rect, menu: Menu, selected: int) -> None:
        sentence = menu.notice or menu.items[selected].hint
        colour = self._palette.warn if menu.notice else self._palette.dim
        size = self._px(_SENTENCE)
        most = max(0, foot.height // self._line)
        for row, line in enumerate(wrapped(sentence, size, foot.width)[:most]):
            picture = theme.fitted(line, size, colour, foot.width)
            self._surface.blit(picture, (foot.left, foot.top + self._px(4) + row * self._line))

    def _px(self, units: float) -> int:
        return round(units * self._unit)

    def _draw_corner(self, inner: pygame.Rect, top: int, menu: Menu, selected: int) -> None:
        """Draw the last item at the right end of the title's line."""
        number, item = len(menu.items) - 1, menu.items[-1]
        wide = theme.font(self._px(_LETTERS)).size(item.label)[0] + 2 * self._px(_EDGE + 7)
        line = pygame.Rect(inner.right + self._px(_MARGIN) // 2 - wide, top, wide, self._high)
        self.spots.append(Spot(line, number, self._draw_item(line, item, number == selected)))

    def _draw_items(
        self, area: pygame.Rect, inner: pygame.Rect, items: Sequence[Item], selected: int
    ) -> None:
        high, count = self._high, len(items)
        least = max(_LEAST_TARGET, theme.font(self._px(_LETTERS)).get_linesize())
        if least * count <= inner.height < high * count:
            high = inner.height // count
        room = max(1, inner.height // high)
        top = min(selected, count - 1)
        self._first = max(min(self._first, top, max(0, count - room)), top - room + 1)
        self.spots = []
        for place, item in enumerate(items[self._first : self._first + room]):
            line = pygame.Rect(inner.left, inner.top + place * high, inner.width, high)
            line.inflate_ip(self._px(_MARGIN), 0)
            number = self._first + place
            self.spots.append(Spot(line, number, self._draw_item(line, item, number == selected)))
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

    def _draw_table(self, inner: pygame.Rect, top: int, menu: Menu, foot: int) -> int:
        high = self._row
        # The last item of a long menu is to be seen, so a table gives up its last rows first.
        below = foot + len(menu.items) * self._high + self._px(_BELOW)
        rows = menu.table[: max(1, (inner.bottom - top - below) // high)]
        widths = self._widths(menu.table, inner.width)
        for place, row in enumerate(rows):
            line = pygame.Rect(inner.left, top + place * high, inner.width, high)
            self._draw_row(line, row, widths if len(row.cells) > 1 else [inner.width])
        return top + len(rows) * high + self._px(_BELOW)

    def _widths(self, rows: Sequence[Row], whole: int) -> list[int]:
        """Return the widths of columns: what their cells need, or their share of what there is."""
        cells = [
            [theme.font(self._letters(row)).size(cell)[0] for cell in row.cells]
            for row in rows
            if len(row.cells) > 1
        ]
        needed = [max(column) for column in zip(*cells, strict=True)]
        gap = self._px(_BETWEEN)
        share = min(1.0, (whole - gap * (len(needed) - 1)) / max(1, sum(needed)))
        return [max(1, int(width * share)) for width in needed]

    def _letters(self, row: Row) -> int:
        return self._px(21 if row.quiet else 25)

    def _draw_row(self, line: pygame.Rect, row: Row, widths: Sequence[int]) -> None:
        """Draw a row: the first cell at the left, the others end where their columns do."""
        palette, left = self._palette, float(line.left)
        gap = (line.width - sum(widths)) / max(1, len(widths) - 1)
        for column, (words, width) in enumerate(zip(row.cells, widths, strict=True)):
            second = row.quiet or (column == 0 and len(widths) == 2)
            colour = palette.accent if row.marked else palette.dim if second else palette.text
            picture = theme.fitted(words, self._letters(row), colour, width)
            place = picture.get_rect(midleft=(round(left), line.centery))
            if column:
                place.right = round(left + width)
            self._surface.blit(picture, place)
            left += width + gap

    # -- an item -----------------------------------------------------------------------

    def _draw_item(self, line: pygame.Rect, item: Item, chosen: bool) -> tuple[pygame.Rect, ...]:
        palette = self._palette
        if chosen:
            bar = line.inflate(0, -self._px(4))
            self._draw_rect(palette.raised, bar, self._px(10))
            mark = pygame.Rect(bar.left, bar.top, self._px(5), bar.height)
            self._draw_rect(palette.accent, mark, self._px(3))
        place = line.inflate(-2 * self._px(_EDGE), 0)
        begin = self._draw_value(place, item)
        widest = max(1, begin - place.left - self._px(12))
        label = theme.fitted(item.label, self._px(_LETTERS), palette.text, widest)
        self._surface.blit(label, label.get_rect(midleft=place.midleft))
        if not item.step:
            return ()
        arrow = pygame.Rect(0, line.top, max(_LEAST_TARGET, self._px(1.6 * _BESIDE)), line.height)
        back, on = arrow.copy(), arrow
        back.centerx, on.right = begin + self._px(_ARROW), line.right
        return back, on

    def _draw_value(self, place: pygame.Rect, item: Item) -> int:
        """Draw an item's value at the right end of its place; return where it begins.

        What can be changed stands between arrows, in the colour of text.
        """
        right, middle, arrow = place.right, place.centery, self._px(_ARROW)
        if item.step:
            self._draw_arrow(right - arrow, middle, arrow)
            right -= self._px(_BESIDE)
        colour = self._palette.text if item.step or item.caps else self._palette.dim
        if item.caps:
            right = self._draw_caps(right, middle, item.caps, colour)
        elif words := item.late() if item.late else item.value:
            room = place.width - self._px(12 + 2 * _BESIDE * bool(item.step))
            widest = round(room * _MOST)
            value = theme.fitted(words, self._px(_VALUE), colour, widest)
            self._surface.blit(value, value.get_rect(midright=(right, middle)))
            right -= value.get_width() if item.share is None else self._px(_NUMBER)
        if item.share is not None:
            right = self._draw_bar(right, middle, item.share)
        if item.step:
            right -= self._px(_BESIDE)
            self._draw_arrow(right + arrow, middle, -arrow)
        return right

    def _draw_caps(self, right: int, middle: int, caps: tuple[str, ...], colour: Colour) -> int:
        """Draw keycaps side by side that end at a point; return where they begin."""
        for words in reversed(caps):
            letters = theme.text(words, self._px(_CAP), colour)
            cap = pygame.Rect(0, 0, 0, max(self._px(34), letters.get_height()))
            cap.width = max(cap.height, letters.get_width() + self._px(16))
            cap.midright = right, middle
            self._draw_rect(self._palette.background, cap, self._px(6))
            self._draw_rect(self._palette.line, cap, self._px(6), max(1, self._px(1)))
            self._surface.blit(letters, letters.get_rect(center=cap.center))
            right = cap.left - self._px(6)
        return right

    def _draw_bar(self, right: int, middle: int, share: float) -> int:
        """Draw a bar that ends near a point; return where it begins."""
        track = pygame.Rect(0, 0, self._px(_BAR), max(3, self._px(6)))
        track.midright = right - self._px(10), middle
        theme.draw_bar(self._surface, self._palette, track, share)
        return track.left

    def _draw_arrow(self, x: int, y: int, size: int) -> None:
        """Draw an arrow to the right, or to the left for a size below 0."""
        back = x - size
        corners = ((x, y), (back, y - size), (back, y + size))
        pygame.draw.polygon(self._surface, self._palette.accent, corners)


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
