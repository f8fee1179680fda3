"""Menus as values: what there is to choose, and how steps move through it.

A menu is rebuilt after every step, so that it always shows the present settings in the
present language.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tetris.window.menu_navigation import MenuStep

Step = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class Item:
    """One line of a menu.

    Attributes:
        label: What it is.
        do: What happens when it is taken; None for lines that only have a value.
        value: What is chosen at present.
        caps: The same as the captions of keys.
        step: Changes the value, by -1 or 1.
        share: How much of a bar beside the value is filled, 0 to 1; None draws none.
        hint: A sentence about it, shown while it is chosen.
    """

    label: str
    do: Callable[[], None] | None = None
    value: str = ""
    caps: tuple[str, ...] = ()
    step: Step | None = None
    share: float | None = None
    hint: str = ""


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a table; marked ones stand out, quiet ones are headings."""

    cells: tuple[str, ...]
    marked: bool = False
    quiet: bool = False


@dataclass(frozen=True, slots=True)
class Menu:
    """A page.

    Attributes:
        title: Its heading.
        items: What can be chosen, from above.
        table: What is only to be read, above the items.
        notice: A sentence that matters now.
    """

    title: str
    items: Sequence[Item]
    table: Sequence[Row] = ()
    notice: str = ""


class Cursor:
    """Where a player is in a menu.

    Attributes:
        selected: The number of the chosen item, from 0.
    """

    def __init__(self) -> None:
        self.selected = 0

    def move(self, menu: Menu, nav: MenuStep) -> bool:
        """Carry out a step other than BACK; return whether anything came of it."""
        count = len(menu.items)
        self.selected = min(self.selected, count - 1)
        item = menu.items[self.selected]
        match nav:
            case MenuStep.UP | MenuStep.DOWN:
                self.selected = (self.selected + (1 if nav is MenuStep.DOWN else -1)) % count
                return True
            case MenuStep.LEFT | MenuStep.RIGHT if item.step:
                item.step(1 if nav is MenuStep.RIGHT else -1)
                return True
            case MenuStep.CONFIRM if item.do:
                item.do()
                return True
            case MenuStep.CONFIRM if item.step:
                item.step(1)
                return True
        return False
