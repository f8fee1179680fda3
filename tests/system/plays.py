"""Scenarios that start the application and play with the orb."""

import time
from collections.abc import Callable
from typing import Any, Final

from .desktop import Desk, ScenarioError, Window, installed

CLICK_S: Final = 0.08  # how long people's clicks last
NEXT_S: Final = 0.35  # from one to the next
LEFT: Final = (-0.55, 0.1)  # places on the dome, shares of its radius
RIGHT: Final = (0.55, 0.1)
TOP: Final = (0.0, 0.05)


def first_picture(desk: Desk) -> None:
    """Open the window."""
    desk.seen["picture_s"] = desk.open().started_s


def clicks(desk: Desk) -> None:
    """Play by clicking as fast as people do: every click is one command."""
    window = desk.open()
    _play(window)
    before = len(window.shown["gestures"])
    meant = [LEFT, RIGHT, RIGHT, LEFT] * 3
    for place in meant:
        window.press(*place, CLICK_S)
        time.sleep(NEXT_S - CLICK_S)
    time.sleep(0.5)
    made = window.shown["gestures"][before:]
    desk.seen |= {"clicks": len(meant), "understood": len(made)}
    if made != ["press"] * len(meant):
        raise ScenarioError(f"{len(meant)} clicks became {made}")


def pinch_and_twist(desk: Desk) -> None:
    """Drop a piece by a right click, and turn one by a drag round the rim."""
    window = desk.open()
    _play(window)
    window.press(*TOP, 0.25, button=3)
    window.until(lambda shown: shown["game"][1] == 1, "a dropped piece")
    time.sleep(0.8)
    window.twist(65)
    window.until(lambda shown: shown["gestures"][-1].startswith("twist"), "a twist")


def from_install(desk: Desk) -> None:
    """Install in a new environment, start, and give the first command in the introduction."""
    begun_s = time.monotonic()
    python = installed(desk.home / "venv")
    desk.seen["installed_s"] = time.monotonic() - begun_s
    window = desk.open(python=python, introduced=False)
    window.choose("Learn the orb")
    window.until(lambda shown: shown["screen"] == "LearnScreen", "the introduction")
    time.sleep(1.0)
    window.press(*LEFT, CLICK_S)
    window.until(lambda shown: shown["gestures"] == ["press"], "a command")
    desk.seen["command_s"] = time.monotonic() - begun_s


def introduction(desk: Desk) -> None:
    """Make every gesture of the introduction as it asks for it."""
    window = desk.open(introduced=False)
    begun_s = time.monotonic()
    window.choose("Learn the orb")
    done = 0
    while "Menu" not in window.shown["labels"]:
        step = window.shown["step"]
        time.sleep(0.8)  # for reading
        show(window, *step)
        done += 1
        window.until(_another(step), "the next step", 6.0)
    desk.seen |= {"steps": done, "seconds": time.monotonic() - begun_s}


def _another(step: object) -> Callable[[dict[str, Any]], bool]:
    """Return whether another step is shown."""
    return lambda shown: shown["step"] != step


def show(window: Window, label: str, x: float, y: float) -> None:
    """Make a gesture with the mouse; the place is in shares of the dome's radius."""
    match label:
        case "pinch" | "deeper":
            window.press(0.0, 0.0, 0.25, button=3)
        case "twist_cw" | "twist_ccw":
            window.twist(65 if label == "twist_cw" else -65)
        case _:
            window.press(x, y, 0.12)


def _play(window: Window) -> None:
    """Begin a game from the title page."""
    window.choose("Play")
    window.choose("Start")
    window.until(lambda shown: shown["screen"] == "PlayScreen", "the game")
    time.sleep(1.2)  # the first piece does not move at once
