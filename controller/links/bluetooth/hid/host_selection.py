"""Selection of the active one of several paired hosts. Pure; time comes in.

One host at a time: what is pressed shall reach one screen only. The orb waits for the host that had
it last, and after a while takes whichever paired host comes. A player changes hosts by a command.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

from controller.keymap.keymap import NEXT_HOST

WAIT_S: Final = 10.0  # for the host that is wanted, before any other will do


@dataclass(frozen=True, slots=True)
class StoredHosts:
    """What is remembered from one run to the next.

    Attributes:
        hosts: Addresses of all hosts that ever had the orb, oldest first.
        wanted: The one that had it last, "" if none.
    """

    hosts: tuple[str, ...] = ()
    wanted: str = ""


class HostSelection:
    """Who is there, and who has the orb.

    Attributes:
        known: To be remembered; changes only when a host gets the orb, or is wished for.
        active: The host that has the orb, "" if none.
    """

    def __init__(self, known: StoredHosts, only: str = "", now_s: float = 0.0) -> None:
        """Begin with nobody there.

        Args:
            known: From the last run.
            only: The address of the one host that may have the orb, "" for any.
            now_s: The time.
        """
        self.known = StoredHosts(known.hosts, only) if only else known
        self.active = ""
        self._only = only
        self._present: list[str] = []  # in the order in which they came
        self._open_s = now_s + WAIT_S  # from then on anyone will do

    @property
    def due_s(self) -> float | None:
        """When `tick` has something to do, None if never."""
        return None if self.active or not self._present or self._only else self._open_s

    def arrive(self, address: str, now_s: float) -> None:
        """A paired host has connected."""
        if address not in self._present:
            self._present.append(address)
        self.tick(now_s)

    def leave(self, address: str, now_s: float) -> None:
        """It has gone."""
        if address in self._present:
            self._present.remove(address)
        if address == self.active:
            self.active = ""
            self._open_s = now_s + WAIT_S

    def forget(self, bonded: Collection[str]) -> None:
        """Only these are still paired."""
        kept = tuple(address for address in self.known.hosts if address in bonded)
        wanted = self.known.wanted
        self.known = StoredHosts(kept, wanted if wanted in bonded or wanted == self._only else "")

    def change(self, number: int, now_s: float) -> str:
        """Give the orb to another host, now or as soon as it comes.

        Args:
            number: Which of those that are known, from 1; or `NEXT_HOST`.
            now_s: The time.

        Returns:
            What was done, for the log.
        """
        hosts: Sequence[str] = self.known.hosts
        if self._only:
            return f"this orb was started for {self._only} only"
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
        """Let time pass; whoever may have the orb gets it."""
        if self.active:
            return
        wanted = self.known.wanted
        anyone = not self._only and (not wanted or now_s >= self._open_s)
        for address in self._present:
            if address == wanted or anyone:
                self.active = address
                fresh = () if address in self.known.hosts else (address,)
                self.known = StoredHosts(self.known.hosts + fresh, address)
                return

    def unwanted(self) -> list[str]:
        """Return who is there and shall go, so that nothing reaches it."""
        return [address for address in self._present if address != self.active]
