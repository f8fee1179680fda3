"""Results of an information study, as plain data in a file.

"settings" of each set; "parts": under "SET|PART" the values of a part of study.py, in nats;
"games": under a name the figures of games.py.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from models.results import storage

MEASURED: Final = "information.json"

Results = dict[str, Any]


def load(path: Path | None) -> Results:
    """Return the results in a file; empty ones where there is none.

    Raises:
        UserFileError: The file cannot be read or written, or holds something else.
    """
    found = None if path is None else storage.read_tables(path, "parts", "games")
    return {"parts": {}, "games": {}} if found is None else dict(_with_nan(found))


def keep(path: Path | None, found: Results) -> None:
    """Write the results to a file, if there is one."""
    if path is not None:
        storage.write_json(path, found)


def sets_with(found: Mapping[str, Any], *parts: str) -> list[str]:
    """Return the names of the sets that have one of these parts, in order; no parts: of all."""
    named = (key.split("|") for key, value in found["parts"].items() if value)
    return list(dict.fromkeys(name for name, part in named if part in parts or not parts))


def value(found: Mapping[str, Any], name: str, part: str, *keys: str) -> Any:
    """Return a value inside a part of a set; None where it was not measured."""
    inside = found["parts"].get(f"{name}|{part}")
    for key in keys:
        inside = inside.get(key) if isinstance(inside, Mapping) else None
    return inside


def vocabularies(found: Mapping[str, Any]) -> dict[str, dict[int, Any]]:
    """Return the channels of vocabularies, by set and size."""
    by_set: dict[str, dict[int, Any]] = {}
    for key, channel in found["parts"].items():
        name, _, part = key.partition("|")
        if part.startswith("vocabulary "):
            by_set.setdefault(name, {})[int(part.split()[1])] = channel
    return by_set


def _with_nan(inside: Any) -> Any:
    """Return plain data with NaN where a list of numbers has null."""
    if isinstance(inside, dict):
        return {key: _with_nan(one) for key, one in inside.items()}
    if isinstance(inside, list):
        return [math.nan if one is None else _with_nan(one) for one in inside]
    return inside
