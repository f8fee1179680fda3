"""Search for devices on several ports at once, and opening of a port by a device's identity."""

from __future__ import annotations

import contextlib
import json
import logging
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Final

from host.connection.device_store import DeviceStore
from host.connection.receiver import Connected, Received
from host.connection.transport import LinkError, Transport, open_transport
from host.discovery.ports import Port, listed
from host.discovery.probe import Answer

DEADLINE_S: Final = 8.0  # for a Python to start on a small machine, a port to open, and 2 s
KILLED_S: Final = 0.5  # to die; one that hangs in the kernel dies later, and is not waited for
_PROBE: Final = (sys.executable, "-m", "host.discovery.probe")
_MOST: Final = 32  # ports at a time

log = logging.getLogger(__name__)


def candidates(memory: DeviceStore, *, everything: bool = False) -> list[Port]:
    """Return the ports to ask: remembered ones first, then those with a known description.

    Args:
        memory: Where devices were before.
        everything: Whether the user wants all other ports to be opened, too.
    """
    ports = {
        known.port: Port(
            known.port, f"{known.name or known.device_id} was there before", key=known.key
        )
        for known in memory.devices
        if known.port
    }
    for port in listed():
        if (port.why or everything) and port.url not in ports:
            ports[port.url] = port
    return list(ports.values())


def ask_all(
    ports: Iterable[Port], *, deadline_s: float = DEADLINE_S, command: Sequence[str] = _PROBE
) -> list[Answer]:
    """Probe every port, in processes of their own; return the answers in that order.

    Args:
        ports: What to ask; each only once.
        deadline_s: For all of them together. A process that is not done by then is killed, and
            if that takes long, too, left alone.
        command: What asks; the port's name, and its key's file, are appended.
    """
    answers: list[Answer] = []
    waiting = list({port.url: port for port in ports}.values())
    while waiting:
        some, waiting = waiting[:_MOST], waiting[_MOST:]
        answers += _ask_some(some, deadline_s, command)
    return answers


def _ask_some(ports: Sequence[Port], deadline_s: float, command: Sequence[str]) -> list[Answer]:
    end_s = time.monotonic() + deadline_s
    asked: list[tuple[str, subprocess.Popen[bytes]]] = []
    try:
        for port in ports:
            process = subprocess.Popen(
                [*command, port.url, port.key],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                start_new_session=True,  # Ctrl+C in the terminal is for us; we end them
            )
            asked.append((port.url, process))
        return [_answer(url, process, end_s, deadline_s) for url, process in asked]
    finally:
        for _, process in asked:
            process.kill()


def _answer(url: str, process: subprocess.Popen[bytes], end_s: float, deadline_s: float) -> Answer:
    """Wait for one process, at most until the end; its line is far smaller than a pipe."""
    assert process.stdout is not None
    with process.stdout as output:
        try:
            process.wait(timeout=max(end_s - time.monotonic(), 0.0))
            return Answer(**json.loads(output.read()))
        except subprocess.TimeoutExpired:
            process.kill()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(KILLED_S)
            return Answer(url, "stuck", f"{url} hangs: it said nothing for {deadline_s:g} s")
        except (ValueError, TypeError):
            return Answer(url, "closed", f"asking {url} failed with status {process.returncode}")


def note(memory: DeviceStore, answers: list[Answer]) -> None:
    """Remember where devices are; one that two ports claim to be stays where it was."""
    seen = now()
    for answer in answers:
        if answer.outcome == "orb" and len(claiming(answers, answer.device_id)) == 1:
            memory.remember(
                answer.device_id,
                name=answer.name,
                virtual=answer.virtual,
                port=answer.url,
                seen=seen,
            )


def now() -> str:
    """Return the time, as the device store writes it."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def claiming(answers: list[Answer], device_id: str) -> list[str]:
    """Return the ports that claim to be a device's."""
    return [a.url for a in answers if a.outcome == "orb" and a.device_id == device_id]


class DevicePort:
    """Opens the port of one device: pass `open` to a Receiver, and subscribe `on_received` to it.

    Attributes:
        url: Where the device was last.
    """

    def __init__(self, words: str, memory: DeviceStore, key: str = "") -> None:
        """Look for a device now.

        Args:
            words: Its identity or its name.
            memory: Where devices were before.
            key: The file with its key; "": the one that is remembered, if any.

        Raises:
            LinkError: It is nowhere, or the words mean several devices.
        """
        self._words, self._memory, self._key = words, memory, key
        answer = self._seek()
        self.device_id, self.url = answer.device_id, answer.url

    def open(self) -> Transport:
        """Open the port where it was last; if there is none any more, look for it again.

        Raises:
            LinkError: It is nowhere.
        """
        try:
            return open_transport(self.url)
        except LinkError as error:
            log.info("%s; looking for %s", error, self.device_id)
            self._words = self.device_id
            self.url = self._seek().url
            return open_transport(self.url)

    def on_received(self, received: Sequence[Received]) -> None:
        """Check the identity of the device that has connected.

        Raises:
            LinkError: Another device is behind the port now.
        """
        for news in received:
            if isinstance(news, Connected) and news.welcome.device_id != self.device_id:
                raise LinkError(
                    f"at {self.url} is now {news.welcome.device_id}, not {self.device_id}; "
                    "start again, and it is looked for on the other ports"
                )

    def _seek(self) -> Answer:
        known = self._memory.named(self._words)
        # Where it was first: if it is there, no other port need be touched.
        first = [device.port for device in known if device.port]
        key = self._key or next((device.key for device in known), "")
        answers = ask_all([Port(url, key=key) for url in first])
        if not _matching(answers, self._words):
            others = candidates(self._memory)
            rest = [replace(port, key=key) for port in others if port.url not in first]
            answers += ask_all(rest)
        note(self._memory, answers)
        found = _matching(answers, self._words)
        if len(found) == 1:
            return found[0]
        if found:
            places = ", ".join(f"{a.device_id} at {a.url}" for a in found)
            raise LinkError(f"{self._words!r} is not one device: {places}; use --link")
        here = ", ".join(a.device_id for a in answers if a.outcome == "orb") or "no orb"
        why = next((a.why for a in answers if a.url in first), "")
        raise LinkError(
            f"{self._words!r} is not there, found {here}"
            + (f" ({why})" if why else "")
            + "; see host find, or name its port with --link"
        )


def _matching(answers: list[Answer], words: str) -> list[Answer]:
    """Return the devices of an identity or, if there are none, of a name."""
    here = [answer for answer in answers if answer.outcome == "orb"]
    exact = [answer for answer in here if answer.device_id == words]
    return exact or [answer for answer in here if answer.name == words]
