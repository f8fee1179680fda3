"""Progress of a training on a terminal: one line that renews itself, or a line an epoch."""

import math
import time
from collections.abc import Callable, Sequence
from typing import Final, TextIO

from models.results.training import Epoch
from models.training.loop import Watch

BLOCKS: Final = "▁▂▃▄▅▆▇█"
LENGTH: Final = 24  # characters of a curve
_REFRESH_S: Final = 0.3
_CLEAR: Final = "\r\x1b[2K"

Words = Callable[[Epoch], str]  # what to say of an epoch


def sparkline(values: Sequence[float], length: int = LENGTH) -> str:
    """Return numbers as a row of blocks, the smallest lowest; gaps where one is no number.

    Args:
        values: In order; more than `length` are thinned out, the last one stays.
        length: Most characters.
    """
    if len(values) > length:
        step = (len(values) - 1) / (length - 1)
        values = [values[round(i * step)] for i in range(length)]
    known = [value for value in values if math.isfinite(value)]
    if not known:
        return ""
    low, high = min(known), max(known)
    width = (high - low) or 1.0
    top = len(BLOCKS) - 1
    return "".join(
        BLOCKS[round((value - low) / width * top)] if math.isfinite(value) else " "
        for value in values
    )


def watch(
    name: str,
    passes: int,
    words: Words,
    stream: TextIO,
    now: Callable[[], float] = time.monotonic,
) -> Watch:
    """Return what shows a network's progress on a stream.

    Args:
        name: Of the network.
        passes: Epochs at most.
        words: What to say of an epoch.
        stream: A terminal gets curves that grow; anything else a line an epoch.
        now: The time, seconds.
    """
    live = stream.isatty()
    began, seen, drawn = now(), -1, -math.inf

    def show(epochs: list[Epoch], share: float) -> None:
        nonlocal seen, drawn
        if seen < 0:
            seen = len(epochs) if share else len(epochs) - 1
        done = len(epochs) > seen and not share
        if live and (done or now() - drawn > _REFRESH_S):
            drawn = now()
            stream.write(_CLEAR + _line(name, epochs, share, passes, words, drawn - began))
            stream.flush()
        elif done and not live:
            stream.write(f"{name} epoch {len(epochs)}/{passes}: {words(epochs[-1])}\n")
            stream.flush()
        if done:
            seen = len(epochs)
            if live and len(epochs) >= passes:
                stream.write("\n")

    return show


def _line(
    name: str,
    epochs: list[Epoch],
    share: float,
    passes: int,
    words: Words,
    spent_s: float,
) -> str:
    """Return one line about a training under way."""
    curve = sparkline([epoch.check_loss for epoch in epochs] or [epoch.loss for epoch in epochs])
    text = words(epochs[-1]) if epochs else "begins"
    return f"{name} {len(epochs) + share:.1f}/{passes} {curve} {text} · {_duration(spent_s)}"


def _duration(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
