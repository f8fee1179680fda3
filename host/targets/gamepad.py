"""A virtual pad as a target: commands press its buttons, in games that know pads."""

from functools import partial

from host.targets import keys

create = partial(keys.create, "gamepad")
