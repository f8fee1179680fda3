"""The sender's side of the watchdog: strokes and heartbeats out, and what became of it back in."""

import contextlib
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import IO, Final, Protocol

from host.keys.backends import Backend, BackendError, ends_with_process, open_backend
from host.keys.guard import now_ms
from host.keys.mapping import Kind
from host.keys.pressed import Stroke

BEAT_MS: Final = 50  # a hang shows after 300
MUTE_MS: Final = 1000  # a watchdog that does not answer for so long has hung
START_S: Final = 10.0
END_S: Final = 1.0
_GUARD: Final = (sys.executable, "-m", "host.keys.guard")


class Sender(Protocol):
    """Where strokes go."""

    def start(self) -> str:
        """Get ready, again if need be; return the name of what presses the keys."""

    def send(self, strokes: Iterable[Stroke]) -> None:
        """Make strokes, in order."""

    def check(self) -> str:
        """Give a sign of life; return why everything was released, "" if it was not."""

    def close(self) -> None:
        """Release everything, for good."""


class Injector:
    """A watchdog process that presses keys for us.

    Attributes:
        process: The present one; None while there is none.
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
        """Prepare; `start` begins.

        Args:
            backend: Its name, or "auto".
            kind: What is to be pressed.
            keys: What can be pressed; the watchdog refuses everything else.
            command: What to start.
            clock: Milliseconds of the machine's monotonic clock.
        """
        self.process: subprocess.Popen[bytes] | None = None
        self._kind: Kind = kind
        self._command = [*command, "--backend", backend, "--kind", kind, "--", *sorted(keys)]
        self._clock = clock
        self._answers: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._down: list[str] = []
        self._spare: Backend | None = None  # lifts the keys of a watchdog that died
        self._beat_ms = 0  # when it was last told that we live
        self._asked_ms: int | None = None  # when it was first told so without an answer
        self._trouble = ""

    def start(self) -> str:
        """Start the watchdog if there is none; return the name of the back end.

        Raises:
            BackendError: It presses no keys here; the sentence says why.
        """
        if self.process is not None:
            return ""
        self._answers = queue.SimpleQueue()
        process = self.process = subprocess.Popen(
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            start_new_session=True,  # what the terminal sends to us must not reach it
        )
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
            if self._spare is None and not ends_with_process(rest):
                _, self._spare = open_backend(rest, self._kind)
        except BackendError:
            self.close()
            raise
        self._trouble = ""
        self._beat_ms, self._asked_ms = self._clock(), None
        return rest

    def send(self, strokes: Iterable[Stroke]) -> None:
        """Make strokes, in order; without a watchdog they are dropped."""
        for stroke in strokes:
            if stroke.down and self.process is not None:
                self._down.append(stroke.key)
            elif stroke.key in self._down:
                self._down.remove(stroke.key)
            self._write(f"{'d' if stroke.down else 'u'} {self._clock()} {stroke.key}")

    def check(self) -> str:
        """Give a sign of life; return why everything was released, "" if it was not."""
        self._listen()
        now = self._clock()
        if self._asked_ms is not None and now - self._asked_ms >= MUTE_MS:
            self._lose("the watchdog has hung")
        if self.process is not None and now - self._beat_ms >= BEAT_MS:
            self._beat_ms = now
            self._asked_ms = now if self._asked_ms is None else self._asked_ms
            self._write(f"b {now}")
        trouble, self._trouble = self._trouble, ""
        return trouble

    def close(self) -> None:
        """Let the watchdog lift everything, and end it."""
        process, self.process = self.process, None
        if process is None:
            return
        assert process.stdin is not None
        with contextlib.suppress(OSError):
            process.stdin.close()  # its sign to lift everything, and end
        try:
            process.wait(timeout=END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if process.returncode != 0:
            self._lift()
        self._down.clear()

    def _listen(self) -> None:
        """Take the watchdog's answers."""
        while self.process is not None:
            try:
                answer = self._answers.get_nowait()
            except queue.Empty:
                return
            self._asked_ms = None
            word, _, sentence = (answer or "").partition(" ")
            if answer is None:
                self._lose("the watchdog has died")
            elif word == "released":
                self._down.clear()
                self._write(f"c {self._clock()}")
            self._trouble = sentence or self._trouble

    def _write(self, line: str) -> None:
        if self.process is None:
            return
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(f"{line}\n".encode())
        except OSError:
            self._lose("the watchdog has died")

    def _lose(self, why: str) -> None:
        """Do without the watchdog, and lift what it may have left down."""
        process, self.process = self.process, None
        if process is None:
            return
        process.kill()
        process.wait()
        assert process.stdin is not None
        with contextlib.suppress(OSError):
            process.stdin.close()
        self._asked_ms = None
        self._trouble = self._trouble or why
        self._lift()

    def _lift(self) -> None:
        """Lift, over a handle of our own, what was down when the watchdog went."""
        while self._spare is not None and self._down:
            with contextlib.suppress(OSError):  # the trouble is told anyway
                self._spare.release(self._down.pop())
        self._down.clear()


def _drain(output: IO[bytes], answers: "queue.SimpleQueue[str | None]") -> None:
    """Hand over the watchdog's lines, and None at their end."""
    with output:
        for line in output:
            answers.put(line.decode(errors="replace").strip())
    answers.put(None)


class Printer:
    """Says what would be pressed, for --dry-run."""

    def __init__(self, say: Callable[[str], None]) -> None:
        """Take what prints a line."""
        self._say = say

    def start(self) -> str:
        """Nothing has to be started."""
        return "dry run"

    def send(self, strokes: Iterable[Stroke]) -> None:
        """Print strokes."""
        for stroke in strokes:
            self._say(f"{'press' if stroke.down else 'release'} {stroke.key}")

    def check(self) -> str:
        """Nothing can go wrong."""
        return ""

    def close(self) -> None:
        """Nothing is held."""
