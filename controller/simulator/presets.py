"""Orbs to choose from: `nominal`, as clean as the paper's parts could be, and `paper-snr`.

`paper-snr` is as noisy as the paper's own figures say: its taxels drift and its readings scatter
so much that the histogram statistics of section 6 come out as printed (H(z) = 2.71 and
I(z, y) = 0.13, read as nats: tests/benchmarks/information.py). The match is not unique.
"""

from dataclasses import replace
from typing import Final

from controller.errors import UserError
from controller.simulator.orb import NOMINAL, OrbModel

_CIRCUIT: Final = NOMINAL.electronics

PRESETS: Final[dict[str, OrbModel]] = {
    "nominal": NOMINAL,
    "paper-snr": replace(
        NOMINAL,
        electronics=replace(
            _CIRCUIT,
            taxel_drift=(0.03, 120.0),
            readout=replace(_CIRCUIT.readout, noise_lsb=42.0),
        ),
    ),
}


class PresetError(UserError, ValueError):
    """There is no such preset; the message is one sentence."""


def preset(name: str) -> OrbModel:
    """Return the orb of that name.

    Raises:
        PresetError: There is none.
    """
    if name not in PRESETS:
        raise PresetError(f"there is no preset {name!r}; there are {', '.join(PRESETS)}")
    return PRESETS[name]
