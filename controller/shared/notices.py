"""Sentences for a user as codes with arguments: each window words them in its own language.

`notices.toml` has the English template of each code, the files of languages have the others.
"""

import re
import tomllib
from collections.abc import Iterable, Sequence
from importlib.resources import files
from string import Formatter
from typing import Any, Final

LIST: Final = "list"  # its arguments, at least one, are joined: "a, b and c"
_FIELD: Final = re.compile(r"\{(\w+)(?:!(\w))?(?::([^}]*))?\}")  # name, conversion, format
TEMPLATES: Final = tomllib.loads((files(__package__) / "notices.toml").read_text("utf-8"))


class Notice(str):
    """An English sentence, or a part of one, with its code and arguments.

    Attributes:
        code: A key of `TEMPLATES`.
        arguments: Texts or notices, one for each field of the template, in order.
    """

    code: str
    arguments: tuple[str, ...]

    def __new__(cls, code: str, arguments: Iterable[str] = ()) -> "Notice":
        """Word it; KeyError if the code is unknown, ValueError if arguments are too few or many."""
        arguments = tuple(arguments)
        self = super().__new__(cls, worded(code, TEMPLATES[code], arguments))
        self.code, self.arguments = code, arguments
        return self

    def __getnewargs__(self) -> tuple[str, tuple[str, ...]]:  # type: ignore[override]
        """Return the arguments of its constructor, for pickle and copy."""
        return self.code, self.arguments

    def __str__(self) -> str:
        """Return the notice itself, so that `str(error)` keeps code and arguments."""
        return self


def notice(code: str, *values: object) -> Notice:
    """Return the notice of a code; its English template formats the values."""
    forms = _FIELD.findall(TEMPLATES[code]) or [("", "", "")] * len(values)
    return Notice(
        code,
        [
            format(Formatter().convert_field(value, conversion or None), form)
            for value, (_, conversion, form) in zip(values, forms, strict=True)
        ],
    )


def listed(items: Iterable[object]) -> Notice:
    """Return "a, b and c"; at least one item."""
    return notice(LIST, *items)


def packed(text: str) -> Any:
    """Return a text for JSON: a notice as a table, free text as it is."""
    if not isinstance(text, Notice):
        return text
    return {"text": text, "code": text.code, "arguments": [packed(one) for one in text.arguments]}


def unpacked(value: Any) -> str:
    """Return the text of `packed`; KeyError, TypeError, ValueError if it is none."""
    if isinstance(value, str):
        return value
    return Notice(value["code"], [unpacked(one) for one in value["arguments"]])


def worded(code: str, template: str, arguments: Sequence[str]) -> str:
    """Return a notice by a template of any language; ValueError: too few or many arguments."""
    if code == LIST:
        *most, last = arguments
        return f"{', '.join(most)} {template} {last}" if most else last
    return _FIELD.sub(r"{\1}", template).format(**dict(zip(names(code), arguments, strict=True)))


def names(code: str) -> list[str]:
    """Return the names of the fields of a notice, in order; of a list none."""
    return [name for name, _, _ in _FIELD.findall(TEMPLATES[code])]
