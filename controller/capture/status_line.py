"""One line on the screen, for people: what to do now, what is left, what the keys do."""

import os
from collections.abc import Sequence
from math import ceil
from typing import Final, TextIO

from controller.capture.cues import Cue, Phase
from controller.capture.labels import FrameLabels
from controller.recognition.pipeline import Step

_WIDTH: Final = 80  # where the terminal does not say
_NARROWEST: Final = 20


class Status:
    """A line of a terminal that is written again and again; silent where there is no terminal."""

    def __init__(self, stream: TextIO | None) -> None:
        """Write to `stream` if that is a terminal."""
        self._stream = stream if stream is not None and stream.isatty() else None
        self._shown = ""

    def show(self, text: str) -> None:
        """Show a text in place of the last one.

        The cursor goes back to the beginning, so that whatever is printed next covers the line.
        """
        if self._stream is None or text == self._shown:
            return
        width = max(self._width() - 1, _NARROWEST)
        blank = " " * max(min(len(self._shown), width) - len(text), 0)
        self._write(f"\r{text[:width]}{blank}\r")
        self._shown = text

    def clear(self) -> None:
        """Leave an empty line, for whoever writes next."""
        self.show("")

    def _width(self) -> int:
        assert self._stream is not None
        try:
            return os.get_terminal_size(self._stream.fileno()).columns or _WIDTH
        except (OSError, ValueError):
            return _WIDTH

    def _write(self, text: str) -> None:
        assert self._stream is not None
        try:
            self._stream.write(text)
            self._stream.flush()
        except OSError:  # the terminal has gone; the session goes on
            self._stream = None


class StatusLine:
    """The line for every frame of a session."""

    def __init__(self, status: Status, labels: Sequence[str], *, keyboard: bool) -> None:
        """Show on `status`, with what the keys do if there is a keyboard."""
        self._status, self._labels, self._keyboard = status, labels, keyboard

    def show(self, said: FrameLabels, step: Step, problem: str) -> None:
        """Show a frame."""
        line = describe(said, step.t_s, self._labels, keyboard=self._keyboard)
        self._status.show(f"DISK PROBLEM  {line}" if problem else line)

    def clear(self) -> None:
        """Leave an empty line, for whoever writes next."""
        self._status.clear()


def describe(said: FrameLabels, t_s: float, labels: Sequence[str], *, keyboard: bool) -> str:
    """Return the line for one frame."""
    parts = [_clock(t_s)]
    if said.excluded:
        parts.append("PAUSED, space goes on")
    elif said.asked is not None:
        parts.append(_asks(said.asked))
    if said.key > 0:
        parts.append(f"key: {labels[said.key]}")
    if said.asked is not None and said.asked.phase is not Phase.WAIT:
        parts.append(_wants(said.asked))
    elif keyboard and said.asked is None and not said.excluded:
        parts.append(_help(labels))
    return "  ".join(parts)


def _clock(t_s: float) -> str:
    return f"{int(t_s) // 60}:{int(t_s) % 60:02}"


def _asks(cue: Cue) -> str:
    """Return what to do."""
    match cue.phase:
        case Phase.WAIT:
            return "hands off: the sensor finds its rest"
        case Phase.DONE:
            return "done"
        case Phase.REST:
            return "rest"
    place = "" if cue.place is None else f" at {cue.place[0]:g},{cue.place[1]:g}"
    act = cue.label.upper() if cue.phase is Phase.GO else cue.label
    return f"{cue.phase.value}: {act}{place} {ceil(cue.left_s)} s"


def _wants(cue: Cue) -> str:
    """Return how many examples are left, and of what there is enough."""
    more = ", ".join(f"{label} {count}" for label, count in cue.more.items() if count)
    enough = ", ".join(label for label, count in cue.more.items() if not count)
    return f"{cue.left} left" + f" ({more})" * bool(more) + f", enough {enough}" * bool(enough)


def _help(labels: Sequence[str]) -> str:
    held = ", ".join(f"{i} {label}" for i, label in enumerate(labels[1:10], 1))
    return f"hold {held}; space pauses, backspace drops"
