"""A converter on the SPI bus that answers bit by bit, as its data sheet says."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass
class FakeChip:
    """An MCP3008 or MCP3208, clocked in SPI mode 0.

    Attributes:
        bits: Its resolution.
        measure: Returns what an input sees, of full scale, as it is sampled.
    """

    bits: int
    measure: Callable[[int], float]

    def transfer(self, data: bytes) -> bytes:
        """Clock all bits through: start, single-ended, three of channel, a pause, null, result."""
        total = 8 * len(data)
        told = int.from_bytes(data, "big")
        after = told.bit_length() - 1  # bits that follow the start bit
        answer = (1 << total) - 1  # high impedance, pulled up
        if after >= 4 and told >> (after - 1) & 1:
            count = round(self.measure(told >> (after - 4) & 0b111) * (1 << self.bits))
            count = min(max(count, 0), (1 << self.bits) - 1)
            # Four bits of address and one of sampling; then null, then the result, from the top.
            left = after - 5
            result = (
                count << (left - 1 - self.bits)
                if left > self.bits
                else count >> (self.bits + 1 - left)
            )
            if left > 0:
                answer = answer >> left << left | result & ((1 << left) - 1)
        return answer.to_bytes(len(data), "big")

    def close(self) -> None:
        """Nothing is held."""
