"""Progress of a training: one line that is redrawn on a terminal, else a line an epoch."""

import math
import time
from collections.abc import Callable
from typing import Final, TextIO

from models.results.training import Epoch

REFRESH_S: Final = 0.3
_CLEAR: Final = "\r\x1b[2K"

Describe = Callable[[Epoch], str]  # an epoch's scores in words
Watch = Callable[[list[Epoch], float], None]  # epochs so far, and the share done of the next one


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
        stream: On a terminal one line is redrawn, anything else gets a line an epoch.
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
            print(f"{name} epoch {len(epochs)}/{passes}: {text}", file=stream, flush=True)
        elif live and (done or now() - drawn > REFRESH_S):
            drawn = now()
            minutes, seconds = divmod(int(drawn - began), 60)
            line = f"{name} {len(epochs) + share:.1f}/{passes} {text} · {minutes}:{seconds:02d}"
            end = "\n" if done and len(epochs) >= passes else ""
            print(_CLEAR + line, file=stream, end=end, flush=True)

    return show
