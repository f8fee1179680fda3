"""Keyboard of the program's terminal, also over SSH.

A thread reads, so that the time of each key is independent of the scans; `poll` never blocks. The
terminal's state is restored when the program ends or is suspended; after SIGKILL and SIGQUIT, type
`reset`.
"""

import contextlib
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Final, Protocol, TextIO

from controller.keymap.terminal_decoder import (
    DISABLE,
    ENABLE,
    QUERY,
    Action,
    Decoder,
    KeyEvent,
    Signal,
)

ANSWER_S: Final = 0.3  # timeout of a terminal's answer
_TURN_S: Final = 0.05  # greatest time until the thread stops reading
_CHUNK: Final = 1024

Timed = tuple[float, KeyEvent | Signal]  # seconds ago, and the event


class Keyboard(Protocol):
    """A source of key events."""

    def poll(self) -> list[Timed]:
        """Return the events since the last call, and how long ago, without waiting."""


@contextmanager
def keyboard(stream: TextIO | None = None) -> Iterator[Keyboard | None]:
    """Read the keys of a terminal, or standard input, during the context; in the main thread only.

    It yields None without a terminal, or if another program uses it.
    """
    stream = sys.stdin if stream is None else stream
    if stream is None or not stream.isatty():
        yield None
    elif sys.platform == "win32":
        yield WindowsKeyboard()
    else:
        with posix_keyboard(stream.fileno()) as found:
            yield found


if sys.platform == "win32":
    import msvcrt

    class WindowsKeyboard:
        """The console of Windows, which sends characters only. Never run on Windows."""

        _FUNCTION_KEYS: Final = dict(
            zip(b"@ABCD\x85\x86", ("f6", "f7", "f8", "f9", "f10", "f11", "f12"), strict=True)
        )

        def __init__(self) -> None:
            """Begin without a character."""
            self._decoder = Decoder()

        def poll(self) -> list[Timed]:
            """Return the events since the last call."""
            events: list[Timed] = []
            while msvcrt.kbhit():
                char = msvcrt.getch()
                if char in (b"\0", b"\xe0"):
                    name = self._FUNCTION_KEYS.get(msvcrt.getch()[0])
                    events += [(0.0, KeyEvent(name, Action.TYPED))] if name else []
                else:
                    events += [(0.0, event) for event in self._decoder.feed(char)]
            return events

else:
    import select
    import termios

    @contextmanager
    def posix_keyboard(handle: int) -> Iterator[Keyboard | None]:
        """Read the keys of the terminal at a file descriptor."""
        if not _in_foreground(handle):  # in the background, reading would suspend the program
            yield None
            return
        found = PosixKeyboard(handle)
        handlers = {signal.SIGTSTP: found.suspend, signal.SIGCONT: found.resume}
        before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
        try:
            found.resume()
            yield found
        finally:
            found.close()
            for number, handler in before.items():
                signal.signal(number, handler)

    class PosixKeyboard:
        """The keyboard of a terminal of a system that has termios."""

        def __init__(self, handle: int) -> None:
            """Prepare; `resume` begins to read."""
            self._handle = handle
            self._before = termios.tcgetattr(handle)
            self._screen = _screen(handle)
            self._events: queue.SimpleQueue[tuple[float, KeyEvent | Signal]] = queue.SimpleQueue()
            self._decoder = Decoder()
            self._kitty = False  # the terminal sends presses and releases
            self._answered = threading.Event()
            self._reading = threading.Event()
            self._turn = threading.RLock()  # held while the thread reads
            self._closed = False
            self._thread = threading.Thread(target=self._run, name="keyboard", daemon=True)
            self._thread.start()

        def poll(self) -> list[Timed]:
            """Return the events since the last call, and how long ago."""
            now_s = time.monotonic()
            events = [self._events.get() for _ in range(self._events.qsize())]
            return [(max(now_s - at_s, 0.0), event) for at_s, event in events]

        def resume(self, number: int = 0, frame: FrameType | None = None) -> None:
            """Configure the terminal, at first and when the program returns to the foreground."""
            if not _in_foreground(self._handle):
                return
            with contextlib.suppress(termios.error):  # it has gone
                termios.tcsetattr(self._handle, termios.TCSANOW, _raw(self._before))
            if not self._reading.is_set():
                self._kitty = False
                self._answered.clear()
                self._write(QUERY)
                self._reading.set()

        def suspend(self, number: int, frame: FrameType | None) -> None:
            """Restore the terminal and suspend the program; `resume` follows."""
            self._restore()
            before = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGTSTP)
            signal.signal(signal.SIGTSTP, before)  # after the suspension
            self.resume()

        def close(self) -> None:
            """Restore the terminal, and end the thread."""
            self._restore()
            self._closed = True
            self._reading.set()  # wakes the thread, which ends
            self._thread.join()
            if self._screen >= 0:
                os.close(self._screen)

        def _restore(self) -> None:
            """Restore the terminal's state."""
            if not self._reading.is_set():
                return
            if self._screen >= 0:  # a later answer would appear at the shell's prompt
                self._answered.wait(ANSWER_S)
            self._reading.clear()
            with self._turn:
                if not _in_foreground(self._handle):
                    return
                if self._kitty:
                    self._write(DISABLE)
                with contextlib.suppress(termios.error):
                    termios.tcsetattr(self._handle, termios.TCSAFLUSH, self._before)
                # No releases follow, and characters go to another program.
                self._events.put((time.monotonic(), Signal.AWAY))

        def _write(self, data: bytes) -> None:
            if self._screen >= 0:
                with contextlib.suppress(OSError):
                    os.write(self._screen, data)

        def _run(self) -> None:
            """Read in the thread, until the terminal is closed."""
            while self._reading.wait() and not self._closed:
                with self._turn:
                    if not self._reading.is_set():
                        continue
                    if select.select([self._handle], [], [], _TURN_S)[0] and not self._read():
                        return

        def _read(self) -> bool:
            """Read the terminal's input; return False when the terminal is closed."""
            try:
                data = os.read(self._handle, _CHUNK)
            except OSError:
                return False
            for event in self._decoder.feed(data):
                if event is Signal.SPEAKS_KITTY:
                    self._write(b"" if self._kitty else ENABLE)
                    self._kitty = True
                elif event is Signal.ANSWERED:
                    self._answered.set()
                elif event in _SIGNALS:
                    os.killpg(0, _SIGNALS[event])  # as the terminal does in its usual mode
                else:
                    self._events.put((time.monotonic(), event))
            return bool(data) or not _hung_up(self._handle)

    _SIGNALS: Final[dict[KeyEvent | Signal, signal.Signals]] = {
        Signal.INTERRUPT: signal.SIGINT,
        Signal.SUSPEND: signal.SIGTSTP,
    }

    def _in_foreground(handle: int) -> bool:
        """Return whether the program is in the terminal's foreground."""
        try:
            return os.tcgetpgrp(handle) == os.getpgrp()
        except OSError:
            return False

    def _hung_up(handle: int) -> bool:
        """Return whether a terminal without input is closed."""
        poll = select.poll()
        poll.register(handle, 0)  # hang-ups are always reported
        return bool(poll.poll(0))

    def _screen(handle: int) -> int:
        """Return a file descriptor for output, -1 if the terminal supports no sequences."""
        if os.environ.get("TERM", "dumb") == "dumb":
            return -1
        try:
            return os.open(os.ttyname(handle), os.O_WRONLY | os.O_NOCTTY)
        except OSError:
            return -1

    def _raw(attributes: list[Any]) -> list[Any]:
        """Return terminal attributes without line buffering and echo.

        Ctrl-C and Ctrl-Z keep their meaning; Ctrl-S, which would stop the output, is disabled. A
        read never blocks, since Ctrl-C discards pending input, even just before the read.
        """
        changed = list(attributes)
        changed[0] &= ~termios.IXON
        changed[3] &= ~(termios.ICANON | termios.ECHO)
        changed[6] = [*attributes[6]]
        changed[6][termios.VMIN], changed[6][termios.VTIME] = 0, 0
        return changed
