"""The application on a screen, by a real pointer: a line for each scenario with its seconds.

    python -m tests.system.window [SCENARIO ...] [--json] [--keep DIR]

It needs Xvfb, xdotool and ImageMagick's `import`. Each scenario begins with fresh settings and
data; --keep saves the last picture of each.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from .desktop import ScenarioError, Screen, Window, missing
from .walk import HANDS, SHUT, Orb, Page, walk

SIZE: Final = (1280, 720)
CLICK_S: Final = 0.08  # how long people's clicks last
NEXT_S: Final = 0.35  # from one to the next
LEFT: Final = (-0.55, 0.1)  # places on the dome, shares of its radius
RIGHT: Final = (0.55, 0.1)
TOP: Final = (0.0, 0.05)


class Desk:
    """A screen, a home folder, and the windows that a scenario opens.

    Attributes:
        seen: What it measured, by name.
    """

    def __init__(self, screen: Screen, home: Path, stack: ExitStack) -> None:
        self._screen, self._home, self._stack = screen, home, stack
        self.seen: dict[str, float] = {}
        self.window: Window | None = None

    def open(self, *options: str) -> Window:
        """Open the application, and wait until its orb can be touched."""
        self.window = window = self._stack.enter_context(Window(self._screen, self._home, options))
        window.until(lambda shown: shown["link"] == "live" and shown["ready"], "the orb")
        return window


Scenario = Callable[[Desk], None]
SCENARIOS: dict[str, Scenario] = {}
EVERY: set[Page] = set()  # pages that the walks before have reached


def scenario(do: Scenario) -> Scenario:
    """Register a scenario by its function's name."""
    SCENARIOS[do.__name__] = do
    return do


@scenario
def first_picture(desk: Desk) -> None:
    """Open the window."""
    desk.seen["picture_s"] = desk.open().started_s


@scenario
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


@scenario
def pinch_and_twist(desk: Desk) -> None:
    """Drop a piece by a right click, and turn one by a drag round the rim."""
    window = desk.open()
    _play(window)
    window.press(*TOP, 0.25, button=3)
    window.until(lambda shown: shown["game"][1] == 1, "a dropped piece")
    time.sleep(0.8)
    window.twist(65)
    window.until(lambda shown: shown["gestures"][-1].startswith("twist"), "a twist")


@scenario
def teach_swipe(desk: Desk) -> None:
    """Teach a swipe with the mouse, and play with it."""
    window = desk.open()
    begun_s = time.monotonic()
    for item in ("Teach", "New gesture…", "swipe", "Do it now"):
        window.choose(item)
    window.at("ExamplesPage")
    for count in range(1, 6):
        time.sleep(0.6)
        swipe(window, count)
        window.until(_taken(count), "an example")
    desk.seen["examples_s"] = time.monotonic() - begun_s
    window.at("TryPage", 60.0)
    desk.seen["learned_s"] = time.monotonic() - begun_s
    for count in range(1, 6):
        swipe(window, count)
        window.until(_tried(count), "a try")
    desk.seen["tried"] = int(window.shown["table"][0][1].split()[0])
    window.choose("Play with it")
    window.until(lambda shown: shown["screen"] == "PlayScreen", "the game")
    desk.seen["playing_s"] = time.monotonic() - begun_s
    time.sleep(1.2)
    before = len(window.shown["gestures"])
    for count in range(10):
        swipe(window, count)
        time.sleep(1.0)
    made = window.shown["gestures"][before:]
    desk.seen["understood"] = made.count("swipe")
    desk.seen["others"] = len(made) - made.count("swipe")
    if desk.seen["playing_s"] > 60 or desk.seen["understood"] < 9:
        raise ScenarioError(f"10 swipes became {made}")


def _taken(count: int) -> Callable[[dict[str, Any]], bool]:
    """Return whether so many examples are shown, or the learning begins."""
    return lambda shown: shown["values"][0].startswith((f"{count}/5", "in "))


def _tried(count: int) -> Callable[[dict[str, Any]], bool]:
    """Return whether so many tries are shown."""
    return lambda shown: shown["table"][0][1].endswith(f"of {count}")


def swipe(window: Window, number: int) -> None:
    """Swipe from left to right, each time a little differently."""
    height, reach = 0.1 * (number % 3 - 1), 0.45 + 0.05 * (number % 2)
    path = [(reach * (k / 6 - 1), height + 0.02 * k) for k in range(13)]
    window.stroke(path, 0.3 + 0.05 * (number % 3))


@scenario
def walk_by_mouse(desk: Desk) -> None:
    """Reach every page with the pointer, and come back."""
    _walk(desk, "mouse")


@scenario
def walk_by_keys(desk: Desk) -> None:
    """The same with the keyboard."""
    _walk(desk, "keys")


@scenario
def walk_by_pad(desk: Desk) -> None:
    """The same with a game pad."""
    _walk(desk, "pad")


@scenario
def walk_by_orb(desk: Desk) -> None:
    """The same with the orb."""
    _walk(desk, "orb")


# Pages that take gestures for themselves: the orb cannot steer them.
TAKING: Final = frozenset({"Learn the orb", "Watch"})


def _walk(desk: Desk, name: str) -> None:
    window = desk.open()
    hand = HANDS[name](window)
    found = walk(hand, shut=SHUT | TAKING)
    desk.seen["pages"] = len(found)
    if isinstance(hand, Orb):
        desk.seen["missed"] = hand.missed
    if EVERY and (lacking := EVERY - set(found)):
        raise ScenarioError(f"{sorted(lacking)} cannot be reached")
    EVERY.update(found)


def _play(window: Window) -> None:
    """Begin a game from the title page."""
    window.choose("Play")
    window.until(lambda shown: shown["screen"] == "PlayScreen", "the game")
    time.sleep(1.2)  # the first piece does not move at once


# -- running them ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a scenario went."""

    name: str
    seconds: float
    trouble: str  # "" if it went well
    seen: dict[str, float]

    def line(self) -> str:
        """Return it for people."""
        figures = ", ".join(f"{key} {value:.4g}" for key, value in self.seen.items())
        said = f"FAILED: {self.trouble}" if self.trouble else "ok"
        return f"{self.name:24} {self.seconds:6.1f} s  {said}{'  ' if figures else ''}{figures}"


def run(name: str, keep: Path | None) -> Outcome:
    """Carry a scenario out on a screen of its own."""
    trouble, begun_s = "", time.monotonic()
    with ExitStack() as stack:
        home = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        screen = Screen(SIZE)
        stack.callback(screen.close)
        desk = Desk(screen, home, stack)
        try:
            SCENARIOS[name](desk)
        except ScenarioError as error:
            trouble = str(error)
        seconds = time.monotonic() - begun_s
        if keep is not None and desk.window is not None:
            desk.window.picture(keep / f"{name}.png")
    return Outcome(name, seconds, trouble, desk.seen)


def main() -> int:
    """Return 0 if every scenario went well, 1 if not, 2 if they cannot be run here."""
    parser = argparse.ArgumentParser(prog="python -m tests.system.window", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="SCENARIO", help=", ".join(SCENARIOS))
    parser.add_argument("--json", action="store_true", help="print one object a line")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="save the last picture of each")
    options = parser.parse_args()
    if unknown := set(options.names) - set(SCENARIOS):
        parser.error(f"there is no scenario {min(unknown)}; there are {', '.join(SCENARIOS)}")
    if absent := missing():
        parser.error(f"{', '.join(absent)} must be installed")
    well = True
    for name in options.names or SCENARIOS:
        outcome = run(name, options.keep)
        well = well and not outcome.trouble
        fields = {key: getattr(outcome, key) for key in outcome.__slots__}
        print(json.dumps(fields) if options.json else outcome.line(), flush=True)
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
