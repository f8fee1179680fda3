"""Random signals to `host` and its watchdog with uinput: nothing stays down in /dev/input."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from evdev import ecodes

from tests.benchmarks.key_signals import MAPPING, STROKES, rounds, summary
from tests.support.x_programs import Player

from ..guest import PATIENCE, CaseError, Guest
from .keys import find

ROUNDS = 5  # of each kind
# The dead-man time, the watchdog's answer, and what a machine emulated in software adds.
LIMIT_S = 1.5 + 0.5 * PATIENCE
PAD_MAPPING = """
[everywhere]
menu = { arm = true }

[profile.pad]
down = { pad = "a", mode = "hold" }
hold = { pad = "stick_left", mode = "toggle" }
right = { pad = "right", mode = "repeat" }
drop = { pad = "b" }
left = { pad = "look_up", mode = "hold" }
"""
PLAYED = {
    "keyboard": (MAPPING, STROKES),
    "gamepad": (PAD_MAPPING, ("hold down", "tap hold", "hold right", "tap drop", "hold left")),
}


class Input:
    """The device that the watchdog makes, as programs see it."""

    def __init__(self, guest: Guest, name: str) -> None:
        self._guest, self._name = guest, name
        self._device: Any = None

    def down(self) -> Sequence[object]:
        """Return the keys that are down and the axes that are off their middle."""
        try:
            self._device = self._device or find(self._name)
            if self._device is None:
                return ()
            axes = self._device.capabilities(absinfo=False).get(ecodes.EV_ABS, [])
            off = [f"axis {code}" for code in axes if self._device.absinfo(code).value]
            return (*self._device.active_keys(), *off)
        except (OSError, SystemError):  # the device has gone, and its keys with it
            self._device = None
            return ()

    def lift(self) -> None:
        """Wait until the device of a dead watchdog has gone."""
        self._device = None
        self._guest.until(lambda: find(self._name) is None, "the device to vanish")


def run(guest: Guest) -> None:
    """Play some rounds with a keyboard and with a pad."""
    for kind, (mapping, strokes) in PLAYED.items():
        keys = Path(f"/tmp/{kind}.toml")
        keys.write_text(mapping)
        played = rounds(
            Input(guest, f"OrbTouch {kind}"),
            lambda orb, kind=kind, keys=keys: Player(  # type: ignore[misc]
                dict(os.environ), orb, keys, backend="uinput", target=kind
            ),
            seed=1,
            count=ROUNDS,
            strokes=strokes,
            limit_s=LIMIT_S,
        )
        guest.saw(f"{kind}: {summary(played)}")
        failed = [str(plan) for plan, outcome in played if outcome.survivor and not outcome.ok]
        if failed:
            raise CaseError(f"{kind}: down for longer than {LIMIT_S} s: {'; '.join(failed)}")
