"""Texts of the window from files: one TOML file a language, English where one has a gap."""

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Final

FALLBACK: Final = "en"
_PARTS: Final = ("tetris", "host")  # folders of assets with texts for the window


@dataclass(frozen=True, slots=True)
class Words:
    """One language. Call it with a key such as `menu.play`."""

    name: str
    table: Mapping[str, str]  # of keys to words
    spare: Mapping[str, str]  # for keys that it does not have

    def __call__(self, key: str, **values: object) -> str:
        """Return the words for a key, with values set into them; a key that none has is shown."""
        words = self.table.get(key) or self.spare.get(key) or key
        return words.format(**values) if values else words

    def number(self, value: object, form: str = "") -> str:
        """Return a number, or a text of English figures such as 1:05.20, as the language has it."""
        signs = self("number.group"), self("number.point"), " %"
        return format(value, form).translate(dict(zip(map(ord, ",.%"), signs, strict=True)))


def load(name: str) -> Words:
    """Return a language by its file's name; English where there is no such file."""
    known = name if name in names() else FALLBACK
    return Words(known, table(known), table(FALLBACK))


@cache
def names() -> tuple[str, ...]:
    """Return the names of all languages, English first."""
    folder = files("assets") / "tetris" / "languages"
    found = sorted(
        file.name.removesuffix(".toml") for file in folder.iterdir() if file.name.endswith(".toml")
    )
    return (FALLBACK, *(name for name in found if name != FALLBACK))


@cache
def table(name: str) -> Mapping[str, str]:
    """Return all words of a language by their keys, such as `menu.play`."""
    flat: dict[str, str] = {}
    for part in _PARTS:
        file = files("assets") / part / "languages" / f"{name}.toml"
        if file.is_file():
            flat |= _flat("", tomllib.loads(file.read_text("utf-8")))
    return MappingProxyType(flat)


def _flat(prefix: str, nested: Mapping[str, Any]) -> dict[str, str]:
    flat: dict[str, str] = {}
    for key, value in nested.items():
        if isinstance(value, dict):
            flat |= _flat(f"{prefix}{key}.", value)
        else:
            flat[prefix + key] = value
    return flat


def of_system(environment: Mapping[str, str] = os.environ) -> str:
    """Return the language that the system asks for, or English."""
    for variable in ("LC_ALL", "LC_MESSAGES", "LANG"):
        asked = environment.get(variable, "")
        if asked:
            name = asked.split("_")[0].split(".")[0].lower()
            return name if name in names() else FALLBACK
    return FALLBACK
