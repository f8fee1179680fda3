"""Game pads: plugged in and out at any time, their events as named buttons.

SDL knows most pads and gives their buttons the same names; others are described to it by its
variable SDL_GAMECONTROLLERCONFIG.
"""

from collections.abc import Iterable
from typing import Final, NamedTuple

import pygame
from pygame._sdl2 import controller

from tetris.kit.bindings import BUTTONS

_AXES: Final = {  # below and above the middle
    pygame.CONTROLLER_AXIS_LEFTX: ("stick_left", "stick_right"),
    pygame.CONTROLLER_AXIS_LEFTY: ("stick_up", "stick_down"),
    pygame.CONTROLLER_AXIS_TRIGGERLEFT: ("", "pad_l2"),
    pygame.CONTROLLER_AXIS_TRIGGERRIGHT: ("", "pad_r2"),
}
_FULL: Final = 32768
_PRESS: Final = 0.6  # of the way out; a stick that trembles between the two changes nothing
_RELEASE: Final = 0.4


class Press(NamedTuple):
    """A button that went down or came up."""

    name: str
    down: bool


class Pads:
    """All pads at once. Feed it every event of pygame, and act on what it returns."""

    def __init__(self) -> None:
        self._open: dict[int, controller.Controller] = {}
        self._held: dict[int, set[str]] = {}  # by pad

    def start(self) -> None:
        """Begin to take events; pads that are there already come as events, like later ones."""
        pygame.joystick.init()
        controller.init()

    @property
    def count(self) -> int:
        """Number of pads that are plugged in."""
        return len(self._open)

    def take(self, event: pygame.event.Event) -> list[Press]:
        """Return what an event means: presses and releases, none for events of other devices."""
        match event.type:
            case pygame.JOYDEVICEADDED:
                self._plug_in(event.device_index)
            case pygame.JOYDEVICEREMOVED:
                return self._plug_out(event.instance_id)
            case pygame.CONTROLLERBUTTONDOWN | pygame.CONTROLLERBUTTONUP:
                if name := BUTTONS.get(event.button):
                    down = event.type == pygame.CONTROLLERBUTTONDOWN
                    return self._set(event.instance_id, name, down)
            case pygame.CONTROLLERAXISMOTION:
                names = _AXES.get(event.axis, ("", ""))
                return self._lean(event.instance_id, names, event.value / _FULL)
        return []

    def _plug_in(self, index: int) -> None:
        try:
            if controller.is_controller(index):
                pad = controller.Controller(index)
                self._open[pad.as_joystick().get_instance_id()] = pad
        except pygame.error:
            return  # it was pulled out again before it could be opened

    def _plug_out(self, pad: int) -> list[Press]:
        self._open.pop(pad, None)
        held = sorted(self._held.get(pad, ()))
        return [release for name in held for release in self._set(pad, name, False)]

    def release_all(self) -> None:
        """Forget what is held, as when the window loses the focus."""
        self._held.clear()

    def _lean(self, pad: int, names: Iterable[str], value: float) -> list[Press]:
        """Take a stick's or a trigger's place, -1 to 1, as two buttons."""
        presses: list[Press] = []
        held = self._held.get(pad, set())
        for name, out in zip(names, (-value, value), strict=True):
            if name and (out > _PRESS or (out < _RELEASE and name in held)):
                presses += self._set(pad, name, out > _PRESS)
        return presses

    def _set(self, pad: int, name: str, down: bool) -> list[Press]:
        """Note a button's state; the same name held on two pads comes up with the last of them."""
        held = self._held.setdefault(pad, set())
        if (name in held) is down:
            return []
        if down:
            held.add(name)
        else:
            held.discard(name)
            if any(name in other for other in self._held.values()):
                return []
        return [Press(name, down)]
