"""Menus as values: what there is to choose, and how steps move through it.

A menu is rebuilt after every step, so that it always shows the present settings in the
present language.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from tetris.kit.bindings import Code, names, table

Step = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class Item:
    """One line of a menu."""

    label: str
    do: Callable[[], None] | None = field(default=None, compare=False)  # when it is taken, if it is
    value: str = ""  # what is chosen at present
    late: Callable[[], str] | None = field(default=None, compare=False)  # gives a seen value
    caps: tuple[str, ...] = ()  # the same as the captions of keys
    step: Step | None = field(default=None, compare=False)  # changes the value, by -1 or 1
    share: float | None = None  # how much of a bar beside the value is filled, 0 to 1
    hint: str = ""  # shown while it is chosen


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a table; marked ones stand out, quiet ones are headings."""

    cells: tuple[str, ...]
    marked: bool = False
    quiet: bool = False


@dataclass(frozen=True, slots=True)
class Menu:
    """A page: what can be chosen, what is only to be read, and a sentence that matters now."""

    title: str
    items: Sequence[Item]
    table: Sequence[Row] = ()  # above the items
    notice: str = ""
    corner: bool = False  # whether the last item stands beside the title


class MenuStep(Enum):
    """One step in a menu."""

    UP = "up"
    DOWN = "down"
    LEFT = "left"
    RIGHT = "right"
    CONFIRM = "confirm"
    BACK = "back"


OF_ACTION: Final = {
    action: MenuStep(step) for step, actions in names("orb").items() for action in actions
}
"""By the name of an action, for controllers that give actions, such as the orb."""

OF_CODE: Final[Mapping[Code, MenuStep]] = table(MenuStep, names("menu"))
"""By a key, or the name of a pad's button."""

DIRECTIONS: Final = (MenuStep.UP, MenuStep.DOWN, MenuStep.LEFT, MenuStep.RIGHT)
"""Those that repeat while they are held."""


def step_in(menu: Menu, selected: int, nav: MenuStep) -> int | None:
    """Carry out a step other than BACK; return the item chosen then, None if nothing came of it."""
    item, count = menu.items[selected], len(menu.items)
    match nav:
        case MenuStep.UP | MenuStep.DOWN:
            return (selected + (1 if nav is MenuStep.DOWN else -1)) % count
        case MenuStep.LEFT | MenuStep.RIGHT if item.step:
            item.step(1 if nav is MenuStep.RIGHT else -1)
        case MenuStep.CONFIRM if item.do:
            item.do()
        case MenuStep.CONFIRM if item.step:
            item.step(1)
        case _:
            return None
    return selected
