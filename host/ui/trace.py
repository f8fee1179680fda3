"""Drawing of measurements: the deviation of the last seconds, and the latency of frames."""

from collections.abc import Sequence

import pygame

from controller.protocol.messages import StageTime
from host.ui.orb_state import TRACE_S
from host.ui.sprites import SpriteScale
from tetris.window.language import Words

_LEAST = 0.08  # deviation of the highest point drawn, where all are lower


def draw_trace(
    surface: pygame.Surface,
    rect: pygame.Rect,
    unit: SpriteScale,
    trace: Sequence[tuple[float, float]],
    now_s: float,
) -> None:
    """Draw points (seconds, root mean square of z - 1) of the last `TRACE_S` seconds."""
    pygame.draw.line(surface, unit.palette.line, rect.bottomleft, rect.bottomright)
    if len(trace) < 2:
        return
    high = max(_LEAST, max(value for _, value in trace))
    points = [
        (
            rect.right - (now_s - at_s) / TRACE_S * rect.width,
            rect.bottom - value / high * rect.height,
        )
        for at_s, value in trace
    ]
    pygame.draw.aalines(surface, unit.palette.cool, False, points)


def draw_hops(
    surface: pygame.Surface,
    rect: pygame.Rect,
    unit: SpriteScale,
    words: Words,
    hops: Sequence[StageTime],
) -> None:
    """Draw a line a stage: its name, and the latency of 50, 95 and 99 of 100 frames, ms."""
    top, step = rect.top, round(unit.size(18) * 1.1)
    for hop in hops:
        if top + step > rect.bottom:
            return
        figures = f"{hop.p50_ms:.0f} / {hop.p95_ms:.0f} / {hop.p99_ms:.0f} ms"
        value = unit.text(figures, 18, None, rect.width)
        room = rect.width - value.get_width() - unit.px(8)
        name = unit.text(words(f"dome.hop.{hop.name}"), 18, unit.palette.dim, max(0, room))
        surface.blit(name, (rect.left, top))
        surface.blit(value, value.get_rect(topright=(rect.right, top)))
        top += step
