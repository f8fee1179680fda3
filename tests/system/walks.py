"""Scenarios that visit every page by one kind of input alone."""

from .desk import Desk
from .desktop import ScenarioError
from .walk import HANDS, Orb, Page, walk

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
