"""Microchip MCP3208: 12 bits, 8 inputs (data sheet DS21298, figure 6-1)."""

from typing import Final

from controller.sensors.hardware.converters import Chip


def request(channel: int) -> bytes:
    """Return five zeros, the start bit, single-ended, and the channel's three bits."""
    return bytes((0x06 | channel >> 2, (channel & 0x03) << 6, 0x00))


def decode(answer: bytes) -> int | None:
    """Return the twelve bits after the null bit, which the converter pulls low."""
    return None if answer[1] & 0x10 else (answer[1] & 0x0F) << 8 | answer[2]


CHIP: Final = Chip(12, 8, 1_000_000, request, decode)
