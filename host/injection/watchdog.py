"""Watchdog process: holds the keys, and releases them when its sender hangs or dies.

`host` starts it and writes commands to its standard input, one per line; times are milliseconds of
the machine's monotonic clock, the same for both processes.

    d TIME KEY   press a key             b TIME   heartbeat of the sender
    u TIME KEY   release a key           c TIME   acknowledgement of `released`

It answers with `ready BACKEND` or `failed SENTENCE` at first, then `b TIME` to every b, which
acknowledges all lines before it, and `released SENTENCE` when it has released all keys by itself;
after that it refuses presses until c. At the end of its input, or on SIGINT, SIGTERM or SIGHUP, it
releases all keys and ends with status 0. It presses only the keys in its command line.
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

from controller.shared.keymap.keymap import Kind
from host.injection.backends import AUTO, NAMES, Backend, BackendError, open_backend

HANG_MS: Final = 300  # without a line from the sender
_ENDS: Final = ("SIGINT", "SIGTERM", "SIGHUP")
_CHUNK: Final = 4096
_IDLE_S: Final = 60.0


class Watchdog:
    """State of pressed keys, and of the sender's heartbeat, with explicit time.

    `down` holds the pressed keys in the order of their presses.
    """

    def __init__(self, backend: Backend, keys: Collection[str], now_ms: int) -> None:
        self.down: list[str] = []
        self._backend, self._keys = backend, frozenset(keys)
        self._heard_ms = now_ms
        self._waiting = False  # for the acknowledgement of `released`

    def line(self, line: str, now_ms: int) -> str:
        """Process one line of the sender; return the answer, "" if there is none."""
        answer = self.tick(now_ms)  # first: a late line is no heartbeat
        command, _, rest = line.partition(" ")
        time_ms, _, key = rest.partition(" ")
        if command not in ("b", "c", "d", "u") or not time_ms.isdecimal():
            return answer
        sent_ms = min(int(time_ms), now_ms)
        self._heard_ms = max(self._heard_ms, sent_ms)
        if command == "c":
            self._waiting = False
        elif command == "u":
            self._release(key)
        elif command == "d":
            late = self._waiting or now_ms - sent_ms >= HANG_MS
            if key in self._keys and key not in self.down and not late:
                self.down.append(key)  # first: a press that fails half-way is released, too
                self._backend.set(key, down=True)
        return answer or (f"b {time_ms}" if command == "b" else "")

    def tick(self, now_ms: int) -> str:
        """Release all keys if the sender has hung; return the answer, "" if there is none."""
        if not self.down or now_ms - self._heard_ms < HANG_MS:
            return ""
        self.release()
        self._waiting = True
        return f"released the program hung for {HANG_MS} ms"

    def wait_s(self, now_ms: int) -> float:
        """Return the time until the next `tick` without a line."""
        if not self.down:
            return _IDLE_S
        return max(self._heard_ms + HANG_MS - now_ms, 0) / 1000

    def release(self) -> None:
        """Release all keys, the latest first; keys whose release fails stay in `down`."""
        failure: OSError | None = None
        for key in reversed(list(self.down)):
            try:
                self._release(key)
            except OSError as error:
                failure = error
        if failure is not None:
            raise failure

    def _release(self, key: str) -> None:
        if key in self.down:
            self._backend.set(key, down=False)
            self.down.remove(key)


def serve(
    backend: Backend,
    keys: Collection[str],
    read: Callable[[], bytes],
    answer: Callable[[str], None],
    clock: Callable[[], int],
) -> None:
    """Run the watchdog until the input ends or a signal arrives, then release all keys.

    `read` returns bytes of the input, b"" at its end; it is called on a thread. `answer` is called
    with each line of output; `clock` is the sender's, milliseconds. Signal handlers raise no
    exception, so they cannot interrupt a press or release.
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
    """Hold the keys for `host`, which starts this process."""
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
        return 0  # the sender has ended, and all keys were released
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
    os._exit(status)  # does not wait for the reading thread
