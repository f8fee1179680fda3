"""Target that presses the buttons of a virtual gamepad."""

from functools import partial

from host.targets import keys

create = partial(keys.create, "gamepad")
