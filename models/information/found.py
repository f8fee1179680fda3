"""What a study found, as plain data that a file keeps.

"settings" of each set; "parts": under "SET|PART" what models/information/parts.py returns, in nats;
"games": under a name what games.py returns; "check": rows of check.py.
"""

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

MEASURED: Final = "information.json"

Found = dict[str, Any]


def load(path: Path | None) -> Found:
    """Return what was found so far.

    Raises:
        ValueError: The file holds something else.
    """
    if path is None or not path.exists():
        return {"parts": {}, "games": {}, "check": []}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if {"parts", "games", "check"} <= set(found):
            return dict(_numbers(found))
    except (ValueError, TypeError):
        pass
    raise ValueError(f"{path} holds no estimates of this program; remove it, or choose another DIR")


def keep(path: Path | None, found: Found) -> None:
    """Write what was found, if it is kept anywhere."""
    if path is not None:
        path.write_text(json.dumps(_rounded(found), indent=1) + "\n", encoding="utf-8")


def of_set(found: Mapping[str, Any], name: str, part: str) -> Any:
    """Return a part of a set; None where it was not measured."""
    return found["parts"].get(f"{name}|{part}")


def sets_of(found: Mapping[str, Any]) -> list[str]:
    """Return the names of all sets, in order."""
    return list(dict.fromkeys(key.split("|")[0] for key in found["parts"]))


def _rounded(value: Any) -> Any:
    """Return plain data with six digits; what is no number becomes null."""
    if isinstance(value, Mapping):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, Iterable) and not isinstance(value, str):
        return [_rounded(one) for one in value]
    if isinstance(value, float):
        return round(value, 6) if math.isfinite(value) else None
    return value


def _numbers(value: Any) -> Any:
    """Return what JSON made of plain data, with NaN where a list of numbers has null."""
    if isinstance(value, dict):
        return {key: _numbers(one) for key, one in value.items()}
    if isinstance(value, list):
        return [math.nan if one is None else _numbers(one) for one in value]
    return value
