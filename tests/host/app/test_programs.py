"""Control of other programs from the application: mappings, arming, and when keys are pressed."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import pygame
import pytest

from controller.shared.keymap.key_state import Stroke
from controller.shared.protocol.messages import Command
from host.app import programs
from host.app.programs import Programs
from host.app.screens.programs import KeysScreen, ProgramsScreen
from host.connection.receiver import Delivered
from tests.support.app_window import Window


class Sender:
    """Takes strokes in place of the injector."""

    strokes: ClassVar[list[Stroke]] = []

    def __init__(self, backend: str, kind: str, keys: Any) -> None:
        Sender.strokes = []

    def start(self) -> str:
        return ""

    def send(self, strokes: Iterable[Stroke]) -> None:
        Sender.strokes += strokes

    def check(self) -> str:
        return ""

    def close(self) -> None:
        """Nothing is held."""


LEFT = Delivered(Command("left", "press", 0.99, None, 1), 0)


def pressed() -> list[str]:
    return [stroke.key for stroke in Sender.strokes if stroke.down]


@pytest.fixture
def control() -> Programs:
    made = Programs(Sender)  # type: ignore[arg-type]
    keyboard = programs.read(Path("keyboard"))
    assert keyboard
    made.start(keyboard, "arrows")
    return made


def test_switching_it_on_is_enough_and_the_arm_key_pauses_it(control: Programs) -> None:
    control.tick(0.0, [LEFT], behind=True)
    assert (control.on, control.armed, pressed()) == (True, True, ["left"])
    assert control.hot_key("f9")
    control.tick(0.1, [LEFT], behind=True)
    assert (control.on, control.armed, pressed()) == (True, False, ["left"])


def test_nothing_is_switched_on_by_a_second_pinch_on_the_item_that_leads_there(
    tmp_path: Path,
) -> None:
    window = Window()
    control = window.app.programs = Programs(Sender)  # type: ignore[arg-type]
    page = ProgramsScreen(window.app.stage, window.app, control, tmp_path)
    window.app.stage.push(page)
    window.pass_s(0.1, Delivered(Command("drop", "pinch", 0.99, None, 1), 0))
    assert not control.on


def test_in_front_the_window_keeps_the_commands(control: Programs) -> None:
    control.tick(0.0, [LEFT], behind=False)
    assert pressed() == []


def test_other_keys_of_the_window_are_not_taken(control: Programs) -> None:
    assert not control.hot_key("left")
    control.stop()
    assert not control.hot_key("f9")


def test_shipped_mapping_is_saved_under_a_new_name(tmp_path: Path) -> None:
    keyboard = programs.read(Path("keyboard"))
    assert keyboard
    changed = programs.choose_key(keyboard, "arrows", "left", 1)
    assert changed.key("arrows", "left") != "left"
    kept = programs.save(changed, tmp_path)
    names = [mapping.path.stem for mapping in programs.mappings(tmp_path)]
    assert names == ["keyboard", "gamepad", "keyboard-1"]
    again = programs.read(kept.path)
    assert again
    assert again.key("arrows", "left") == changed.key("arrows", "left")
    assert again.key("arrows", "down") == "down"


def test_dangerous_keys_cannot_be_chosen() -> None:
    keyboard = programs.read(Path("keyboard"))
    assert keyboard
    seen, mapping = set(), keyboard
    for _ in programs.keys("keyboard"):
        mapping = programs.choose_key(mapping, "arrows", "left", 1)
        seen.add(mapping.key("arrows", "left"))
    assert {"a", "enter", "f5"} <= seen
    assert "meta" not in seen


def test_files_that_are_no_mapping_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "notes.toml").write_text("x = 1")
    assert [mapping.path.stem for mapping in programs.mappings(tmp_path)] == ["keyboard", "gamepad"]


def test_mappings_profiles_and_keys_have_names_in_the_language(tmp_path: Path) -> None:
    window = Window()
    stage = window.app.stage
    stage.change(replace(stage.settings, language="de"))
    page = ProgramsScreen(stage, window.app, Programs(), tmp_path)
    assert {"Tastatur", "Pfeiltasten"} <= {item.value for item in page.menu.items}
    keys = KeysScreen(stage, window.app, page)
    assert keys.menu.title == "Tastatur: Pfeiltasten"
    assert {"fallen lassen": "Leer", "links": "←"}.items() <= {
        item.label: item.value for item in keys.menu.items
    }.items()


def test_every_page_shows_whether_gestures_press_keys() -> None:
    window = Window()
    keyboard = programs.read(Path("keyboard"))
    assert keyboard
    window.app.programs = Programs(Sender)  # type: ignore[arg-type]
    before = header(window)
    window.app.programs.start(keyboard, "arrows")
    window.pass_s(5.0, Delivered(Command("left", "press", 0.99, None, 1), 0))
    armed = header(window)
    window.app.programs.hot_key("f9")
    window.pass_s(0.1)
    disarmed = header(window)
    assert len({before, disarmed, armed}) == 3
    window.app.programs.stop()
    window.pass_s(0.1)
    assert header(window) == before


def header(window: Window) -> bytes:
    """Return the picture of the line above the dome."""
    panel = window.app.panel
    place = panel.layout.header.move(panel.rect.topleft)
    return pygame.image.tobytes(window.surface.subsurface(place), "RGB")


def test_the_page_says_that_a_mouse_cannot_touch_the_dome_while_it_is_elsewhere() -> None:
    window = Window()
    page = ProgramsScreen(window.app.stage, window.app, window.app.programs, Path("none"))
    said = " ".join(row.cells[0] for row in page.menu.table)
    assert "touch a phone or a real orb instead" in said
    assert "With a phone" in [item.label for item in page.menu.items]
