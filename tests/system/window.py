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

from .desktop import ScenarioError, Screen, VirtualOrb, Window, installed, missing
from .walk import HANDS, Orb, Page, walk

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
        self._screen, self.home, self._stack = screen, home, stack
        self.seen: dict[str, float] = {}
        self.window: Window | None = None

    def open(self, *options: str, python: str = sys.executable, introduced: bool = True) -> Window:
        """Open the application, and wait until its orb can be touched."""
        window = Window(self._screen, self.home, options, python)
        self.window = self._stack.enter_context(window)
        window.until(lambda shown: shown["link"] == "live" and shown["ready"], "the orb", 30.0)
        if introduced and "Later" in window.shown["items"]:  # the introduction is offered once
            window.choose("Later")
        return window

    def orb(self) -> VirtualOrb:
        """Start a virtual orb that listens on loopback."""
        return self._stack.enter_context(VirtualOrb(self.home))


Scenario = Callable[[Desk], None]
Make = Callable[[Window, int], None]  # makes a gesture, a little differently by number
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


@scenario
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
        case "pinch":
            window.press(0.0, 0.0, 0.25, button=3)
        case "twist_cw" | "twist_ccw":
            window.twist(65 if label == "twist_cw" else -65)
        case _:
            window.press(x, y, 0.12)


@scenario
def teach_swipe(desk: Desk) -> None:
    """Teach a swipe with the mouse, and play with it."""
    _teach(desk, desk.open(), "swipe", swipe)


@scenario
def teach_double_tap(desk: Desk) -> None:
    """Teach a double tap, and play with it."""
    _teach(desk, desk.open(), "double tap", double_tap)


@scenario
def keep_and_undo(desk: Desk) -> None:
    """Teach a gesture, correct it wrongly, take that back, restart, undo the lesson."""
    window = desk.open()
    _learn(desk, window, "swipe", swipe)
    window.choose("Save as…")
    window.choose("mine")
    window.until(lambda shown: "saved as" in shown["notice"], "the saved file")
    window.choose("List of gestures")
    swipe(window, 1)
    time.sleep(0.6)
    window.choose("That was…")
    window.choose("pinch")
    window.until(lambda shown: "learned: that was pinch" in shown["notice"], "the correction", 60)
    window.choose("That was…")
    window.choose("Undo the last correction")
    window.until(lambda shown: "taken back" in shown["notice"], "the correction's end", 60)
    window.close()
    window = desk.open()
    desk.seen["after_restart"] = sum(_answer(window, number) == "swipe" for number in range(5))
    window.choose("Teach")
    window.choose("Undo, save, delete…")
    window.choose("Undo the last change")
    window.until(lambda shown: "swipe" not in shown["labels"], "the list without it", 60)
    window.close()
    window = desk.open()
    desk.seen["after_undo"] = sum(_answer(window, number) == "swipe" for number in range(5))
    if desk.seen["after_restart"] < 4 or desk.seen["after_undo"]:
        raise ScenarioError("what was taught was lost, or stayed")


def _answer(window: Window, number: int) -> str:
    """Return what a swipe is taken for; "" for nothing."""
    before = len(window.shown["gestures"])
    swipe(window, number)
    time.sleep(1.0)
    return "".join(window.shown["gestures"][before : before + 1])


@scenario
def killed_orb(desk: Desk) -> None:
    """Teach an orb in a process of its own over TCP, which is killed in the middle."""
    orb = desk.orb()
    window = desk.open(*orb.options)
    _begin(window, "swipe")
    for count in range(1, 3):
        swipe(window, count)
        window.until(_taken(count), "an example")
    orb.kill()
    window.until(lambda shown: shown["link"] != "live", "the lost link", 10.0)
    orb.start()
    window.until(lambda shown: shown["link"] == "live" and shown["ready"], "the orb again", 60.0)
    desk.seen["examples_kept"] = int(window.shown["values"][0].split("/")[0])
    for count in range(3, 6):
        swipe(window, count)
        window.until(_taken(count), "an example")
    window.until(lambda shown: shown["screen"] == "LearningPage", "the learning", 30.0)
    time.sleep(1.0)
    orb.kill()
    orb.start()
    window.until(lambda shown: shown["link"] == "live" and shown["ready"], "the orb again", 60.0)
    answers = [_answer(window, number) for number in range(3)]
    desk.seen["after_kill"] = answers.count("swipe")
    if desk.seen["examples_kept"] < 2:
        raise ScenarioError("examples were lost")


def _begin(window: Window, name: str) -> None:
    """Go to the page on which examples are taken."""
    for item in ("Teach", "New gesture…", name, "Do it now"):
        window.choose(item)
    window.at("ExamplesPage")


def _learn(desk: Desk, window: Window, name: str, make: Make) -> float:
    """Teach a gesture by five examples, and try it five times; return when that began."""
    begun_s = time.monotonic()
    _begin(window, name)
    for count in range(1, 6):
        time.sleep(0.6)
        make(window, count)
        window.until(_taken(count), "an example")
    desk.seen["examples_s"] = time.monotonic() - begun_s
    window.at("TryPage", 60.0)
    desk.seen["learned_s"] = time.monotonic() - begun_s
    kept = [row[1] for row in window.shown["table"] if "kept" in row[0]]
    desk.seen["kept_percent"] = float(kept[0].split()[0]) if kept else float("nan")
    for count in range(1, 6):
        make(window, count)
        window.until(_tried(count), "a try")
        time.sleep(0.3)
    desk.seen["tried"] = int(window.shown["table"][0][1].split()[0])
    return begun_s


def _teach(desk: Desk, window: Window, name: str, make: Make) -> None:
    """Teach a gesture, and make it ten times in a game; at least nine are to be understood."""
    begun_s = _learn(desk, window, name, make)
    window.choose("Play with it")
    window.until(lambda shown: shown["screen"] == "PlayScreen", "the game")
    desk.seen["playing_s"] = time.monotonic() - begun_s
    time.sleep(1.2)
    label, before = name.replace(" ", "_"), len(window.shown["gestures"])
    for count in range(10):
        make(window, count)
        time.sleep(1.0)
    made = window.shown["gestures"][before:]
    desk.seen |= {"understood": made.count(label), "others": len(made) - made.count(label)}
    if desk.seen["playing_s"] > 60 or desk.seen["understood"] < 9:
        raise ScenarioError(f"10 times {name} became {made}")


def _taken(count: int) -> Callable[[dict[str, Any]], bool]:
    """Return whether so many examples are shown, or the learning begins."""
    return lambda shown: shown["values"][0].startswith((f"{count}/5", "in "))


def _tried(count: int) -> Callable[[dict[str, Any]], bool]:
    """Return whether so many tries are shown."""
    return lambda shown: shown["table"][0][1].endswith(f"of {count}")


def double_tap(window: Window, number: int) -> None:
    """Click twice at nearly one place."""
    x, y = 0.1 * (number % 3 - 1), 0.08 * (number % 2)
    for _ in range(2):
        window.press(x, y, 0.08)
        time.sleep(0.09)


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


def _walk(desk: Desk, name: str) -> None:
    window = desk.open()
    hand = HANDS[name](window)
    found = walk(hand)
    desk.seen["pages"] = len(found)
    if isinstance(hand, Orb):
        desk.seen["missed"] = hand.missed
    if lacking := EVERY - set(found):
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
