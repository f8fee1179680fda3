"""Dataclasses as JSON and back, for files beside bundles and the data inside report pages."""

import json
import math
import types
from collections.abc import Mapping
from dataclasses import MISSING, asdict, fields, is_dataclass
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

DIGITS: Final = 6


def text(value: Any) -> str:
    """Return a value as the text of a JSON file; NaN and infinities become null."""
    return json.dumps(plain(value), indent=1, allow_nan=False, ensure_ascii=False)


def plain(value: Any) -> Any:
    """Return dataclasses and mappings as dictionaries, sequences as lists, numbers rounded."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return round(value, DIGITS) if math.isfinite(value) else None
    return value


def read(kind: Any, value: Any) -> Any:
    """Return an instance of a type from what `plain` made of it; null becomes NaN or None.

    Raises:
        TypeError, KeyError, ValueError, AttributeError: The value is of another type.
    """
    origin, inner = get_origin(kind), get_args(kind)
    if is_dataclass(kind) and isinstance(kind, type):
        return _dataclass(kind, value)
    if origin in (Union, types.UnionType):
        if value is None:
            return None
        return read(next(one for one in inner if one is not type(None)), value)
    if origin is tuple:
        each = [inner[0]] * len(value) if inner[1:] == (Ellipsis,) else list(inner)
        return tuple(read(one, item) for one, item in zip(each, value, strict=True))
    if origin is dict:
        return {key: read(inner[1], item) for key, item in value.items()}
    if kind is float:
        return math.nan if value is None else float(value)
    if kind in (int, str, bool) and type(value) is not kind:
        raise TypeError(f"{value!r} is no {kind.__name__}")
    return value


def _dataclass(kind: type[Any], value: Any) -> Any:
    """Return a dataclass; a field with a default may be missing, as in files of older versions."""
    if not isinstance(value, dict):
        raise TypeError(f"{kind.__name__} needs its fields")
    hints, given = get_type_hints(kind), {}
    for field in fields(kind):
        if field.name in value or field.default in (MISSING, None):
            # Older files have the fields of some dataclasses in the one that holds them.
            flat = is_dataclass(hints[field.name]) and field.name not in value
            given[field.name] = read(hints[field.name], value if flat else value[field.name])
    return kind(**given)
