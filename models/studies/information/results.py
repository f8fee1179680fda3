"""Results of an information study, as plain data in a file.

"settings" of each set; "parts": under "SET|PART" what models/studies/information/parts.py returns,
in nats; "games": under a name what games.py returns; "check": rows of check.py.
"""

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from models import user_files

MEASURED: Final = "information.json"

Found = dict[str, Any]


def load(path: Path | None) -> Found:
    """Return what was found so far.

    Raises:
        UserFileError: The file cannot be read or written, or holds something else.
    """
    if path is not None:
        user_files.target(path)  # refused now, not when the first estimate is to be written
    if path is None or not path.exists():
        return {"parts": {}, "games": {}, "check": []}
    found = user_files.read_json(path)
    kinds = {"parts": dict, "games": dict, "check": list}
    if isinstance(found, dict) and all(
        isinstance(found.get(key), kind) for key, kind in kinds.items()
    ):
        return dict(_numbers(found))
    raise user_files.UserFileError(
        f"{path} holds no estimates of this program; remove it, or choose another DIR"
    )


def keep(path: Path | None, found: Found) -> None:
    """Write what was found, if it is kept anywhere."""
    if path is not None:
        user_files.write_text(path, f"{json.dumps(_rounded(found), indent=1)}\n")


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
