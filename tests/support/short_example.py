"""Run an example on half a minute at 10 Hz for each minute at 40 Hz: `python FILE EXAMPLE ...`.

It imports the interface alone, so that it also runs where only the wheel is installed.
"""

import runpy
import sys
from pathlib import Path

import orbtouch

_SHIPPED = Path(orbtouch.__file__).parents[1] / "models" / "orbtouch-10hz.orb"
_simulate, _load_network = orbtouch.simulate, orbtouch.load_network


def simulate(*, minutes: float, user: int, rate_hz: float = 10.0) -> orbtouch.Recording:
    """Return half the session at a quarter of the rate."""
    return _simulate(minutes=minutes / 2, user=user, rate_hz=rate_hz)


def load_network() -> orbtouch.Network:
    """Return the network that ships for 10 Hz."""
    return _load_network(_SHIPPED)


if __name__ == "__main__":
    for own in (simulate, load_network):
        setattr(orbtouch, own.__name__, own)
    del sys.argv[0]
    runpy.run_path(sys.argv[0], run_name="__main__")
