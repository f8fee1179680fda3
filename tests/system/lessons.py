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
    window.until(lambda shown: "saved" in shown["notice"], "the saved file")
    window.choose("Back")
    swipe(window, 1)
    time.sleep(0.6)
    window.choose("Correct the last gesture")
    window.choose("pinch")
    window.until(lambda shown: "learned: that was pinch" in shown["notice"], "the correction", 60)
    window.choose("Correct the last gesture")
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
    window.choose("Learn")
    window.until(lambda shown: "Learning" in shown["items"], "the learning", 30.0)
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
    window.at("GesturePage")


def _learn(desk: Desk, window: Window, name: str, make: Make) -> float:
    """Teach a gesture by five examples, and try it five times; return when that began.

    A click among the examples is questioned, and thrown away.
    """
    begun_s = time.monotonic()
    _begin(window, name)
    for count in range(1, 6):
        time.sleep(0.6)
        make(window, count)
        taken = _taken(count)
        window.until(lambda shown: "Keep it" in shown["items"] or taken(shown), "an example")  # noqa: B023
        if "Keep it" in window.shown["items"]:
            desk.seen["kept"] = desk.seen.get("kept", 0) + 1
            window.choose("Keep it")
            window.until(taken, "an example")
        if count == 3:
            time.sleep(0.6)
            window.press(0.1, 0.1, 0.25)
            window.until(lambda shown: "Throw it away" in shown["items"], "a question")
            window.choose("Throw it away")
            window.until(_taken(count), "the others")
    desk.seen["examples_s"] = time.monotonic() - begun_s
    window.choose("Learn")
    window.until(lambda shown: "End the trial" in shown["items"], "the trial", 60.0)
    desk.seen["learned_s"] = time.monotonic() - begun_s
    for count in range(1, 6):
        make(window, count)
        time.sleep(1.6)
    return begun_s


def _teach(desk: Desk, window: Window, name: str, make: Make) -> None:
    """Teach a gesture, and make it 20 times in a game; at least 19 are to be understood."""
    begun_s = _learn(desk, window, name, make)
    window.choose("Play with it")
    window.until(lambda shown: shown["screen"] == "PlayScreen", "the game")
    desk.seen["playing_s"] = time.monotonic() - begun_s
    time.sleep(1.2)
    label, before = name.replace(" ", "_"), len(window.shown["gestures"])
    for count in range(20):
        make(window, count)
        time.sleep(1.0)
    made = window.shown["gestures"][before:]
    desk.seen |= {"understood": made.count(label), "others": len(made) - made.count(label)}
    if desk.seen["learned_s"] > 60 or desk.seen["understood"] < 19:
        raise ScenarioError(f"20 times {name} became {made}")


def _taken(count: int) -> Callable[[dict[str, Any]], bool]:
    """Return whether so many examples are shown."""
    return lambda shown: shown["values"][0].startswith(f"{count}/5")


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
