"""Base of the page of one gesture: pictures of touches, all gestures, and what a lesson cost."""

from collections.abc import Sequence
from typing import Final

import pygame

from controller.shared.protocol.teaching import LessonCost
from host.app.screens.teach.page import Course, TeachPage
from host.app.traces import Trace
from host.ui import naming
from tetris.kit import theme

_TRIES: Final = 7  # the newest
_LEAST_PX: Final = 26  # height of a gesture: two lines of letters
_CARDS: Final = 0.42  # of the height beside the items, for all gestures
_LATER_S: Final = 0.03  # a smaller change of latency is not mentioned


class PicturePage(TeachPage):
    """Draws touches and gestures."""

    def __init__(self, course: Course, label: str) -> None:
        """Draw what belongs to a gesture."""
        self._label = label
        super().__init__(course)

    def draw_dome(
        self,
        surface: pygame.Surface,
        at: tuple[int, int],
        radius: int,
        image: bytes,
        trace: Trace | None,
        words: str,
    ) -> pygame.Rect:
        """Draw a dome below a point with heat map, path and words; return its place."""
        picture = self.thumbnail(image, max(6, radius) / self._stage.unit)
        place = picture.get_rect(midtop=at)
        surface.blit(picture, place)
        pad, palette = self.orb.state.pad, self._stage.look.palette
        step = place.width / 2 / pad.radius
        points = [
            (place.centerx + (x - pad.centre[0]) * step, place.centery - (y - pad.centre[1]) * step)
            for x, y in (trace.path if trace else ())
        ]
        if len(points) > 1:
            line = max(2, place.width // 30)
            pygame.draw.lines(surface, palette.flash, False, points, line)
            pygame.draw.circle(surface, palette.flash, points[-1], 2 * line)
        self.write(surface, words, 22, place.midbottom, 3 * radius, dim=True)
        return place

    def draw_tries(
        self, surface: pygame.Surface, room: pygame.Rect, heard: Sequence[tuple[str, str]]
    ) -> None:
        """Draw the newest tries: what was meant, and what was understood."""
        high = self.px(34)
        rows = [(self.words("teach.meant"), self.words("teach.understood"), True)]
        for pair in heard[: -_TRIES - 1 : -1]:
            meant, understood = (naming.gesture(self.words, label) for label in pair)
            rows.append((meant, understood, pair[0] != pair[1]))
        for number, (meant, understood, dim) in enumerate(rows[: max(1, room.height // high)]):
            top, half = room.top + number * high, room.width // 2
            for column, words in enumerate((meant, understood)):
                at = room.left + round((column + 0.5) * half), top
                self.write(surface, words, 24, at, half - self.px(8), dim=dim)

    @property
    def costs(self) -> list[LessonCost]:
        """What the last lesson made of all gestures; [] while that is measured."""
        return [one for one in self.lessons.costs.values() if one.taught == self._label]

    def draw_cards(self, surface: pygame.Surface, side: pygame.Rect, *, learned: bool) -> int:
        """Draw a line for each gesture at the lower end; return where they begin."""
        infos = [*self.orb.state.gestures.values()]
        high = min(max(self.px(40), _LEAST_PX), round(_CARDS * side.height) // max(1, len(infos)))
        top, words = side.bottom - high * len(infos), self.words
        costs = {one.label: one for one in self.costs}
        for number, info in enumerate(infos):
            line = pygame.Rect(side.left, top + number * high, side.width, high)
            picture = self.thumbnail(info.image, (high // 2 - 2) / self._stage.unit)
            surface.blit(picture, picture.get_rect(midleft=line.midleft))
            said = self._cost(costs[info.label]) if info.label in costs else []
            if learned and not costs and not number:
                said = [words("teach.measuring")]
            at = line.left + high + self.px(6), line.centery
            own = info.label == self._label
            room = 0.4 * line.width if said else line.right - at[0]
            name = self._fitted(naming.gesture(words, info.label), 22, room, lit=own)
            surface.blit(name, name.get_rect(midleft=at))
            for row, text in enumerate(said):
                size = 20 if len(said) == 1 else 17
                lit = own or len(said) > 1
                cost = self._fitted(text, size, 0.6 * line.width - high, lit=lit)
                middle = line.top + round((row + 0.5) * high / len(said))
                surface.blit(cost, cost.get_rect(midright=(line.right, middle)))
        return top

    def _fitted(self, words: str, size: int, widest: float, *, lit: bool) -> pygame.Surface:
        palette = self._stage.look.palette
        colour = palette.accent if lit else palette.dim
        return theme.fitted(words, self.px(size), colour, int(widest))

    def _cost(self, one: LessonCost) -> list[str]:
        """Return what a gesture became, and by how much it comes later."""
        hits, latency_s = (one.now, one.now_s) if self.lessons.waits else (one.eager, one.eager_s)
        words = self.words
        said = [words("teach.of", count=hits, tries=one.of)]
        if not one.before or not hits:
            return said
        if one.before != hits:
            said = [words("teach.before", count=hits, tries=one.of, before=one.before)]
        later_s = latency_s - one.before_s
        if abs(later_s) >= _LATER_S:
            key = "later" if later_s > 0 else "sooner"
            said.append(words(f"teach.{key}", seconds=words.number(abs(later_s), ".2f")))
        return said
