"""Virtual orb as a child process, which ends with the program."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import queue
import secrets
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from typing import IO

from host.connection.transport import LinkError, Transport, open_transport

START_S = 20.0  # until the orb says where it listens: networks are loaded and verified before
END_S = 2.0  # to end when asked to; then it is killed
LINE = 4096  # bytes of its first line, at most
TAIL = 1000  # bytes of its messages that an error shows

log = logging.getLogger(__name__)


class VirtualOrbProcess:
    """A virtual orb that belongs to this program; pass `open` and `token` to a Receiver.

    It answers only to holders of the one-time token, which it gets through its environment. Its
    standard input is a pipe that ends when this program ends, in whichever way.

    Attributes:
        token: The one-time token, for Hello.
        process: The present process; None while there is none.
    """

    def __init__(
        self,
        seed: int,
        options: Sequence[str] = (),
        *,
        command: Sequence[str] = (),
        start_s: float = START_S,
    ) -> None:
        """Prepare a process with further options of `controller`; nothing is started yet.

        `command`, if not empty, is started in place of the orb; it has `start_s` to say where it
        listens.
        """
        orb = (sys.executable, "-m", "controller", "--sensor", "virtual", "--seed", str(seed))
        self.token = secrets.token_hex(16)
        self.process: subprocess.Popen[bytes] | None = None
        self._command = [*(command or (*orb, *options, "--link", "listen://127.0.0.1:0"))]
        self._start_s = start_s
        self._url = ""  # where the present process listens, once it has said so
        self._messages: IO[bytes] | None = None  # its standard error
        self._closed = False
        self._lock = threading.Lock()  # so that nothing is started once it is closed

    def open(self) -> Transport:
        """Connect to the orb; start it first, or again if it has died. LinkError has its words."""
        if self.process is not None and self.process.poll() is not None:
            said = _tail(self._messages) if self._messages else ""
            log.error("the virtual orb ended with status %d: %s", self.process.returncode, said)
            self._end()
        if self.process is None:
            self._start()
        transport = open_transport(self._url)
        transport.name = "the virtual orb"  # its port means nothing to the user
        return transport

    def close(self) -> None:
        """End the orb, for good."""
        with self._lock:
            self._closed = True
        self._end()

    def _start(self) -> None:
        first: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        with self._lock:
            if self._closed:
                raise LinkError("the virtual orb was switched off")
            messages = self._messages = tempfile.TemporaryFile()  # noqa: SIM115 - see _end
            process = self.process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=messages,
                env={**os.environ, "ORBTOUCH_TOKEN": self.token},
                start_new_session=True,  # Ctrl+C in the terminal is for us; we end it our own way
            )
        threading.Thread(target=_drain, args=(process.stdout, first), daemon=True).start()
        try:
            self._url = str(json.loads(first.get(timeout=self._start_s))["listening"])
        except (queue.Empty, ValueError, LookupError, TypeError):
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(timeout=END_S / 4)  # it may be about to end, with a message
            status = process.poll()
            did = "does not say where it is" if status is None else f"ended with status {status}"
            said = _tail(messages) or "it left no message"
            self._end()
            raise LinkError(f"the virtual orb does not start, it {did}: {said}") from None

    def _end(self) -> None:
        process, messages = self.process, self._messages
        self.process = self._messages = None
        if process is not None:
            process.terminate()
            try:
                process.wait(timeout=END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            if process.stdin is not None:
                process.stdin.close()
        if messages is not None:
            messages.close()


def _drain(output: IO[bytes], first: queue.SimpleQueue[bytes]) -> None:
    """Hand over the first line, and throw the others away, so that the orb never waits."""
    with output:
        first.put(output.readline(LINE))
        while output.read(LINE):
            pass


def _tail(messages: IO[bytes]) -> str:
    """Return the end of what the orb said, in one line; "" once the file is closed.

    Of wrong usage the last line is kept: what was wrong, without all that would be right.
    """
    try:
        size = messages.seek(0, os.SEEK_END)
        messages.seek(max(size - TAIL, 0))
        words = " ".join(messages.read().decode(errors="replace").split())
        return words.rpartition("controller: error: ")[2]
    except ValueError:
        return ""
