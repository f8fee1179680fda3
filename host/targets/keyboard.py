"""The keyboard as a target: commands press keys in whatever program has the focus."""

from host.targets import TargetOptions
from host.targets._keys import KeysTarget
from host.targets._keys import create as create_keys


def create(options: TargetOptions) -> KeysTarget:
    """Make the keyboard, disarmed."""
    return create_keys("keyboard", options)
