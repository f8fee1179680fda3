"""A game without any code of the project: it prints pygame's pads, and what is pressed on them."""

from __future__ import annotations

import os
import sys
import time

os.environ["SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS"] = "1"
import pygame

WAIT_S = 60.0


def main() -> int:
    """Print what happens, one line each, until standard input ends."""
    pygame.init()
    pygame.display.set_mode((64, 64))
    end_s, pads = time.monotonic() + WAIT_S, {}
    while time.monotonic() < end_s:
        event = pygame.event.wait(200)
        if event.type == pygame.JOYDEVICEADDED:
            pad = pygame.joystick.Joystick(event.device_index)
            pads[pad.get_instance_id()] = pad
            print(
                f"pad {pad.get_name()!r}, {pad.get_numbuttons()} buttons, "
                f"{pad.get_numhats()} hat, {pad.get_numaxes()} axes",
                flush=True,
            )
        elif event.type == pygame.JOYBUTTONDOWN:
            print(f"button {event.button}", flush=True)
        elif event.type == pygame.JOYHATMOTION and any(event.value):
            print(f"hat {event.value}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
