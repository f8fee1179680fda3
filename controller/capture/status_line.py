"""Status line of a recording session on a terminal: instruction, progress and keys."""

import os
from collections.abc import Sequence
from contextlib import suppress
from math import ceil
from typing import Final, TextIO

from controller.capture.cues import Cue, Phase
from controller.capture.labels import FrameLabels
from controller.recognition.pipeline import Step

_SIZE: Final = (80, 24)  # columns and lines of a terminal of unknown size
_SMALLEST: Final = (20, 4)
_WAITING: Final = {
    Phase.WAIT: "hands off: the sensor finds its rest",
    Phase.DONE: "done",
    Phase.REST: "rest",
}


class Display:
    """A display of a recording session; this base class shows nothing."""

    def show(self, said: FrameLabels, step: Step, problem: str) -> None:
        """Show a frame, and a problem of the disk, "" if there is none."""

    def clear(self) -> None:
        """Clear the display before other output."""


class TerminalDisplay(Display):
    """A display on a terminal, which may go away."""

    def __init__(self, stream: TextIO | None) -> None:
        """Write to `stream`, if there is one."""
        self._stream = stream

    def size(self) -> tuple[int, int]:
        """Return columns and lines of the terminal."""
        width, height = 0, 0
        if self._stream is not None:
            with suppress(OSError, ValueError):
                width, height = os.get_terminal_size(self._stream.fileno())
        return max(width or _SIZE[0], _SMALLEST[0]), max(height or _SIZE[1], _SMALLEST[1])

    def emit(self, text: str) -> None:
        """Write a text at once; if the terminal has gone, the session goes on."""
        if self._stream is None:
            return
        try:
            self._stream.write(text)
            self._stream.flush()
        except OSError:
            self._stream = None


class StatusLine(TerminalDisplay):
    """A line of a terminal that is overwritten; silent where there is no terminal."""

    def __init__(self, stream: TextIO | None, labels: Sequence[str], *, keyboard: bool) -> None:
        """Write to `stream` if that is a terminal; explain the keys if there is a keyboard."""
        super().__init__(stream if stream is not None and stream.isatty() else None)
        self._labels, self._keyboard = labels, keyboard
        self._shown = ""

    def show(self, said: FrameLabels, step: Step, problem: str) -> None:
        """Show a frame."""
        line = describe(said, step.t_s, self._labels, keyboard=self._keyboard)
        self.write(f"DISK PROBLEM  {line}" if problem else line)

    def clear(self) -> None:
        """Leave an empty line."""
        self.write("")

    def write(self, text: str) -> None:
        """Overwrite the last text; the cursor returns to the beginning of the line."""
        if self._stream is None or text == self._shown:
            return
        width = max(self.size()[0] - 1, _SMALLEST[0])
        blank = " " * max(min(len(self._shown), width) - len(text), 0)
        self._shown = text
        self.emit(f"\r{text[:width]}{blank}\r")


def describe(said: FrameLabels, t_s: float, labels: Sequence[str], *, keyboard: bool) -> str:
    """Return the line for one frame at `t_s`."""
    cue = said.asked
    parts = [f"{int(t_s) // 60}:{int(t_s) % 60:02}"]
    if said.excluded:
        parts.append("PAUSED, space goes on")
    elif cue is not None:
        parts.append(_instruction(cue))
    if said.key > 0:
        parts.append(f"key: {labels[said.key]}")
    if cue is not None and cue.phase is not Phase.WAIT:
        parts.append(_progress(cue))
    elif keyboard and cue is None and not said.excluded:
        held = ", ".join(f"{i} {label}" for i, label in enumerate(labels[1:10], 1))
        parts.append(f"hold {held}; space pauses, backspace drops")
    return "  ".join(parts)


def _instruction(cue: Cue) -> str:
    """Return the instruction of a cue."""
    if cue.phase in _WAITING:
        return _WAITING[cue.phase]
    place = "" if cue.place is None else f" at {cue.place[0]:g},{cue.place[1]:g}"
    label = cue.label.upper() if cue.phase is Phase.GO else cue.label
    return f"{cue.phase.value}: {label}{place} {ceil(cue.left_s)} s"


def _progress(cue: Cue) -> str:
    """Return the number of missing examples, and the complete labels."""
    more = ", ".join(f"{label} {count}" for label, count in cue.more.items() if count)
    enough = ", ".join(label for label, count in cue.more.items() if not count)
    return f"{cue.left} left" + f" ({more})" * bool(more) + f", enough {enough}" * bool(enough)
