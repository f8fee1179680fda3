"""Drawings as inline SVG: scales, axes and marks, coloured by the page's style sheet."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

Point = tuple[float, float]
Words = Callable[[float], str]

LINE_PX: Final = 15.0  # least distance of two labels, one under the other


@dataclass(frozen=True, slots=True)
class Scale:
    """From values to pixels.

    Attributes:
        low: Value at the first pixel.
        high: Value at the last.
        first: That pixel.
        last: Likewise.
        log: Equal factors are equally long.
    """

    low: float
    high: float
    first: float
    last: float
    log: bool = False

    def __call__(self, value: float) -> float:
        """Return the pixel of a value; what lies outside stays at the edge."""
        if self.log:
            low, high, value = (math.log(max(v, 1e-12)) for v in (self.low, self.high, value))
        else:
            low, high = self.low, self.high
        part = (value - low) / ((high - low) or 1.0)
        return self.first + min(1.0, max(0.0, part)) * (self.last - self.first)

    def ticks(self, about: int = 5) -> list[float]:
        """Return round values along it."""
        if self.log:
            decades = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
            steps = (1, 2, 5) if len(decades) < 5 else (1,)
            every = [step * 10.0**decade for decade in decades for step in steps]
            return [v for v in every if self.low * 0.999 <= v <= self.high * 1.001]
        step = _round_step((self.high - self.low) / about)
        start = math.ceil(self.low / step - 1e-9)
        end = math.floor(self.high / step + 1e-9)
        return [round(i * step, 10) for i in range(start, end + 1)]


def _round_step(rough: float) -> float:
    """Return a step of 1, 2 or 5 that is no smaller."""
    power = 10.0 ** math.floor(math.log10(rough)) if rough > 0 else 1.0
    return next(step * power for step in (1, 2, 5, 10) if step * power >= rough * 0.999)


def fitted(
    values: Iterable[float], *, least: float = 0.0, room: float = 0.06
) -> tuple[float, float]:
    """Return a range around all values that are numbers.

    Args:
        values: What will be shown.
        least: The range is no shorter.
        room: Left at either end, as a share of it.
    """
    known = [value for value in values if math.isfinite(value)] or [0.0, 1.0]
    low, high = min(known), max(known)
    spare = max(least - (high - low), 0.0) / 2.0 + room * max(high - low, least)
    return low - spare, high + spare


class Plot:
    """One drawing with axes; marks are added, then it is closed with `svg`."""

    def __init__(
        self,
        size: tuple[float, float],
        x: tuple[float, float],
        y: tuple[float, float],
        *,
        margins: tuple[float, float, float, float] = (26, 96, 40, 58),
        log_x: bool = False,
        log_y: bool = False,
    ) -> None:
        """Lay it out.

        Args:
            size: Width and height, pixels.
            x: Range of the values to the right.
            y: Range of the values upwards.
            margins: Top, right, bottom, left, pixels.
            log_x: Equal factors are equally long.
            log_y: Likewise upwards.
        """
        self.width, self.height = size
        top, right, bottom, left = margins
        self.x = Scale(*x, left, self.width - right, log_x)
        self.y = Scale(*y, self.height - bottom, top, log_y)
        self._marks: list[str] = []

    def axes(self, x_title: str, y_title: str, x_words: Words, y_words: Words) -> None:
        """Draw the grid, its values, and what they are."""
        left, right, bottom, top = self.x.first, self.x.last, self.y.first, self.y.last
        for value in self.y.ticks():
            y = self.y(value)
            self.line((left, y), (right, y), "grid")
            self.text((left - 8, y + 4), y_words(value), "tick end")
        for value in self.x.ticks():
            self.text((self.x(value), bottom + 17), x_words(value), "tick mid")
        self.line((left, bottom), (right, bottom), "axis")
        self.text(((left + right) / 2, bottom + 34), x_title, "title mid")
        self.text((2, top - 12), y_title, "title")

    def at(self, point: Point) -> Point:
        """Return the pixel of a pair of values."""
        return self.x(point[0]), self.y(point[1])

    def path(self, points: Iterable[Point], kind: str) -> None:
        """Draw a line through values; one that is no number interrupts it."""
        pen, drawn = "M", []
        for point in points:
            if not all(math.isfinite(value) for value in point):
                pen = "M"
                continue
            x, y = self.at(point)
            drawn.append(f"{pen}{x:.1f},{y:.1f}")
            pen = "L"
        if drawn:
            self._marks.append(f'<path class="{kind}" d="{"".join(drawn)}"/>')

    def dot(self, point: Point, kind: str, radius: float = 4.0, says: str = "") -> None:
        """Draw a dot at values; it says something under the mouse."""
        if all(math.isfinite(value) for value in point):
            x, y = self.at(point)
            self.circle((x, y), radius, kind, says)

    def circle(self, at: Point, radius: float, kind: str, says: str = "") -> None:
        """Draw a dot at pixels."""
        title = f"<title>{escape(says)}</title>" if says else ""
        self._marks.append(
            f'<circle class="{kind}" cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius:.1f}">{title}'
            "</circle>"
        )

    def box(self, corner: Point, size: Point, kind: str, *, strength: float = 1.0) -> None:
        """Draw a box at pixels: its upper left corner, its width and height."""
        self._marks.append(
            f'<rect class="{kind}" x="{corner[0]:.1f}" y="{corner[1]:.1f}" width="{size[0]:.1f}" '
            f'height="{size[1]:.1f}" rx="3" style="opacity:{strength:.2f}"/>'
        )

    def line(self, begin: Point, end: Point, kind: str) -> None:
        """Draw a line between pixels."""
        self._marks.append(
            f'<line class="{kind}" x1="{begin[0]:.1f}" y1="{begin[1]:.1f}" x2="{end[0]:.1f}" '
            f'y2="{end[1]:.1f}"/>'
        )

    def text(self, at: Point, text: str, kind: str) -> None:
        """Write at pixels."""
        self._marks.append(
            f'<text class="{kind}" x="{at[0]:.1f}" y="{at[1]:.1f}">{escape(text)}</text>'
        )

    def ends(self, labels: Sequence[tuple[float, str, str]]) -> None:
        """Write beside the ends of lines, none over another.

        Args:
            labels: Value, text and kind of each.
        """
        known = sorted(
            ((self.y(value), text, kind) for value, text, kind in labels if math.isfinite(value)),
        )
        last = self.y.last - LINE_PX
        for y, text, kind in known:
            last = max(y, last + LINE_PX)
            self.text((self.x.last + 8, last + 4), text, kind)

    def svg(self, says: str) -> str:
        """Return the drawing.

        Args:
            says: What it shows, for who cannot see it.
        """
        return (
            f'<svg viewBox="0 0 {self.width:.0f} {self.height:.0f}" role="img" '
            f'style="max-width:{self.width:.0f}px" aria-label="{escape(says)}">'
            f"{''.join(self._marks)}</svg>"
        )
