"""Scenarios that teach the orb gestures, and play with them."""

import time
from collections.abc import Callable
from typing import Any

from .desktop import Desk, ScenarioError, Window

Make = Callable[[Window, int], None]  # makes a gesture, a little differently by number


def teach_swipe(desk: Desk) -> None:
    """Teach a swipe with the mouse, and play with it."""
    _teach(desk, desk.open(), "swipe", swipe)


def teach_double_tap(desk: Desk) -> None:
    """Teach a double tap, and play with it."""
    _teach(desk, desk.open(), "double tap", double_tap)


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
    _accept(window)
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
    for item in ("Teach", "New gesture…", name):
        window.choose(item)
    window.at("ExamplesPage")


def _accept(window: Window) -> None:
    """Accept the symmetries that the examples suggest."""
    window.at("DetailsPage", 30.0)
    window.choose("Learn")


def _learn(desk: Desk, window: Window, name: str, make: Make) -> float:
    """Teach a gesture by five examples, and try it five times; return when that began."""
    begun_s = time.monotonic()
    _begin(window, name)
    for count in range(1, 6):
        time.sleep(0.6)
        make(window, count)
        window.until(_taken(count), "an example")
    desk.seen["examples_s"] = time.monotonic() - begun_s
    _accept(window)
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
