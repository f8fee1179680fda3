"""One-way link: commands, cues and identified users, as JSON lines on the standard output."""

from __future__ import annotations

import json
import queue
import sys
import threading
from typing import TextIO

from controller.links.base import Access, Link, LinkError
from controller.shared.errors import let_go
from controller.shared.protocol.messages import (
    Command,
    Message,
    PositionUncertainty,
    UserIdentified,
    Welcome,
)

LINES = 65_536  # limit of queued lines for a slow reader; further ones are dropped


def create(url: str, welcome: Welcome, access: Access) -> StdoutLink:
    """Return the link to the standard output; all arguments are ignored."""
    if sys.stdout is None:
        raise LinkError("there is no standard output to print to; name a port with --link")
    return StdoutLink(sys.stdout)


class StdoutLink(Link):
    """Printer of commands and cues. A thread writes, so that a slow reader delays no scan.

    Attributes:
        dropped: Number of lines that a slow or closed reader did not get.
        connected: Whether there is a reader.
    """

    touchable = False
    dropped = 0
    connected = True

    def __init__(self, stream: TextIO) -> None:
        """Write to `stream`, which stays open when the link is closed."""
        self._position: PositionUncertainty | None = None  # the newest
        self._stream = stream
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()  # "" is the end
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stdout", daemon=True)
        self._thread.start()

    def send(self, message: Message, t_ms: int) -> None:
        """Print a Command with the uncertainty of its position, or an identified user."""
        if isinstance(message, PositionUncertainty):
            self._position = message
        elif isinstance(message, Command):
            self._print(_line(message, self._position, t_ms))
        elif isinstance(message, UserIdentified):
            fields = {"t": t_ms / 1000, "user": message.user, "confidence": message.confidence}
            self._print(json.dumps(fields) + "\n")

    def wait(self, timeout_s: float) -> None:
        """Wait for the whole timeout."""
        self._closed.wait(timeout_s)

    def close(self) -> None:
        """Print the queued lines, as long as the reader reads."""
        if not self._closed.is_set():
            self._closed.set()
            self._lines.put("")
        self._thread.join()

    def _print(self, line: str) -> None:
        if not self.connected or self._closed.is_set() or self._lines.qsize() >= LINES:
            self.dropped += 1
        else:
            self._lines.put(line)

    def _run(self) -> None:
        line = " "
        while line and self.connected:
            line = self._lines.get()
            try:
                self._stream.write(line)
                if not line or self._lines.empty():
                    self._stream.flush()
            except BrokenPipeError:  # the reader has ended, as in `controller | head -1`
                self.connected = False
            except OSError as error:
                self.problem = f"cannot print the commands: {error.strerror or error}"
                self.connected = False
        if not self.connected:
            let_go(self._stream)


def _line(command: Command, position: PositionUncertainty | None, t_ms: int) -> str:
    """Return a command as one JSON object, rounded to be equal on every machine."""
    touch = command.touch and [round(value, 3) for value in command.touch]
    fields: dict[str, object] = {
        "t": t_ms / 1000,
        "gesture": command.label,
        "probability": round(command.probability, 4),
        "touch": touch,
    }
    if position is not None and position.frame == command.frame:
        fields["sigma"] = round(position.sigma, 3)
    fields["command"] = command.name
    return json.dumps(fields) + "\n"
