"""Hosts of the HID link: selection of the active one among several paired, and their storage.

One host is active at a time, so that a press reaches one screen only. The orb waits for the host
that was active last, and after `WAIT_S` accepts the first paired host that connects. A command
selects another one. `HostSelection` is pure, with explicit time.
"""

from __future__ import annotations

import json
import logging
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from controller.shared.config import MAX_BYTES, parse_json
from controller.shared.files import atomic_write, read_bytes, state_folder
from controller.shared.keymap.keymap import NEXT_HOST

WAIT_S: Final = 10.0  # for the wanted host, before any other becomes active
_ADDRESS: Final = re.compile(r"([0-9A-F]{2}:){5}[0-9A-F]{2}")

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class StoredHosts:
    """Hosts that are stored from one run to the next."""

    hosts: tuple[str, ...] = ()  # addresses of all hosts that were ever active, oldest first
    wanted: str = ""  # the last active one, "" if none


class HostSelection:
    """Connected hosts, and the active one.

    Attributes:
        known: Hosts to store; changes only when a host becomes active, or is selected.
        active: The address of the active host, "" if none.
    """

    def __init__(self, known: StoredHosts, now_s: float = 0.0) -> None:
        """Begin with the hosts of the last run."""
        self.known = known
        self.active = ""
        self._present: list[str] = []  # in the order in which they connected
        self._open_s = now_s + WAIT_S  # from then on any host may become active

    @property
    def due_s(self) -> float | None:
        """Time of the next change by `tick`, None if there is none."""
        return None if self.active or not self._present else self._open_s

    def arrive(self, address: str, now_s: float) -> None:
        """Add a paired host that has connected."""
        if address not in self._present:
            self._present.append(address)
        self.tick(now_s)

    def leave(self, address: str, now_s: float) -> None:
        """Remove a host that has disconnected."""
        if address in self._present:
            self._present.remove(address)
        if address == self.active:
            self.active = ""
            self._open_s = now_s + WAIT_S

    def change(self, number: int, now_s: float) -> str:
        """Select a known host (from 1, or `NEXT_HOST`), now or as soon as it connects.

        Returns a sentence for the log.
        """
        hosts: Sequence[str] = self.known.hosts
        if not hosts or number > len(hosts):
            return f"there is no host {number or 'yet'}; there are {len(hosts)}"
        wanted = self.known.wanted
        after = hosts.index(wanted) + 1 if wanted in hosts else 0
        chosen = hosts[after % len(hosts) if number == NEXT_HOST else number - 1]
        self.known = StoredHosts(self.known.hosts, chosen)
        if self.active != chosen:
            self.active = ""
            self._open_s = now_s + WAIT_S
            self.tick(now_s)
        return f"host {hosts.index(chosen) + 1} of {len(hosts)}, {chosen}"

    def tick(self, now_s: float) -> None:
        """Choose the active host at the present time."""
        if self.active:
            return
        wanted = self.known.wanted
        any_host = not wanted or now_s >= self._open_s
        for address in self._present:
            if address == wanted or any_host:
                self.active = address
                fresh = () if address in self.known.hosts else (address,)
                self.known = StoredHosts(self.known.hosts + fresh, address)
                return

    def unwanted(self) -> list[str]:
        """Return connected hosts that are not active, which are to be disconnected."""
        return [address for address in self._present if address != self.active]


def place() -> Path:
    """Return the path of the stored hosts; a systemd service has its own state folder."""
    folder = os.environ.get("STATE_DIRECTORY", "").partition(":")[0]
    state = Path(folder) if folder else state_folder()
    return state / "hid-hosts.json"


def recall(path: Path) -> StoredHosts:
    """Return the hosts of the last run; none if the file is missing or damaged."""
    try:
        found = parse_json(read_bytes(path, MAX_BYTES))
        hosts, wanted = tuple(found["hosts"]), found["wanted"]
    except FileNotFoundError:
        return StoredHosts()
    except (OSError, ValueError, KeyError, TypeError) as error:
        log.warning("cannot read %s, so no host is known: %s", path, error)
        return StoredHosts()
    known = [host for host in hosts if isinstance(host, str) and _ADDRESS.fullmatch(host)]
    return StoredHosts(tuple(dict.fromkeys(known)), wanted if wanted in known else "")


def remember(path: Path, known: StoredHosts) -> None:
    """Store the hosts for the next run; a failing disk only causes a warning."""
    try:
        atomic_write(path, json.dumps({"hosts": known.hosts, "wanted": known.wanted}).encode())
    except OSError as error:
        log.warning("cannot write %s, so the next run will not know its hosts: %s", path, error)
