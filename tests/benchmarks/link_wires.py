"""Wires of the link benchmark: one row each; another one, such as RFCOMM, is another row."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Final

from tests.support.processes import LineProcess


class Peer(LineProcess):
    """A process of `link_peers`."""

    def __init__(self, *command: str) -> None:
        program = [sys.executable, "-m", "tests.benchmarks.link_peers", *command]
        super().__init__(program, stderr=subprocess.DEVNULL)
        self.first = self.read()  # what its first line told

    def read(self) -> dict[str, Any]:
        """Return its next line, waiting for it."""
        return dict(json.loads(self.line()))

    def ask(self, line: str) -> dict[str, Any]:
        """Write one line, and return the next one."""
        self.say(line)
        return self.read()


@dataclass(frozen=True)
class Line:
    """A wire with somebody at its far end."""

    url: str  # what a host opens
    peer: Peer  # who is at the far end
    wire: Peer | None  # what can be pulled and counted; None where nothing is in between


@dataclass(frozen=True)
class Wire:
    """A kind of wire."""

    name: str  # the preset that results are reported under
    # puts "device", or another one of `link_peers`, at its far end; True: with something in between
    # that can be pulled and counts bytes
    join: Callable[[ExitStack, str, bool], Line]

    @contextmanager
    def line(self, who: str, *, counted: bool = False) -> Iterator[Line]:
        with ExitStack() as stack:
            yield self.join(stack, who, counted)


def _started(stack: ExitStack, *command: str) -> Peer:
    peer = Peer(*command)
    stack.callback(peer.close)
    return peer


def _pty(stack: ExitStack, who: str, counted: bool) -> Line:
    """Two ptys, joined by a process: what a serial port with somebody behind it looks like."""
    wire = _started(stack, "cable")
    near, far = wire.first["ends"]
    return Line(near, _started(stack, who, far), wire)


def _tcp(stack: ExitStack, who: str, counted: bool) -> Line:
    """A connection on this machine."""
    peer = _started(stack, who, "listen://127.0.0.1:0")
    url = str(peer.first["url"])
    if not counted:
        return Line(url, peer, None)
    wire = _started(stack, "proxy", url.rpartition(":")[2])
    return Line(str(wire.first["ends"][0]), peer, wire)


def _rfcomm(stack: ExitStack, who: str, counted: bool) -> Line:
    """RFCOMM over Bumble's virtual controllers, with a pty at each end, which both pay for."""
    wire = _started(stack, "air")
    near, far = wire.first["ends"]
    return Line(near, _started(stack, who, far), wire)


WIRES: Final = (
    Wire("pty", _pty),
    Wire("tcp", _tcp),
    *([Wire("rfcomm-bumble", _rfcomm)] if find_spec("bumble") else []),
)
