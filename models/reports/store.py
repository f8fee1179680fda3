"""The data of a report, kept inside the page itself, so that a later command can add to it."""

import json
import math
import re
import types
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, fields, is_dataclass, replace
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

from controller import config
from models.reports.data import ReportData

OPENING: Final = '<script type="application/json" id="data">'
CLOSING: Final = "</script>"
MOST_TOUCHES: Final = 1000  # of a location map; more would make the page heavy, not clearer
_DIGITS: Final = 6


def pack(data: ReportData) -> str:
    """Return the data as an element of the page; of many touches some, evenly spread."""
    text = json.dumps(_plain(asdict(data)), allow_nan=False, ensure_ascii=False)
    return OPENING + text.replace("<", "\\u003c") + CLOSING  # no text can end the element


def unpack(page: str) -> ReportData:
    """Return the data of a page.

    Raises:
        ValueError: It holds none, or that of another version.
    """
    found = re.search(re.escape(OPENING) + "(.*?)" + re.escape(CLOSING), page, re.DOTALL)
    if found is None:
        raise ValueError("it is no report of this program")
    try:
        made = _made(ReportData, config.parse_json(found[1], len(found[1])))
    except (TypeError, KeyError, ValueError, AttributeError):
        raise ValueError("it is a report of another version") from None
    assert isinstance(made, ReportData)
    return made


def merged(old: ReportData, new: ReportData) -> ReportData:
    """Return the old data with every part replaced that the new data have.

    A new training begins a new page: nothing that was found out about an older bundle holds.
    """
    if new.training is not None:
        return new
    given = {f.name: part for f in fields(new) if (part := getattr(new, f.name)) is not None}
    return replace(old, **given)


def _plain(value: Any) -> Any:
    """Return a value as JSON has it: what is no number becomes null."""
    if isinstance(value, Mapping):
        return {key: _plain(_few(one) if key == "touches" else one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, float):
        return round(value, _DIGITS) if math.isfinite(value) else None
    return value


def _few(touches: Sequence[Any]) -> Sequence[Any]:
    """Return some of many, evenly spread."""
    step = max(1, -(-len(touches) // MOST_TOUCHES))
    return touches[::step]


def _made(kind: Any, value: Any) -> Any:
    """Return a value of a kind from what JSON made of it."""
    if is_dataclass(kind) and isinstance(kind, type):
        if not isinstance(value, dict):
            raise TypeError(f"{kind.__name__} needs its fields")
        hints = get_type_hints(kind)
        # What has a default may be younger than the page.
        own = [f.name for f in fields(kind) if f.name in value or f.default in (MISSING, None)]
        return kind(**{name: _made(hints[name], value[name]) for name in own})
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        if value is None:
            return None
        return _made(next(one for one in inner if one is not type(None)), value)
    if origin is tuple:
        each = [inner[0]] * len(value) if inner[1:] == (Ellipsis,) else list(inner)
        return tuple(_made(one, item) for one, item in zip(each, value, strict=True))
    if origin is dict:
        return {key: _made(inner[1], item) for key, item in value.items()}
    if kind is float:
        return math.nan if value is None else float(value)
    if kind in (int, str, bool) and type(value) is not kind:
        raise TypeError(f"{value!r} is no {kind.__name__}")
    return value
