"""A virtual pad as a target: commands press its buttons, in games that know pads."""

from host.keys.target import KeysTarget
from host.keys.target import create as create_keys
from host.targets import TargetOptions


def create(options: TargetOptions) -> KeysTarget:
    """Make the pad, disarmed."""
    return create_keys("gamepad", options)
