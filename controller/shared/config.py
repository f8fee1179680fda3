"""Parse TOML and JSON of unknown origin at a bounded cost, and check tables against dataclasses.

Python's `tomllib` takes time and memory quadratic in the parts of one dotted key (a line of 30,000
parts costs gigabytes), and both parsers recurse into nested values. So size, dots and nesting are
checked before, and whole numbers after, since some are too large to become a float.
"""

import dataclasses
import json
import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Final, Literal, TypeVar, get_args, get_origin, get_type_hints

from controller.shared.errors import UserError, reason
from controller.shared.files import read_text

MAX_BYTES: Final = 64 << 10
MAX_PARTS: Final = 16  # of one key, between dots
MAX_NESTING: Final = 16  # brackets
_INTEGERS: Final = range(-(2**63), 2**63)  # what the TOML specification asks readers to take

# Strings and comments, as TOML has them; one without an end goes on to the end of its line, or of
# the text, so that no text is looked at twice.
_QUOTED: Final = re.compile(
    r'"""(?:[^\\]|\\.)*?(?:"""|\\?\Z)'
    r"|'''.*?(?:'''|\Z)"
    r'|"(?:[^"\\\n]|\\[^\n])*(?:"|$)'
    r"|'[^'\n]*(?:'|$)"
    r"|\#[^\n]*",
    re.DOTALL | re.MULTILINE,
)
_DOTTED: Final = re.compile(rf"(?<![\w-])[\w-]++(?:[ \t]*+\.[ \t]*+[\w-]++){{{MAX_PARTS}}}")
_ANY_NUMBER: Final = (0.0, 1e9)  # range of a field that names none; 1e9 stands for never
_EXPECTED: Final = {  # of a field of each type that is checked
    bool: "true or false",
    int: "a whole number from {low:g} to {high:g}",
    float: "a number from {low:g} to {high:g}",
    str: "a text",
    tuple: "a list of different words",
    dict: "a table",
}
_REQUIRED: Final = (dataclasses.MISSING, dataclasses.MISSING)  # default and factory of a field
_Settings = TypeVar("_Settings")
_PLACE: Final = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")


class ConfigError(UserError, ValueError):
    """A text is not valid TOML or JSON, or exceeds a limit; the message begins with the line.

    `table` and `key` name the entry that cannot be used; "" is the whole file.
    """

    def __init__(self, message: str, table: str = "", key: str = "") -> None:
        super().__init__(message)
        self.table, self.key = table, key


def parse_toml(text: str | bytes, limit_bytes: int = MAX_BYTES) -> dict[str, Any]:
    """Return the table in a text of TOML.

    Raises:
        ConfigError: It is not TOML, or exceeds a limit of size, dots, nesting or whole numbers.
    """
    whole = _decoded(text, limit_bytes)
    _check_cost(whole.replace("\r\n", "\n"))
    try:
        table = tomllib.loads(whole)
    except tomllib.TOMLDecodeError as error:
        place = _PLACE.search(str(error))
        line = int(place[1]) if place and place[1] else whole.rstrip().count("\n") + 1
        raise ConfigError(f"line {line}: {_PLACE.sub('', str(error)).lower()}") from None
    except (ValueError, RecursionError):  # Python refuses numbers of thousands of digits
        raise ConfigError("a number has too many digits") from None
    _check_numbers(table, "")
    return table


def parse_json(text: str | bytes, limit_bytes: int = MAX_BYTES) -> Any:
    """Return the value in a text of JSON, or raise ConfigError as `parse_toml` does."""
    whole = _decoded(text, limit_bytes)
    try:
        return json.loads(whole, parse_int=_integer)
    except json.JSONDecodeError as error:
        raise ConfigError(f"line {error.lineno}: {error.msg.lower()}") from None
    except RecursionError:
        raise ConfigError("values are nested too deeply") from None
    except ValueError:
        raise ConfigError("a whole number does not fit 64 bits") from None


def settings(
    kind: type[_Settings], table: Any, name: str = "", base: _Settings | None = None
) -> _Settings:
    """Return the settings in a table: a dataclass with a field for each key.

    A missing key takes its value in `base`, or else the default of its field; an unknown one is
    refused. Fields of the types bool, int, float, str, Literal, dict, tuple[str, ...],
    tuple[int, ...], tuples of a fixed length (whose items may be alike) and of dataclasses, which
    are tables themselves, are checked. Their metadata may have the "key" if it is not the field's
    name, the "range" of a number, its "divisor" if the field has another unit, the "choices" or
    the "pattern" of a text, the "count" of a list, and what is "expected".

    Raises:
        ConfigError: A value cannot be used; a sentence without its subject. `name` is the table's.
    """
    under = f" under [{name}]" if name else ""
    if not isinstance(table, dict):
        raise ConfigError(f"has {name} = {table!r}; expected is a table [{name}]", "", name)
    fields = {
        field.metadata.get("key", field.name): field
        for field in dataclasses.fields(kind)  # type: ignore[arg-type]
    }
    if odd := sorted(set(table) - set(fields)):
        known = ", ".join(fields)
        raise ConfigError(f"has the unknown key {odd[0]!r}{under}; known are {known}", name, odd[0])
    hints, values = get_type_hints(kind), {}
    for key, field in fields.items():
        given = getattr(base, field.name, None)
        if key in table or (base is None and (field.default, field.default_factory) == _REQUIRED):
            wanted = _without_none(hints[field.name])
            values[field.name] = _value(wanted, table.get(key), key, name, field.metadata, given)
    try:
        if base is not None:
            return dataclasses.replace(base, **values)  # type: ignore[type-var]
        return kind(**values)
    except ValueError as error:
        raise ConfigError(f"has{under} {error}", name) from None


def _without_none(hint: Any) -> Any:
    """Return T for the type T | None."""
    kinds = [kind for kind in get_args(hint) if kind is not NoneType]
    return kinds[0] if isinstance(hint, UnionType) and len(kinds) == 1 else hint


def _value(
    kind: Any, value: Any, key: str, name: str, limits: Mapping[str, Any], base: Any = None
) -> Any:
    """Return the value of a field, checked."""
    if dataclasses.is_dataclass(kind):
        return settings(kind, value, f"{name}.{key}".strip("."), base)  # type: ignore[arg-type]
    if kind is float and type(value) is int:
        value = float(value)
    if get_origin(kind) is tuple and isinstance(value, list):
        value = tuple(value)
    plain = get_origin(kind) or kind
    if plain is Literal:
        plain, limits = str, {"choices": get_args(kind), **limits}
    items = get_args(kind)
    if plain is tuple and Ellipsis not in items:
        if type(value) is tuple and len(value) == len(items):
            pairs = zip(items, value, strict=True)
            return tuple(_value(one, own, key, name, limits) for one, own in pairs)
        limits = {"count": (len(items),) * 2, "expected": f"a list of {len(items)}", **limits}
    item = (*items, None)[0]
    if plain in _EXPECTED and (type(value) is not plain or not _within(value, limits, item)):
        low, high = limits.get("range", _ANY_NUMBER)
        words = {"low": low, "high": high, "choices": ", ".join(limits.get("choices", ()))}
        wanted = "one of {choices}" if "choices" in limits else _EXPECTED[plain]
        expected = limits.get("expected") or wanted.format(**words)
        found = list(value) if isinstance(value, tuple) else value
        under = f" under [{name}]" if name else ""
        raise ConfigError(f"has {key} = {found!r}{under}; expected is {expected}", name, key)
    return value / limits["divisor"] if "divisor" in limits else value


def _within(value: Any, limits: Mapping[str, Any], item: Any = None) -> bool:
    """Return whether a value of the right type, a list of `item`, is within its field's limits."""
    if isinstance(value, str):
        pattern = limits.get("pattern", r"(?s).*")
        return value in limits.get("choices", (value,)) and bool(re.fullmatch(pattern, value))
    if isinstance(value, tuple):
        low, high = limits.get("count", (0, MAX_BYTES))
        different = all(type(one) is item for one in value) and len(set(value)) == len(value)
        return low <= len(value) <= high and different and all(_within(v, limits) for v in value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        low, high = limits.get("range", _ANY_NUMBER)
        return bool(low <= value <= high)
    return True


def checked(
    path: Path,
    make: Callable[[dict[str, Any]], _Settings],
    error: type[UserError],
    page: str,
) -> _Settings:
    """Return `make(table)` of a TOML file.

    Trouble, and a ConfigError of `make`, become an `error` with file, line and the page to read.
    """
    try:
        text = read_text(path, MAX_BYTES)
        table = parse_toml(text)
    except OSError as problem:
        raise error(f"cannot read {path}: {reason(problem)} ({page})") from None
    except ConfigError as problem:
        raise error(f"{path}, {problem} ({page})") from None
    try:
        return make(table)
    except ConfigError as problem:
        line = line_of(text, problem.table, problem.key, near=True)
        raise error(f"{path}{line} {problem} ({page})") from None


def line_of(text: str, table: str, key: str = "", count: int = 1, *, near: bool = False) -> str:
    """Return ", line N" of an entry in a TOML text; "" if it cannot be found.

    An entry may stand anywhere that TOML lets it, such as `game.left = ...` below [profile]. The
    table "" is the top, the key "" the table itself, and `count` says which of several [[table]].
    With `near` the closest line above, such as that of an inline table, is returned if need be.
    """
    owner = _parts(table) if table else []
    wanted = owner + (_parts(key) if key else [])
    header: list[str] = []
    closest, depth, seen = "", 0, 0
    for number, line in enumerate(text.splitlines(), 1):
        if opened := re.match(r"\s*\[\[?([^]]*)\]", line):
            here = header = _parts(opened[1])
            seen += here == owner
        elif assigned := re.match(r"\s*([^=#]+?)\s*=", line):
            here = header + _parts(assigned[1])
        else:
            continue
        if wanted and here[: len(wanted)] == wanted and seen in (0, count):
            return f", line {number}"
        if depth < len(here) and wanted[: len(here)] == here:
            closest, depth = f", line {number}", len(here)
    return closest if near else ""


def _parts(key: str) -> list[str]:
    """Return the parts of a dotted key, without quotes and spaces."""
    return re.sub(r"[\s\"']", "", key).split(".")


def _decoded(text: str | bytes, limit_bytes: int) -> str:
    if len(text) > limit_bytes:
        raise ConfigError(f"the text has more than {limit_bytes} bytes")
    if isinstance(text, str):
        return text
    try:
        return text.decode()
    except UnicodeDecodeError:
        raise ConfigError("the text is not UTF-8") from None


def _check_cost(text: str) -> None:
    """Raise if a key has too many parts, or brackets are nested too deeply."""
    bare = _QUOTED.sub(lambda match: "_" + "\n" * match[0].count("\n"), text)
    if long := _DOTTED.search(bare):
        line = bare.count("\n", 0, long.start()) + 1
        raise ConfigError(f"line {line}: a key has more than {MAX_PARTS} parts")
    depth = 0
    for bracket in re.finditer(r"[\[\]{}]", bare):
        depth += 1 if bracket[0] in "[{" else -1
        if depth > MAX_NESTING:
            line = bare.count("\n", 0, bracket.start()) + 1
            raise ConfigError(f"line {line}: values are nested more than {MAX_NESTING} deep")


def _check_numbers(value: Any, key: str) -> None:
    """Raise if a whole number needs more than 64 bits."""
    if isinstance(value, dict):
        for name, inner in value.items():
            _check_numbers(inner, name)
    elif isinstance(value, list):
        for inner in value:
            _check_numbers(inner, key)
    elif isinstance(value, int) and value not in _INTEGERS:
        raise ConfigError(f"{key!r} is a whole number that does not fit 64 bits")


def _integer(digits: str) -> int:
    if len(digits) > 20 or int(digits) not in _INTEGERS:
        raise ValueError(digits[:20])
    return int(digits)
