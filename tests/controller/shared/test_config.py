"""TOML and JSON of strangers: the parsers' own answers, at a bounded cost."""

import json
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.shared.config import (
    MAX_BYTES,
    ConfigError,
    checked,
    line_of,
    parse_json,
    parse_toml,
    settings,
)
from controller.shared.errors import UserError

PIECES = ["a", "b", ".", "=", "1", "[", "]", "{", "}", ",", "'", "#", "\\", '"', "2.5", "true"]
TEXTS = st.lists(
    st.sampled_from([*PIECES, "\n", "\t", " ", '"""', "'''", "a.b = 1\n"]), max_size=60
).map("".join)


@given(TEXTS)
def test_what_is_taken_is_what_the_parser_reads(text: str) -> None:
    try:
        table = parse_toml(text)
    except ConfigError:
        return
    assert table == tomllib.loads(text)


@pytest.mark.parametrize(
    "text", ['x."a.b.c" = 1', "# a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r", 'x = "[[[[[[[[[[[[[[[[[["']
)
def test_dots_and_brackets_in_strings_and_comments_are_text(text: str) -> None:
    assert parse_toml(text) == tomllib.loads(text)


@pytest.mark.parametrize(
    "text",
    [
        "x" + ".a" * 30_000 + " = 1", "x" + " . 'a'" * 10_000 + " = 1",
        "[x" + '."a"' * 10_000 + "]", "y = { x" + ".a" * 30_000 + " = 1 }",
        "'''\n'''\nx" + ".a" * 17 + " = 1", "x = " + "[" * 60_000, "x = " + "{a=" * 20_000,
        "x = " + "[" * 17 + "]" * 17, "x = " + "1" * 5000, "x = 0x" + "f" * 400, "a" * 70_000,
        '"""' * 20_000 + "\\", "'" * 60_000, "x" * 60_000,
    ],
)  # fmt: skip
def test_a_costly_text_is_refused_in_one_sentence(text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_toml(text)
    assert len(str(caught.value)) < 100


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = 1\nb = \n", "line 2: invalid value"),
        ("a = 1\nb =", "line 2: invalid value"),
        ("a = 1\na = 2", "line 2: cannot overwrite a value"),
        ("a = 1\nb" + ".c" * 16 + " = 2", "line 2: a key has more than 16 parts"),
        ("a = 1\nb = " + "[" * 17, "line 2: values are nested more than 16 deep"),
        ("[t]\na = 9223372036854775808", "'a' is a whole number that does not fit 64 bits"),
    ],
)
def test_a_mistake_is_told_with_its_line(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        parse_toml(text)


def test_a_file_is_named_in_its_mistake(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    for content, message in (
        (b"a = ", f"{file}, line 1: invalid value"),
        (b"\xff", f"cannot read {file}: it is not text in UTF-8"),
        (b" " * (MAX_BYTES + 1), f"cannot read {file}: it has more than 65536 bytes"),
    ):
        file.write_bytes(content)
        with pytest.raises(ConfigError) as caught:
            checked(file, dict, ConfigError, "docs/x.md")
        assert str(caught.value) == f"{message} (docs/x.md)"


@given(st.recursive(st.integers(-(2**63), 2**63 - 1) | st.text() | st.booleans(), st.lists))
def test_json_is_read_up_to_64_bits(value: Any) -> None:
    assert parse_json(json.dumps(value)) == value


@pytest.mark.parametrize("number", [2**63, -(2**63) - 1, 10**400])
def test_larger_numbers_in_json_are_refused(number: int) -> None:
    with pytest.raises(ConfigError, match="does not fit 64 bits"):
        parse_json(json.dumps([number]))


@pytest.mark.parametrize("text", ["[" * 60_000, "1" * 5000, "{", "\x00", '{"a": 1e5'])
def test_broken_json_is_refused_in_one_sentence(text: str) -> None:
    with pytest.raises(ConfigError):
        parse_json(text)


@dataclass(frozen=True)
class Inner:
    on: float = field(default=0.5, metadata={"range": (0.0, 1.0)})


@dataclass(frozen=True)
class Outer:
    rows: int
    order: str = field(default="random", metadata={"choices": ("random", "blocks")})
    labels: tuple[str, ...] = field(default=(), metadata={"pattern": "[a-z]+", "count": (1, 3)})
    inner: Inner | None = field(default=None, metadata={"key": "table"})
    bare: bool = False

    def __post_init__(self) -> None:
        if self.rows == 7:
            raise ValueError("an unlucky number of rows")


def test_a_table_becomes_a_dataclass_with_its_defaults() -> None:
    assert settings(Outer, {"rows": 5}) == Outer(5)
    table = {"rows": 5, "labels": ["a", "b"], "table": {"on": 1}, "bare": True}
    assert settings(Outer, table) == Outer(5, labels=("a", "b"), inner=Inner(1.0), bare=True)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({}, "has rows = None; expected is a whole number from 0 to 1e.09"),
        ({"rows": True}, "has rows = True; expected is a whole number"),
        ({"rows": 5, "row": 5}, "has the unknown key 'row'; known are rows, order, labels, table"),
        ({"rows": 5, "order": "b"}, "has order = 'b'; expected is one of random, blocks"),
        ({"rows": 5, "labels": ["a", "a"]}, "expected is a list of different words"),
        ({"rows": 5, "labels": ["a", 1]}, "expected is a list of different words"),
        ({"rows": 5, "table": 3}, "has table = 3; expected is a table"),
        ({"rows": 5, "table": {"on": float("nan")}}, "has on = nan under .table.; expected is a n"),
        ({"rows": 5, "bare": 1}, "has bare = 1; expected is true or false"),
        ({"rows": 7}, "has an unlucky number of rows"),
    ],
)
def test_a_value_no_dataclass_can_have_is_refused(table: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        settings(Outer, table)


@dataclass(frozen=True)
class Limits:
    whole: int = field(default=2, metadata={"range": (2, 4)})
    percent: float = field(default=0.5, metadata={"range": (0.0, 100.0), "divisor": 100.0})
    free: float = 0.0
    word: str = field(default="ab", metadata={"pattern": "[ab]+"})
    kind: Literal["big", "small"] = "big"
    numbers: tuple[int, ...] = field(default=(1,), metadata={"count": (1, 3), "range": (0, 9)})
    more: dict[str, int] | None = None


@pytest.mark.parametrize(
    ("key", "taken", "refused"),
    [
        ("whole", [2, 3, 4], [1, 5, 3.0, "3", None]),
        ("percent", [0, 50.0, 100], [-0.1, 100.1, True]),
        ("free", [0, 1e9], [-1e-9, 1.1e9, float("inf")]),
        ("word", ["a", "abba"], ["", "abc", "a\n", 1]),
        ("kind", ["big", "small"], ["", "Big", 1]),
        ("numbers", [[0], [9, 0, 1]], [[], [1, 2, 3, 4], [1, 1], [1, 2.0], [10], [-1], 1, "1"]),
        ("more", [{}, {"a": 1}], [[], 1, "a"]),
    ],
)
def test_each_limit_is_itself_allowed_and_nothing_beyond(
    key: str, taken: list[Any], refused: list[Any]
) -> None:
    for value in taken:
        read = getattr(settings(Limits, {key: value}), key)
        assert (
            list(read) if key == "numbers" else read * 100 if key == "percent" else read
        ) == value
    for value in refused:
        with pytest.raises(ConfigError, match=f"has {key} = .* under .here.; expected is"):
            settings(Limits, {key: value}, "here")


@pytest.mark.parametrize("limit", [-(2**63), 2**63 - 1])
def test_a_whole_number_has_64_bits_in_either_format(limit: int) -> None:
    larger = limit + (1 if limit > 0 else -1)
    assert parse_json(str(limit)) == parse_toml(f"a = [{limit}]")["a"][0] == limit
    for refused in (lambda: parse_json(str(larger)), lambda: parse_toml(f"a = [{larger}]")):
        with pytest.raises(ConfigError, match="does not fit 64 bits"):
            refused()


def test_a_text_may_reach_its_limit_of_bytes_parts_and_nesting() -> None:
    for parse in (parse_toml, parse_json):
        parse("{}" if parse is parse_json else "#", 2)
        for text in ("#  ", b"#  "):
            with pytest.raises(ConfigError, match="the text has more than 2 bytes"):
                parse(text, 2)
        with pytest.raises(ConfigError, match="the text is not UTF-8"):
            parse(b"\xff", 2)
    parse_toml(
        "a" + ".b" * 15 + " = 1\nc = " + "[" * 16 + "]" * 16 + "\nd = " + "[" * 16 + "]" * 16
    )
    with pytest.raises(ConfigError, match="line 3: a key has more"):
        parse_toml("a = '''\n'''\nb" + ".c" * 16 + " = 2")
    with pytest.raises(ConfigError, match="line 2: expecting"):
        parse_json('{"a": 1,\n')


TEXT = """\
word = 1
game.left = "a"

[profile]
game.right = "b"
"a b".c = 2

[[rule]]
x = 1

[[rule]]
x = {y = 2}
z = 3
"""


@pytest.mark.parametrize(
    ("table", "key", "options", "line"),
    [
        ("", "word", {}, 1),
        ("", "game.left", {}, 2),
        ("game", "left", {}, 2),
        ("profile", "", {}, 4),
        ("profile.game", "right", {}, 5),
        ("profile", "ab.c", {}, 6),
        ("rule", "", {}, 8),
        ("rule", "x", {}, 9),
        ("rule", "x", {"count": 2}, 12),
        ("rule", "z", {"count": 2}, 13),
        ("rule.x", "y", {"near": True, "count": 2}, 9),
        ("", "none", {}, 0),
        ("rule", "none", {}, 0),
        ("rule", "x", {"count": 3}, 0),
        ("profile.game.right", "far", {"near": True}, 5),
        ("", "", {}, 0),
    ],
)
def test_the_line_of_an_entry_is_found(
    table: str, key: str, options: dict[str, Any], line: int
) -> None:
    expected = f", line {line}" if line else ""
    assert line_of(TEXT, table, key, **options) == expected


def test_trouble_with_a_file_names_file_line_and_page(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"

    def made(text: str) -> Limits:
        file.write_text(text)
        return checked(file, lambda table: settings(Limits, table), UserError, "docs/x.md")

    assert made("whole = 3") == Limits(3)
    for text, message in (
        ("\nwhole = 9", f"{file}, line 2 has whole = 9; .* \\(docs/x.md\\)"),
        ("whole 9", f"{file}, line 1: expected '='"),
    ):
        with pytest.raises(UserError, match=message):
            made(text)
    with pytest.raises(UserError, match=r"cannot read .*none: "):
        checked(tmp_path / "none", dict, UserError, "")
