"""The keyboard as a target: commands press keys in whatever program has the focus."""

from host.keys.target import KeysTarget
from host.keys.target import create as create_keys
from host.targets import TargetOptions


def create(options: TargetOptions) -> KeysTarget:
    """Make the keyboard, disarmed."""
    return create_keys("keyboard", options)
