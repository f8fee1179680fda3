"""Choices out of bytes: a harness reads its bytes as decisions, so that every input means one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

T = TypeVar("T")


class Choices:
    """Reads bytes from the front; at their end everything is 0, the first, and empty."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    @property
    def left(self) -> int:
        """How many bytes have not been read."""
        return max(len(self._data) - self._at, 0)

    def octets(self, size: int) -> bytes:
        """Return up to so many bytes."""
        found = self._data[self._at : self._at + size]
        self._at += size
        return found

    def number(self, size: int = 1) -> int:
        """Return a number of so many bytes."""
        return int.from_bytes(self.octets(size), "little")

    def one_of(self, things: Sequence[T]) -> T:
        """Return one of up to 256 things."""
        return things[self.number() % len(things)]

    def rest(self) -> bytes:
        return self.octets(self.left)
