"""The watchdog: a process that holds the keys, and lifts them when its sender hangs or dies.

`host` starts it and writes to its standard input, one line each; times are milliseconds of the
machine's monotonic clock, the same for both processes.

    d TIME KEY   put a key down          b TIME   the sender is alive
    u TIME KEY   lift a key              c TIME   the sender knows that all was lifted

It answers with `ready BACKEND` or `failed SENTENCE` at first, then `b TIME` to every b, which
acknowledges all lines before it, and `released SENTENCE` when it has lifted everything by itself;
after that it presses nothing until c. At the end of its input, or on SIGINT, SIGTERM or SIGHUP,
it lifts everything and ends with status 0. Nothing but the keys that it was given at its start is
pressed.
"""

import argparse
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable, Collection
from typing import Final, cast

from controller.keymap.keymap import Kind
from host.injection.backends import AUTO, NAMES, Backend, BackendError, open_backend

HANG_MS: Final = 300  # without a word from the sender
_ENDS: Final = ("SIGINT", "SIGTERM", "SIGHUP")
_CHUNK: Final = 4096
_IDLE_S: Final = 60.0


class Watchdog:
    """State of pressed keys, and of the sender's heartbeat. Time comes in.

    Attributes:
        down: The keys, in the order in which they went down.
        refused: How many presses came too late, or for keys that were not named at the start.
    """

    def __init__(self, backend: Backend, keys: Collection[str], now_ms: int) -> None:
        """Watch over a back end that may press these keys and no other."""
        self.down: list[str] = []
        self.refused = 0
        self._backend, self._keys = backend, frozenset(keys)
        self._heard_ms = now_ms
        self._waiting = False  # for the sender to learn that everything was lifted

    def line(self, line: str, now_ms: int) -> str:
        """Take one line of the sender; return the answer, "" if there is none."""
        answer = self.tick(now_ms)  # what comes too late cannot undo that it was late
        what, _, rest = line.partition(" ")
        time_ms, _, key = rest.partition(" ")
        if what not in ("b", "c", "d", "u") or not time_ms.isdecimal():
            return answer
        sent_ms = min(int(time_ms), now_ms)
        self._heard_ms = max(self._heard_ms, sent_ms)
        if what == "c":
            self._waiting = False
        elif what == "u":
            self._lift(key)
        elif what == "d":
            if self._waiting or key not in self._keys or now_ms - sent_ms >= HANG_MS:
                self.refused += 1
            elif key not in self.down:
                self.down.append(key)  # first: a press that fails half-way is lifted, too
                self._backend.press(key)
        return answer or (f"b {time_ms}" if what == "b" else "")

    def tick(self, now_ms: int) -> str:
        """Lift everything if the sender has hung while a key was down; return what to answer."""
        if not self.down or now_ms - self._heard_ms < HANG_MS:
            return ""
        self.release()
        self._waiting = True
        return f"released the program hung for {HANG_MS} ms"

    def wait_s(self, now_ms: int) -> float:
        """Return how long `tick` can wait, if no line comes."""
        if not self.down:
            return _IDLE_S
        return max(self._heard_ms + HANG_MS - now_ms, 0) / 1000

    def release(self) -> None:
        """Lift everything, the latest first, whatever fails on the way; what failed stays down."""
        failure: OSError | None = None
        for key in reversed(list(self.down)):
            try:
                self._lift(key)
            except OSError as error:
                failure = error
        if failure is not None:
            raise failure

    def _lift(self, key: str) -> None:
        if key in self.down:
            self._backend.release(key)
            self.down.remove(key)


def serve(
    backend: Backend,
    keys: Collection[str],
    read: Callable[[], bytes],
    answer: Callable[[str], None],
    clock: Callable[[], int],
) -> None:
    """Watch until the input ends or a signal arrives, then lift everything.

    A signal raises nothing, so it cannot end a press or release half-way.

    Args:
        backend: What presses.
        keys: What it may press.
        read: Returns bytes of the input, b"" at its end; called on a thread.
        answer: Takes one line.
        clock: Milliseconds, the sender's clock.
    """
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    for name in _ENDS:
        if number := getattr(signal, name, None):  # Windows has no SIGHUP
            signal.signal(number, lambda *_: lines.put(None))
    threading.Thread(target=_read, args=(read, lines), daemon=True).start()
    watchdog = Watchdog(backend, keys, clock())
    try:
        while True:
            try:
                line = lines.get(timeout=watchdog.wait_s(clock()))
            except queue.Empty:
                reply = watchdog.tick(clock())
            else:
                if line is None:
                    return
                reply = watchdog.line(line, clock())
            if reply:
                answer(reply)
    finally:
        watchdog.release()
        backend.close()


def _read(read: Callable[[], bytes], lines: "queue.SimpleQueue[str | None]") -> None:
    rest = b""
    try:
        while data := read():
            *whole, rest = (rest + data).split(b"\n")
            for line in whole:
                lines.put(line.decode("ascii", "replace"))
    finally:
        lines.put(None)


def main(argv: list[str] | None = None) -> int:
    """Hold the keys for a `host`; not meant to be started by hand."""
    parser = argparse.ArgumentParser(
        prog="python -m host.injection.watchdog", description=main.__doc__
    )
    parser.add_argument("--backend", choices=(AUTO, *NAMES), default=AUTO)
    parser.add_argument("--kind", choices=("keyboard", "gamepad"), default="keyboard")
    parser.add_argument("keys", nargs="+")
    options = parser.parse_args(argv)
    try:
        name, backend = open_backend(options.backend, cast(Kind, options.kind))
    except BackendError as error:
        _answer(f"failed {error}")
        return 1
    _answer(f"ready {name}")
    try:
        serve(backend, options.keys, lambda: os.read(0, _CHUNK), _answer, now_ms)
    except BrokenPipeError:
        return 0  # the sender has gone, and everything was lifted
    except OSError as error:
        _answer(f"failed {error}")
        return 1
    return 0


def now_ms() -> int:
    """Return the machine's monotonic clock, milliseconds."""
    return time.monotonic_ns() // 1_000_000


def _answer(line: str) -> None:
    os.write(1, f"{line}\n".encode())


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    os._exit(status)  # a thread may still be reading, and must not hold us
