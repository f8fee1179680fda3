"""A virtual pad as a target: commands press its buttons, in games that know pads."""

from host.targets import TargetOptions
from host.targets._keys import KeysTarget
from host.targets._keys import create as create_keys


def create(options: TargetOptions) -> KeysTarget:
    """Make the pad, disarmed."""
    return create_keys("gamepad", options)
