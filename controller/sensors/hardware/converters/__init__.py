"""Analogue-to-digital converters, one file each, found by name; pure.

A file has `CHIP`, a `Chip`: what is written to the SPI bus to read a channel, and what the answer
means.
"""

import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module

from controller.sensors.hardware import HardwareError


@dataclass(frozen=True, slots=True)
class Chip:
    """One type of converter.

    Attributes:
        bits: Resolution.
        channels: Single-ended inputs.
        fastest_hz: The SPI clock that it is good for at 3.3 V.
        request: The bytes that ask for a channel.
        decode: The count in the answer to a request; None: no converter answers like this.
    """

    bits: int
    channels: int
    fastest_hz: int
    request: Callable[[int], bytes]
    decode: Callable[[bytes], int | None]


def names() -> list[str]:
    """Return the types that there are."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


@cache
def find(name: str) -> Chip:
    """Return the chip of a type.

    Raises:
        HardwareError: There is no such type.
    """
    if name not in names():
        raise HardwareError(f"there is no converter {name!r}; there are {', '.join(names())}")
    chip: Chip = import_module(f"{__name__}.{name}").CHIP
    return chip
