"""Results of evaluations and trainings from the JSON that was made of them."""

import math
import types
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, Union, get_args, get_origin, get_type_hints

from controller.shared.notices import unpacked


def from_plain(kind: Any, value: Any) -> Any:
    """Return an instance of a type from what `models.results.storage.plain` made of it.

    Null becomes NaN or None.

    Raises:
        TypeError, KeyError, ValueError, AttributeError: The value is of another type.
    """
    origin, inner = get_origin(kind), get_args(kind)
    if is_dataclass(kind) and isinstance(kind, type):
        return _dataclass(kind, value)
    if origin in (Union, types.UnionType):
        if value is None:
            return None
        return from_plain(next(one for one in inner if one is not type(None)), value)
    if origin is tuple:
        each = [inner[0]] * len(value) if inner[1:] == (Ellipsis,) else list(inner)
        return tuple(from_plain(one, item) for one, item in zip(each, value, strict=True))
    if origin is dict:
        return {key: from_plain(inner[1], item) for key, item in value.items()}
    if kind is float:
        return math.nan if value is None else float(value)
    if kind is str and isinstance(value, dict):
        return unpacked(value)
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
            given[field.name] = from_plain(hints[field.name], value[field.name])
    return kind(**given)
