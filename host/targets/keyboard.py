"""Target that presses keys of the keyboard in the program with the focus."""

from functools import partial

from host.targets import keys

create = partial(keys.create, "keyboard")
