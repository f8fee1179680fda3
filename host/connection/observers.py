"""A receiver whose news others hear, too: the taps, and what is remembered of the device."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from controller.protocol.messages import Message
from host.connection.receiver import Received

Ear = Callable[[Sequence[Received]], None]  # takes news, oldest first, without waiting


class Orb(Protocol):
    """What a loop needs of a `host.connection.receiver.Receiver`."""

    def poll(self) -> list[Received]:
        """Return what is new, oldest first, without waiting."""

    def send(self, message: Message) -> object:
        """Send without waiting."""

    def wait(self, timeout_s: float) -> None:
        """Return when there is something to poll, or after the timeout."""


class ObservedReceiver:
    """Passes everything on, and lets the ears have it first."""

    def __init__(self, orb: Orb, ears: Sequence[Ear]) -> None:
        """Take the receiver, and who listens."""
        self._orb, self._ears = orb, ears

    def poll(self) -> list[Received]:
        """Return what is new, oldest first, without waiting."""
        received = self._orb.poll()
        if received:
            for ear in self._ears:
                ear(received)
        return received

    def send(self, message: Message) -> object:
        """Send without waiting."""
        return self._orb.send(message)

    def wait(self, timeout_s: float) -> None:
        """Return when there is something to poll, or after the timeout."""
        self._orb.wait(timeout_s)
