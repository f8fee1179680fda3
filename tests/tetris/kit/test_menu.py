"""Menus as values, and as pictures."""

import pygame
import pytest

from tetris.kit.menu import Item, Menu, MenuStep, Row, step_in
from tetris.kit.menu_view import MenuView, wrapped
from tetris.kit.settings import Look


class Counter:
    """Something that a menu changes."""

    def __init__(self) -> None:
        self.value = 0
        self.taken = 0

    def step(self, step: int) -> None:
        self.value += step

    def take(self) -> None:
        self.taken += 1

    def menu(self) -> Menu:
        return Menu(
            "Kitchen",
            (
                Item("Tea", self.take),
                Item("Sugar", value=str(self.value), step=self.step),
                Item("Nothing to do"),
            ),
        )


def test_up_and_down_go_round() -> None:
    menu = Counter().menu()
    assert [step_in(menu, number, MenuStep.DOWN) for number in range(3)] == [1, 2, 0]
    assert [step_in(menu, number, MenuStep.UP) for number in range(3)] == [2, 0, 1]


def test_left_and_right_change_a_value_and_confirming_takes_an_item() -> None:
    counter = Counter()
    assert step_in(counter.menu(), 0, MenuStep.CONFIRM) == 0
    assert step_in(counter.menu(), 0, MenuStep.LEFT) is None
    for nav in (MenuStep.RIGHT, MenuStep.RIGHT, MenuStep.LEFT, MenuStep.CONFIRM):
        assert step_in(counter.menu(), 1, nav) == 1
    assert (counter.taken, counter.value) == (1, 2)


def test_an_item_that_does_nothing_says_so() -> None:
    assert step_in(Counter().menu(), 2, MenuStep.CONFIRM) is None


@pytest.mark.parametrize("size", [(400, 600), (120, 90), (2000, 1200)])
def test_the_chosen_item_of_a_long_menu_is_always_seen(size: tuple[int, int]) -> None:
    surface = pygame.Surface(size)
    menu = Menu("Long", [Item(f"item {number}", value="x") for number in range(40)])
    view = MenuView(Look())
    for selected in (*range(40), *reversed(range(40)), 0, 39):
        view.draw(surface, surface.get_rect(), menu, selected, size[1] / 720)
        assert selected in [spot.number for spot in view.spots]


def test_a_table_leaves_room_for_the_items_below_it() -> None:
    surface = pygame.Surface((500, 500))
    table = [Row(("place", "points", "date"), marked=place == 3) for place in range(60)]
    view = MenuView(Look())
    view.draw(surface, surface.get_rect(), Menu("Best", (Item("Back"),), table), 0, 1.0)
    assert surface.get_rect().contains(view.spots[0].place)


def test_a_sentence_is_broken_between_words() -> None:
    lines = wrapped("one two three four five six seven", 20, 110)
    assert " ".join(lines) == "one two three four five six seven"
    assert len(lines) > 1
    assert wrapped("", 20, 110) == []
