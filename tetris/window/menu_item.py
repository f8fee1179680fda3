"""Drawing of one line of a menu: its label, and its value as words, keycaps or a bar."""

from typing import Final

import pygame

from tetris.window import theme
from tetris.window.menu import Item
from tetris.window.theme_choice import ThemeChoice

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
