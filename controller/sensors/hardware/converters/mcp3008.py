"""Microchip MCP3008: 10 bits, 8 inputs (data sheet DS21295, figure 6-1)."""

from typing import Final

from controller.sensors.hardware.converters import Chip


def request(channel: int) -> bytes:
    """Return a start bit, right-aligned in its byte; single-ended; the channel."""
    return bytes((0x01, 0x80 | channel << 4, 0x00))


def decode(answer: bytes) -> int | None:
    """Return the ten bits after the null bit, which the converter pulls low."""
    return None if answer[1] & 0x04 else (answer[1] & 0x03) << 8 | answer[2]


CHIP: Final = Chip(10, 8, 1_350_000, request, decode)
