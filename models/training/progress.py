"""Progress of a training: one line that is redrawn on a terminal, else a line an epoch."""

import math
import time
from collections.abc import Callable, Sequence
from typing import Final, TextIO

from models.results.training import Epoch

BLOCKS: Final = "▁▂▃▄▅▆▇█"
LENGTH: Final = 24  # characters of a curve
_REFRESH_S: Final = 0.3
_CLEAR: Final = "\r\x1b[2K"

Describe = Callable[[Epoch], str]  # an epoch's scores in words
Watch = Callable[[list[Epoch], float], None]  # epochs so far, and the share done of the next one


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
    describe: Describe,
    stream: TextIO,
    now: Callable[[], float] = time.monotonic,
) -> Watch:
    """Return a function that shows a network's progress on a stream.

    Args:
        name: Of the network.
        passes: Epochs at most.
        describe: Returns an epoch's scores in words.
        stream: A terminal shows a growing curve, anything else a line an epoch.
        now: The time, seconds.
    """
    live = stream.isatty()
    began, seen, drawn = now(), -1, -math.inf

    def show(epochs: list[Epoch], share: float) -> None:
        nonlocal seen, drawn
        if seen < 0:
            seen = len(epochs) if share else len(epochs) - 1
        done = len(epochs) > seen and not share
        seen = len(epochs) if done else seen
        text = describe(epochs[-1]) if epochs else "begins"
        if done and not live:
            stream.write(f"{name} epoch {len(epochs)}/{passes}: {text}\n")
            stream.flush()
        elif live and (done or now() - drawn > _REFRESH_S):
            drawn = now()
            minutes, seconds = divmod(int(drawn - began), 60)
            curve = sparkline([e.check_loss for e in epochs]) or sparkline([e.loss for e in epochs])
            line = f"{name} {len(epochs) + share:.1f}/{passes} {curve} {text} · "
            end = "\n" if done and len(epochs) >= passes else ""
            stream.write(f"{_CLEAR}{line}{minutes}:{seconds:02d}{end}")
            stream.flush()

    return show
