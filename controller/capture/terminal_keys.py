"""The keyboard of the terminal that the program was started in: the one file that knows terminals.

Over SSH it is the same. A thread reads, so that every key has its own time however long a scan
takes; `poll` never waits. The terminal is left as it was found, however the program ends, and while
it is suspended. Only one that is killed (SIGKILL) cannot do so: type `reset`.
"""

import contextlib
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Final, Protocol, TextIO

from controller.capture.labels import Told
from controller.capture.terminal_decoder import DISABLE, ENABLE, QUERY, Decoder, KeyEvent, Signal

ANSWER_S: Final = 0.3  # a terminal that has not answered by then never will, nor will it later
_PARK_S: Final = 1.0  # the thread stops reading within this
_CHUNK: Final = 1024


class Keyboard(Protocol):
    """Where strokes come from."""

    def poll(self) -> list[Told]:
        """Return what was typed since the last call, and how long ago, without waiting."""


@contextmanager
def keyboard(
    stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic
) -> Iterator[Keyboard | None]:
    """Have the keys of a terminal for as long as the context lasts; in the main thread only.

    Args:
        stream: Of the terminal; standard input if not given.
        clock: Seconds that never go back.

    Yields:
        The keyboard; None where there is no terminal, or it is somebody else's for now.
    """
    stream = sys.stdin if stream is None else stream
    if stream is None or not stream.isatty():
        yield None
    elif sys.platform == "win32":
        yield Console()
    else:
        with posix_keyboard(stream.fileno(), clock) as found:
            yield found


if sys.platform == "win32":
    import msvcrt

    class Console:
        """The console of Windows, which tells characters only. Untried."""

        def __init__(self) -> None:
            self._decoder = Decoder()

        def poll(self) -> list[Told]:
            """Return what was typed since the last call."""
            typed = bytearray()
            while msvcrt.kbhit():
                typed += msvcrt.getch()
            return [(0.0, one) for one in self._decoder.feed(bytes(typed))]

else:
    import select
    import termios

    @contextmanager
    def posix_keyboard(handle: int, clock: Callable[[], float]) -> Iterator[Keyboard | None]:
        """Have the keys of the terminal at a file descriptor."""
        if not _ours(handle):  # started in the background, where reading would suspend us
            yield None
            return
        found = Posix(handle, clock)
        handlers = {
            signal.SIGTSTP: found.suspend,
            signal.SIGCONT: found.resume,
            signal.SIGQUIT: found.quit,
        }
        before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
        try:
            found.resume()
            yield found
        finally:
            found.close()
            for number, handler in before.items():
                signal.signal(number, handler)

    class Posix:
        """A terminal of a system that has termios."""

        def __init__(self, handle: int, clock: Callable[[], float]) -> None:
            """Prepare; `resume` begins."""
            self._handle, self._clock = handle, clock
            self._before = termios.tcgetattr(handle)
            self._told: queue.SimpleQueue[tuple[float, KeyEvent | Signal]] = queue.SimpleQueue()
            self._decoder = Decoder()
            self._kitty = False  # the terminal tells presses and releases
            self._answered = threading.Event()
            self._reading = False
            self._parked = threading.Event()
            self._bell, self._button = os.pipe()
            self._closing = False
            self._thread = threading.Thread(target=self._run, name="keyboard", daemon=True)
            self._screen = _screen(handle)
            self._thread.start()

        def poll(self) -> list[Told]:
            """Return what was typed since the last call, and how long ago."""
            told: list[Told] = []
            now_s = self._clock()
            with contextlib.suppress(queue.Empty):
                while True:
                    at_s, one = self._told.get_nowait()
                    told.append((max(now_s - at_s, 0.0), one))
            return told

        def resume(self, number: int = 0, frame: FrameType | None = None) -> None:
            """Take the terminal, at first and whenever the program goes on in the foreground."""
            if not _ours(self._handle):
                return
            with contextlib.suppress(termios.error):  # it has gone
                termios.tcsetattr(self._handle, termios.TCSANOW, _keys_at_once(self._before))
            if self._reading:
                return
            self._kitty = False
            self._answered.clear()
            self._write(QUERY)
            self._read(True)

        def suspend(self, number: int, frame: FrameType | None) -> None:
            """Give the terminal back and stop, as Ctrl-Z asks; `resume` follows."""
            self._leave()
            before = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGTSTP)
            signal.signal(signal.SIGTSTP, before)  # here the program goes on
            self.resume()

        def quit(self, number: int, frame: FrameType | None) -> None:
            """Give the terminal back and die, as Ctrl and the backslash ask."""
            self._leave()
            signal.signal(signal.SIGQUIT, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGQUIT)

        def close(self) -> None:
            """Give the terminal back for good."""
            self._leave()
            self._closing = True
            os.write(self._button, b"!")
            self._thread.join()
            for handle in (self._bell, self._button, self._screen):
                if handle >= 0:
                    os.close(handle)

        def _leave(self) -> None:
            """Leave the terminal as it was found."""
            if not self._reading:
                return
            if self._screen >= 0:  # an answer that came later would stand at the shell's prompt
                self._answered.wait(ANSWER_S)
            self._read(False)
            if not _ours(self._handle):
                return
            if self._kitty:
                self._write(DISABLE)
            with contextlib.suppress(termios.error):
                termios.tcsetattr(self._handle, termios.TCSAFLUSH, self._before)
            # Releases will not be told, and characters go to somebody else.
            self._told.put((self._clock(), Signal.AWAY))

        def _write(self, data: bytes) -> None:
            if self._screen >= 0:
                with contextlib.suppress(OSError):
                    os.write(self._screen, data)

        def _read(self, reading: bool) -> None:
            """Let the thread read, or see to it that it does not."""
            self._reading = reading
            self._parked.clear()
            os.write(self._button, b"!")
            if not reading and self._thread.is_alive():
                self._parked.wait(_PARK_S)

        # --- the thread's side ---

        def _run(self) -> None:
            while not self._closing:
                handles = [self._bell, *([self._handle] if self._reading else [])]
                if not self._reading:
                    self._parked.set()
                ready, _, _ = select.select(handles, [], [])
                if self._bell in ready:
                    os.read(self._bell, _CHUNK)
                elif self._reading and not self._take():
                    return

        def _take(self) -> bool:
            """Take what was typed; return False when the terminal has gone."""
            try:
                data = os.read(self._handle, _CHUNK)
            except OSError:
                return False
            for one in self._decoder.feed(data):
                match one:
                    case Signal.SPEAKS_KITTY:
                        if not self._kitty:
                            self._kitty = True
                            self._write(ENABLE)
                    case Signal.ANSWERED:
                        self._answered.set()
                    case Signal.INTERRUPT | Signal.SUSPEND | Signal.QUIT:
                        os.killpg(0, _NUMBERS[one])  # as the terminal would, of itself
                    case _:
                        self._told.put((self._clock(), one))
            return bool(data) or not _hung_up(self._handle)

    _NUMBERS: Final = {
        Signal.INTERRUPT: signal.SIGINT,
        Signal.SUSPEND: signal.SIGTSTP,
        Signal.QUIT: signal.SIGQUIT,
    }

    def _ours(handle: int) -> bool:
        """Whether the program is in the terminal's foreground."""
        try:
            return os.tcgetpgrp(handle) == os.getpgrp()
        except OSError:
            return False

    def _hung_up(handle: int) -> bool:
        """Whether a terminal that gave nothing has gone."""
        poll = select.poll()
        poll.register(handle, 0)  # that it has gone is told unasked
        return bool(poll.poll(0))

    def _screen(handle: int) -> int:
        """Return a file descriptor to write to the terminal, -1 if it understands no sequences."""
        if os.environ.get("TERM", "dumb") == "dumb":
            return -1
        try:
            return os.open(os.ttyname(handle), os.O_WRONLY | os.O_NOCTTY)
        except OSError:
            return -1

    def _keys_at_once(attributes: list[Any]) -> list[Any]:
        """Return a terminal's attributes so that keys come at once and are not shown.

        Ctrl-C and Ctrl-Z stay what they are; Ctrl-S, which would halt our own output, does nothing.
        A read never waits: Ctrl-C throws away what was typed before it, also just before the read.
        """
        changed = list(attributes)
        changed[0] &= ~termios.IXON
        changed[3] &= ~(termios.ICANON | termios.ECHO)
        changed[6] = [*attributes[6]]
        changed[6][termios.VMIN], changed[6][termios.VTIME] = 0, 0
        return changed
