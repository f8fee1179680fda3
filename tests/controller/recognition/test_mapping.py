"""The table gesture -> command."""

from pathlib import Path

import pytest

from controller.bundles import bundle, users_table
from controller.recognition import mapping
from controller.shared.errors import UserError
from tests.support import ROOT

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")
DOCUMENT = ROOT / "docs" / "mapping.md"


@pytest.mark.parametrize(
    ("label", "touch", "command"),
    [
        ("press", (0.5, 3.0), "left"),
        ("press", (2.0, 3.0), "right"),
        ("press", (0.5, 1.3), "down"),
        ("press", (3.9, 0.0), "down"),
        ("pinch", (2.0, 2.0), "drop"),
        ("twist_cw", None, "rotate_cw"),
        ("twist_ccw", None, "rotate_ccw"),
    ],
)
def test_a_press_moves_to_where_it_is_and_the_whole_hand_drops_and_rotates(
    label: str, touch: tuple[float, float] | None, command: str
) -> None:
    assert bundle.read(bundle.default_path()).mapping.command(label, touch) == command


def test_rules_are_tried_in_order_and_borders_belong_to_the_upper_right() -> None:
    rules = [
        {"command": "hold", "left_of": 2, "above": 2.0},
        {"command": "pause", "right_of": 2.0, "above": 2},
        {"command": "none"},
    ]
    table = mapping.parse({"press": rules}, LABELS)
    assert table.command("press", (1.9, 2.0)) == "hold"
    assert table.command("press", (2.0, 2.0)) == "pause"
    assert table.command("press", (2.0, 1.9)) is None  # "none" does nothing
    assert table.command("press", None) is None  # no touch is in no region
    assert table.command("pinch", (2.0, 2.0)) is None  # no rules at all


def test_an_override_replaces_only_the_labels_that_it_names() -> None:
    own = mapping.parse({"pinch": "drop", "twist_cw": "rotate_cw"}, LABELS)
    both = own.overridden(mapping.parse({"pinch": "hold"}, LABELS))
    assert both.command("pinch", None) == "hold"
    assert both.command("twist_cw", None) == "rotate_cw"


def test_the_six_commands_are_always_announced_and_others_when_used() -> None:
    table = mapping.parse({"pinch": "menu", "press": "none"}, LABELS)
    assert table.commands == (
        "left", "right", "down", "drop", "rotate_cw", "rotate_ccw", "menu",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ('punch = "drop"', "'punch' is unknown; known are press, pinch, twist_cw, twist_ccw"),
        ('null = "drop"', "'null' is unknown"),
        ('pinch = "hold"\n\npress = 3', "line 3: .*3 is no command"),
        ('pinch = "Drop!"', "it is a name in small letters, such as left"),
        ("pinch = []", "no rules"),
        ('pinch = ["drop"]', r"write \[\[pinch\]\]"),
        ("[[press]]\nbelow = 1", "None is no command"),
        ('[[press]]\ncommand = "left"\nunder = 1', "'under' is unknown; a region has left_of"),
        ('[[press]]\ncommand = "left"\nbelow = "1"', "not a number of grid units"),
        ('[[press]]\ncommand = "left"\nbelow = nan', "not a number of grid units"),
        ('[[press]]\ncommand = "left"\nbelow = 1e6', "not a number of grid units"),
        ('[[press]]\ncommand = "left"\nbelow = 999999.5', "the last rule, and no other"),
        ('[[users.ada.press]]\ncommand = "left"\nbelow = true', "line 1: .*not a number of grid"),
        ('[[press]]\ncommand = "left"\nleft_of = 1\nright_of = 1', "can never fit"),
        ('[[press]]\ncommand = "left"\nleft_of = 1', "the last rule, and no other"),
        ('[[press]]\ncommand = "left"\n[[press]]\ncommand = "down"', "rule 1 of 2"),
        ('[[press]]\ncommand = "down"\nbelow = 1\n[[press]]\ncommand = "Up"', "line 4: "),
        ('pinch = "hold"\n[users.ada]\npress = "Down"', "line 3: "),
        ("press", "mine.toml, line 1: expected '='"),
        ('pinch = "hold"\n\n\npress = [', "line 4: "),
    ],
)
def test_a_mistake_is_told_with_its_line(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(UserError, match=complaint):
        users_table.read_mapping(path, LABELS)


def test_a_file_that_cannot_be_read_is_told_so(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"cannot read .*absent\.toml"):
        users_table.read_mapping(tmp_path / "absent.toml", LABELS)
    with pytest.raises(UserError, match="cannot read"):
        users_table.read_mapping(tmp_path, LABELS)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UserError, match=r"binary\.toml: it is not text in UTF-8"):
        users_table.read_mapping(binary, LABELS)


def test_the_example_in_the_documentation_works(tmp_path: Path) -> None:
    example = DOCUMENT.read_text().split("```toml")[1].split("```")[0]
    path = tmp_path / "example.toml"
    path.write_text(example)
    table, people = users_table.read_mapping(path, LABELS)
    assert people == {}
    assert table.command("pinch", (2.0, 2.0)) == "hold"
    assert table.command("press", (2.0, 3.9)) == "pause"
    assert table.command("press", (3.0, 1.0)) == "drop"
