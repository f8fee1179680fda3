"""Reliable commands: the device's queue of unacknowledged ones, the host's record of the others.

Both outlive a session. Every command gets a number, counted from the device's start. It leaves the
queue when the host has acknowledged it, or when it is too old to be obeyed, and is then lost: the
host learns that from `done`, the newest number that will not be sent again. Pure: time comes in.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

from controller.protocol.messages import LATE_MS, Command

RESEND_MS: Final = 50  # until a command that is not acknowledged is sent again, at least
MOST: Final = 32  # commands that wait; a player gives a few a second, and they wait 250 ms


@dataclass(slots=True)
class PendingCommand:
    """A command on its way.

    Attributes:
        number: Which command since the device's start.
        command: What the player asked for.
        t_ms: The device's time that it belongs to.
        put_ms: The link's clock when it was given.
        sent_ms: The same when it was sent last; None: never.
    """

    number: int
    command: Command
    t_ms: int
    put_ms: int
    sent_ms: int | None = None


class RetransmitQueue:
    """What is not acknowledged, oldest first.

    Attributes:
        number: Of the newest command.
        host: Which host it is for: what that one drew at its start; 0: none yet.
        lost: Commands that were given up: never acknowledged in time.
        missed: Commands that the host said it never got in time; it knows best.
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
        """What may still be sent, oldest first."""
        return tuple(self._posted)

    @property
    def done(self) -> int:
        """The newest number that will not be sent again; all before it are done as well."""
        return self._posted[0].number - 1 if self._posted else self.number

    def put(self, command: Command, t_ms: int, now_ms: int) -> PendingCommand:
        """Give a command its number, and keep it until it is acknowledged or too old."""
        self.expire(now_ms)
        if len(self._posted) >= MOST:
            self._posted.popleft()
            self.lost += 1
        self.number += 1
        posted = PendingCommand(self.number, command, t_ms, now_ms)
        self._posted.append(posted)
        return posted

    def acknowledge(self, done: int) -> None:
        """Forget what the host has; a number that was never given is ignored."""
        if done <= self.number:
            while self._posted and self._posted[0].number <= done:
                self._posted.popleft()

    def expire(self, now_ms: int) -> None:
        """Give up what is too old: a late drop is worse than none."""
        while self._posted and now_ms - self._posted[0].put_ms > LATE_MS:
            self._posted.popleft()
            self.lost += 1

    def begin(self, host: int) -> None:
        """Begin with another host, which has no claim on what was before it."""
        self.lost += len(self._posted)
        self._posted.clear()
        self.host, self.missed = host, 0


@dataclass(slots=True)
class SessionHistory:
    """The host's record of the sessions before, so that the next one goes on where they ended.

    Attributes:
        host_nonce: Drawn at the host's start, u32 and not 0.
        boot_nonce: Of the device that was there last; it draws another at each start.
        done: Number of the newest command of that device that was delivered, or missed.
        missed: How many were missed, since it was met first.
    """

    host_nonce: int = 1
    boot_nonce: int = 0
    done: int = 0
    missed: int = 0

    def give_up(self, done: int) -> int:
        """Count the commands up to `done` that never came as missed; return how many."""
        count = max(done - self.done, 0)
        self.done, self.missed = self.done + count, (self.missed + count) & 0xFFFFFFFF
        return count
