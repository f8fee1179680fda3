"""Analogue-to-digital converters on the SPI bus, by name; pure."""

from dataclasses import dataclass
from typing import Final

CHANNELS: Final = 8  # single-ended inputs of each type


@dataclass(frozen=True, slots=True)
class Chip:
    """One type of converter, which answers three bytes with its count in the lowest bits."""

    bits: int  # resolution
    fastest_hz: int  # the SPI clock that it is good for at 3.3 V

    def request(self, channel: int) -> bytes:
        """Return the bytes that ask for a channel: a start bit, single-ended, the channel."""
        return ((0b11000 | channel) << self.bits + 2).to_bytes(3, "big")

    def decode(self, answer: bytes) -> int | None:
        """Return the count; None: no converter is there, which would pull the null bit low."""
        told = int.from_bytes(answer, "big")
        return None if told >> self.bits & 1 else told & (1 << self.bits) - 1


# Microchip, data sheets DS21295 and DS21298, figures 6-1.
CHIPS: Final = {"mcp3008": Chip(10, 1_350_000), "mcp3208": Chip(12, 1_000_000)}
