"""A walk through every page of the application by one kind of input alone."""

import time
from collections.abc import Callable, Mapping
from typing import Final

from .desktop import Desk, ScenarioError, Window

Page = tuple[str, str]  # class of the screen, title of its menu

_SETTLE_S: Final = 0.3
_OPEN_S: Final = 1.0  # in which a door opens
_MOST_STEPS: Final = 40  # from one item of a menu to another
_TRIES: Final = 3  # of a gesture
_GAME_S: Final = 1.2  # before a game can be left
# Doors that end the program, or change what the walk needs.
SHUT: Final = frozenset({"Quit", "Restart", "Reset"})
# Pages whose doors correct what the orb has learned: a walk through them would spoil it.
LEAVES: Final = frozenset({"Correct the last gesture"})
# Pages that take gestures for themselves: a held pinch leaves them, none reaches their items.
TAKING: Final = frozenset(
    {
        "GesturePage",
        "LabScreen",
        "LearnScreen",
        "RecordPage",
        "CheckScreen",
        "WatchScreen",
    }
)


class Hand:
    """One kind of input: chooses items of menus, and leaves a running game.

    Attributes:
        deaf: Screens on which it chooses nothing.
    """

    deaf: frozenset[str] = frozenset()

    def __init__(self, window: Window) -> None:
        self.window = window

    def choose(self, label: str) -> None:
        """Take the item of that label."""
        for _ in range(_MOST_STEPS):
            labels, selected = self.window.shown["labels"], self.window.shown["selected"]
            if label not in labels:
                raise ScenarioError(f"there is no item {label!r} among {labels}")
            if selected == label:
                self.confirm()
                return
            (self.down if labels.index(label) > labels.index(selected) else self.up)()
            self._settle(selected)
        raise ScenarioError(f"{label!r} cannot be selected on {page(self.window)}")

    def _settle(self, selected: str) -> None:
        """Wait until another item is selected."""
        until_s = time.monotonic() + _OPEN_S
        while self.window.shown["selected"] == selected and time.monotonic() < until_s:
            time.sleep(_SETTLE_S / 6)
        time.sleep(_SETTLE_S / 6)

    def back(self) -> None:
        """Leave a page by its last item."""
        self.choose(self.window.shown["labels"][-1])

    def leave_game(self) -> None:
        """Open the menu over a running game."""
        raise NotImplementedError

    def up(self) -> None:
        """Go up in a menu."""

    def down(self) -> None:
        """Go down in a menu."""

    def confirm(self) -> None:
        """Take the selected item."""


class Mouse(Hand):
    """The pointer, which clicks what it sees."""

    def choose(self, label: str) -> None:
        """Click an item; turn the wheel until it is seen."""
        for _ in range(_MOST_STEPS):
            if label in self.window.shown["items"]:
                self.window.choose(label)
                return
            self.window.do("click", 5)
            time.sleep(_SETTLE_S / 2)
        raise ScenarioError(f"{label!r} cannot be clicked on {page(self.window)}")

    def leave_game(self) -> None:
        """Click the pause button of the board."""
        spot = self.window.shown.get("pause")
        if not spot:
            raise ScenarioError("a game has no button that pauses it")
        self.window.do("mousemove", *spot, "click", 1)


class Keyboard(Hand):
    """Arrows, Enter and Escape."""

    def up(self) -> None:
        """Press the arrow."""
        self.window.key("Up")

    def down(self) -> None:
        """Press the arrow."""
        self.window.key("Down")

    def confirm(self) -> None:
        """Press Enter."""
        self.window.key("Return")

    def leave_game(self) -> None:
        """Press Escape."""
        self.window.key("Escape")


class Pad(Hand):
    """A game pad, whose events come from the test."""

    def up(self) -> None:
        """Press the cross."""
        self.window.pad("pad_up")

    def down(self) -> None:
        """Press the cross."""
        self.window.pad("pad_down")

    def confirm(self) -> None:
        """Press A."""
        self.window.pad("pad_a")

    def leave_game(self) -> None:
        """Press Start."""
        self.window.pad("pad_start")


class Orb(Hand):
    """The dome: presses below go down, twists up, a pinch takes.

    Attributes:
        missed: Gestures that were not answered, and made again.
    """

    missed = 0
    deaf = TAKING

    def up(self) -> None:
        """Twist to the left."""
        self._gesture(lambda: self.window.twist(-65))

    def down(self) -> None:
        """Press the lower part."""
        self._gesture(lambda: self.window.press(0.0, -0.55))

    def confirm(self) -> None:
        """Pinch."""
        self._gesture(lambda: self.window.press(0.0, 0.0, 0.2, button=3))

    def back(self) -> None:
        """Choose the last item; hold a pinch where gestures are no steps."""
        if self.window.shown["screen"] in self.deaf:
            self.leave_game()
        else:
            super().back()

    def leave_game(self) -> None:
        """Hold a pinch."""
        self._gesture(lambda: self.window.press(0.0, 0.0, 2.4, button=3))

    def _gesture(self, make: Callable[[], None]) -> None:
        """Make a gesture until it is answered, as people do."""
        before = len(self.window.shown["gestures"])
        for _ in range(_TRIES):
            make()
            try:
                self.window.until(lambda shown: len(shown["gestures"]) > before, "an answer", 1.5)
            except ScenarioError:
                if self.window.process.poll() is not None:
                    raise
                self.missed += 1
                continue
            time.sleep(_SETTLE_S)
            return
        raise ScenarioError("the orb does not answer")


HANDS: Final[Mapping[str, type[Hand]]] = {
    "mouse": Mouse, "keys": Keyboard, "pad": Pad, "orb": Orb,
}  # fmt: skip


def page(window: Window) -> Page:
    """Return which page is shown."""
    return window.shown["screen"], window.shown["title"]


def walk(hand: Hand, *, shut: frozenset[str] = SHUT) -> dict[Page, list[str]]:
    """Visit every page that doors lead to, each by its shortest way from the first one.

    Return the way to each page, as labels; ScenarioError if one cannot be left.
    """
    window = hand.window
    first = page(window)
    ways: dict[Page, list[str]] = {first: []}
    queue = [first]
    while queue:
        here = queue.pop(0)
        _go(hand, ways[here], first)
        for door in _doors(window, shut):
            _go(hand, ways[here], first)
            _open(hand, door)
            there = page(window)
            if there not in ways:
                ways[there] = [*ways[here], door]
                closed = there[0] in hand.deaf or there[1] in LEAVES
                if window.shown["labels"] and not closed:
                    queue.append(there)
            _home(hand, first)
    return ways


def _doors(window: Window, shut: frozenset[str]) -> list[str]:
    """Return the doors of a page but its last one, which leads back."""
    doors: list[str] = window.shown["doors"]
    back = window.shown["labels"][-1:]
    return [door for door in doors if door not in shut and [door] != back]


def _go(hand: Hand, way: list[str], first: Page) -> None:
    """Go to a page from the first one."""
    _home(hand, first)
    for door in way:
        _open(hand, door)


def _open(hand: Hand, door: str) -> None:
    """Take a door, and wait until another page is shown, if it leads to one."""
    before, until_s = page(hand.window), time.monotonic() + _OPEN_S
    hand.choose(door)
    while page(hand.window) == before and time.monotonic() < until_s:
        time.sleep(_SETTLE_S / 6)
    time.sleep(_SETTLE_S)


def _home(hand: Hand, first: Page) -> None:
    """Go back to the first page, by the last item of each page."""
    window = hand.window
    for _ in range(_MOST_STEPS):
        if page(window) == first:
            return
        if window.shown["labels"]:
            hand.back()
            time.sleep(_OPEN_S)
        else:
            time.sleep(_GAME_S)
            hand.leave_game()
        time.sleep(_SETTLE_S)
    raise ScenarioError(f"{page(window)} cannot be left by {type(hand).__name__}")


EVERY: set[Page] = set()  # pages that the walks before have reached


def walk_by_mouse(desk: Desk) -> None:
    """Reach every page with the pointer, and come back."""
    _walk(desk, "mouse")


def walk_by_keys(desk: Desk) -> None:
    """The same with the keyboard."""
    _walk(desk, "keys")


def walk_by_pad(desk: Desk) -> None:
    """The same with a game pad."""
    _walk(desk, "pad")


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
