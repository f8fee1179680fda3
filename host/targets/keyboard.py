"""The keyboard as a target: commands press keys in whatever program has the focus."""

from functools import partial

from host.targets import keys

create = partial(keys.create, "keyboard")
