"""Sender of the watchdog process: writes strokes and heartbeats, and reads acknowledgements.

A key counts as down from just before its press is written until the watchdog has acknowledged a
heartbeat written after its release. If the watchdog is lost, keys that count as down are released
by this process through a second handle to the back end.
"""

import contextlib
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import IO, Final

from controller.shared.keymap.key_state import Stroke
from controller.shared.keymap.keymap import Kind
from host.injection.backends import PRINT, Backend, BackendError, ends_with_process, open_backend
from host.injection.watchdog import HANG_MS, now_ms

BEAT_MS: Final = 50  # between two heartbeats
MUTE_MS: Final = 800  # without an answer for longer, the watchdog has hung
START_S: Final = 10.0
END_S: Final = 0.5
_BY_HAND: Final = "press it once on your own keyboard"
_GUARD: Final = (sys.executable, "-m", "host.injection.watchdog")


class Injector:
    """A watchdog process that presses keys.

    Attributes:
        process: The process; None if none is running.
    """

    def __init__(
        self,
        backend: str,
        kind: Kind,
        keys: Collection[str],
        *,
        command: Sequence[str] = _GUARD,
        clock: Callable[[], int] = now_ms,
    ) -> None:
        """Prepare the watchdog's command line; it may press only these keys.

        `clock` returns milliseconds of the machine's monotonic clock.
        """
        self.process: subprocess.Popen[bytes] | None = None
        self._kind: Kind = kind
        self._command = [*command, "--backend", backend, "--kind", kind, "--", *sorted(keys)]
        self._clock = clock
        self._answers: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        # Keys that may be down, and the time of their release, milliseconds; None: not released.
        self._down: dict[str, int | None] = {}
        self._name = ""  # of the back end
        self._spare: Backend | None = None  # releases keys that a lost watchdog may have left down
        self._beat_ms = 0  # time of the last heartbeat
        self._pending_ms: int | None = None  # time of the first heartbeat without an answer
        self._trouble = ""

    def start(self) -> str:
        """Start the watchdog if there is none; return its back end, "" if there is one.

        BackendError if no key can be pressed here.
        """
        if self.process is not None:
            return ""
        self._release_spare()
        if self._down:
            raise BackendError(f"{', '.join(self._down)} may still be down; {_BY_HAND}")
        self._answers = queue.SimpleQueue()
        process = self.process = subprocess.Popen(
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            # Signals of the terminal or the console to this process must not reach the watchdog.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        assert process.stdin is not None
        if hasattr(os, "set_blocking"):  # a full pipe must not block; Windows has this from 3.12 on
            os.set_blocking(process.stdin.fileno(), False)
        threading.Thread(
            target=_drain, args=(process.stdout, self._answers), daemon=True, name="keys"
        ).start()
        try:
            first = self._answers.get(timeout=START_S) or ""
        except queue.Empty:
            first = f"failed the process that presses keys does not start within {START_S:g} s"
        word, _, rest = first.partition(" ")
        try:
            if word != "ready":
                raise BackendError(rest or "the process that presses keys does not start")
            self._name = rest
            self._open_spare()
        except BackendError:
            self.close()
            raise
        self._trouble = ""
        self._beat_ms, self._pending_ms = self._clock(), None
        return rest

    def send(self, strokes: Iterable[Stroke]) -> None:
        """Execute strokes, in order; without a watchdog they are dropped."""
        for stroke in strokes:
            if self.process is None:
                return
            now = self._clock()
            # A signal handler may raise between any two lines; `_down` must stay complete.
            if stroke.down:
                self._down[stroke.key] = None
                self._write(f"d {now} {stroke.key}")
            else:
                self._write(f"u {now} {stroke.key}")
                if stroke.key in self._down:
                    self._down[stroke.key] = now

    def check(self) -> str:
        """Send a heartbeat; return a sentence if all presses have ended, else ""."""
        self._read_answers()
        now = self._clock()
        if self._pending_ms is not None and now - self._beat_ms >= HANG_MS:
            self._pending_ms = now  # this process was suspended, and may not have read the answers
        if self._pending_ms is not None and now - self._pending_ms >= MUTE_MS:
            self._lose("the watchdog has hung")
        if now - self._beat_ms >= BEAT_MS:
            self._beat_ms = now
            if self.process is None:
                self._release_spare()  # retries failed releases
            else:
                self._pending_ms = now if self._pending_ms is None else self._pending_ms
                self._write(f"b {now}")
        trouble, self._trouble = self._trouble, ""
        return trouble

    def close(self) -> None:
        """End the watchdog, which releases all keys; release remaining ones here."""
        process = self.process
        if process is not None:
            assert process.stdin is not None
            with contextlib.suppress(OSError):
                process.stdin.close()  # makes the watchdog release all keys and end
            try:
                process.wait(timeout=END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            if process.returncode == 0:
                self._down.clear()
        self._release_spare()
        self.process = None
        if self._down:
            self._note("the program ends")

    def _read_answers(self) -> None:
        while self.process is not None:
            try:
                answer = self._answers.get_nowait()
            except queue.Empty:
                return
            self._pending_ms = None
            word, _, rest = (answer or "").partition(" ")
            if answer is None:
                self._lose("the watchdog has died")
            elif word == "failed":
                self._lose(rest)
            elif word == "released":
                self._down.clear()  # the watchdog refuses presses that are still in the pipe
                self._write(f"c {self._clock()}")
                self._note(rest)
            elif word == "b" and rest.isdecimal():
                self._acknowledge(int(rest))

    def _acknowledge(self, beat_ms: int) -> None:
        """Remove the keys that were released before an acknowledged heartbeat."""
        self._down = {
            key: up_ms for key, up_ms in self._down.items() if up_ms is None or up_ms >= beat_ms
        }

    def _write(self, line: str) -> None:
        stdin = None if self.process is None else self.process.stdin
        if stdin is None or stdin.closed:  # closed: a signal interrupted `_lose`
            return
        try:
            if not stdin.write(f"{line}\n".encode()):
                self._lose("the watchdog has hung")  # the pipe is full
        except OSError:
            self._lose("the watchdog has died")

    def _lose(self, reason: str) -> None:
        """End the watchdog, and release keys that it may have left down.

        `process` is kept until this is done, so that `close` repeats it after a signal.
        """
        process = self.process
        if process is None:
            return
        process.kill()
        process.wait()
        assert process.stdin is not None
        with contextlib.suppress(OSError):
            process.stdin.close()
        self._release_spare()
        self._pending_ms, self.process = None, None
        self._note(reason)

    def _release_spare(self) -> None:
        """Release keys that may be down through the second handle, without a watchdog."""
        if self._spare is None:
            self._down.clear()  # the system released them with the process
        if self._down:
            # On a thread, so that a signal cannot interrupt a call and corrupt the handle.
            thread = threading.Thread(target=self._release, args=(self._spare,), name="release")
            thread.start()
            thread.join()

    def _release(self, spare: Backend) -> None:
        """Release keys that may be down; those that fail stay in `_down` for another attempt."""
        left: list[str] = []
        for key in reversed(list(self._down)):
            try:
                spare.set(key, down=False)
            except OSError:
                left.append(key)
        self._down = dict.fromkeys(left)
        if left:
            with contextlib.suppress(BackendError):
                self._open_spare()  # this one may be broken

    def _open_spare(self) -> None:
        """Open the second handle, if keys stay down after the end of the watchdog's process.

        It is opened with each watchdog, since a back end may cache the keyboard layout.
        """
        ends = ends_with_process(self._name)
        self._spare = None if ends else open_backend(self._name, self._kind)[1]

    def _note(self, reason: str) -> None:
        left = ", ".join(self._down)
        up = f"with {left} perhaps down, {_BY_HAND}" if left else "with every key up"
        self._trouble = self._trouble or f"{up}: {reason}"


def _drain(output: IO[bytes], answers: "queue.SimpleQueue[str | None]") -> None:
    """Queue the watchdog's lines, and None at their end."""
    with output:
        for line in output:
            answers.put(line.decode(errors="replace").strip())
    answers.put(None)


class PrintingSender:
    """Printer of strokes, for --backend print."""

    def __init__(self, print_line: Callable[[str], None]) -> None:
        self._print_line = print_line
        self._name = PRINT

    def start(self) -> str:
        """Return the name once; there is nothing to start."""
        name, self._name = self._name, ""
        return name

    def send(self, strokes: Iterable[Stroke]) -> None:
        """Print strokes."""
        for stroke in strokes:
            self._print_line(f"{'press' if stroke.down else 'release'} {stroke.key}")

    def check(self) -> str:
        """Return "": nothing can fail."""
        return ""

    def close(self) -> None:
        """Do nothing: no key is down."""


Sender = Injector | PrintingSender
