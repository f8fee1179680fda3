"""Retransmission queue of unacknowledged commands, and the host's record of received ones.

Both outlive a session. Every command gets a number, counted from the device's start. It leaves the
queue when the host has acknowledged it, or when it is too old, and is then lost: the host detects
that by `done`, the newest number that will not be sent again. Pure: time is an argument.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

from controller.shared.protocol.messages import LATE_MS, Command

RESEND_MS: Final = 50  # least time before an unacknowledged command is resent
MOST: Final = 32  # waiting commands; a player gives a few a second, and each waits 250 ms


@dataclass(slots=True)
class PendingCommand:
    """An unacknowledged command."""

    number: int  # counted from the device's start
    command: Command
    t_ms: int  # the device's time of the command
    put_ms: int  # the link's clock when it was queued
    sent_ms: int | None = None  # the link's clock when it was last sent; None: never


class RetransmitQueue:
    """Unacknowledged commands, oldest first.

    Attributes:
        number: Of the newest command.
        host: The host_nonce of the host that they are for; 0: none yet.
        lost: Commands not acknowledged in time.
        missed: Commands that the host reported as missed.
    """

    def __init__(self) -> None:
        """Begin empty: no command has been given."""
        self.number = 0
        self.host = 0
        self.lost = 0
        self.missed = 0
        self._posted: deque[PendingCommand] = deque()

    @property
    def posted(self) -> tuple[PendingCommand, ...]:
        """Commands that may still be sent, oldest first."""
        return tuple(self._posted)

    @property
    def done(self) -> int:
        """The newest number that will not be sent again; all before it are done as well."""
        return self._posted[0].number - 1 if self._posted else self.number

    def put(self, command: Command, t_ms: int, now_ms: int) -> PendingCommand:
        """Number a command, and keep it until it is acknowledged or too old."""
        self.expire(now_ms)
        if len(self._posted) >= MOST:
            self._posted.popleft()
            self.lost += 1
        self.number += 1
        posted = PendingCommand(self.number, command, t_ms, now_ms)
        self._posted.append(posted)
        return posted

    def acknowledge(self, done: int) -> None:
        """Remove acknowledged commands; a number never assigned is ignored."""
        if done <= self.number:
            while self._posted and self._posted[0].number <= done:
                self._posted.popleft()

    def expire(self, now_ms: int) -> None:
        """Drop commands that are too old: a late one is worse than none."""
        while self._posted and now_ms - self._posted[0].put_ms > LATE_MS:
            self._posted.popleft()
            self.lost += 1

    def begin(self, host: int) -> None:
        """Begin with another host: commands before it are lost."""
        self.lost += len(self._posted)
        self._posted.clear()
        self.host, self.missed = host, 0


@dataclass(slots=True)
class SessionHistory:
    """The host's record of earlier sessions, from which the next one continues."""

    host_nonce: int = 1  # drawn at the host's start, u32 and not 0
    boot_nonce: int = 0  # of the last device; drawn at each start of a device
    done: int = 0  # number of the newest command of that device that was delivered, or missed
    missed: int = 0  # since the first session with that device

    def give_up(self, done: int) -> int:
        """Count commands up to `done` that were not received as missed; return how many."""
        count = max(done - self.done, 0)
        self.done, self.missed = self.done + count, (self.missed + count) & 0xFFFFFFFF
        return count
