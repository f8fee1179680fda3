"""Frozen values of named fields: dataclasses whose methods are shared, so that a start is short.

`dataclass(frozen=True, slots=True)` writes the methods of each class as text and compiles it, anew
at every start: half a millisecond a class, a hundred classes, a third of the time in which a
device starts. A record has the same methods, written once. `dataclasses.replace`, `fields` and
`asdict` take it; it makes and compares itself at the same speed.
"""

from __future__ import annotations

from dataclasses import MISSING, FrozenInstanceError, dataclass, fields
from operator import attrgetter
from typing import Any, NoReturn, TypeVar, dataclass_transform

_Class = TypeVar("_Class", bound=type)


@dataclass_transform(frozen_default=True)
def record(written: _Class) -> _Class:
    """Return the class as a frozen dataclass with slots."""
    made: Any = dataclass(init=False, repr=False, eq=False, slots=True)(written)
    names = made.__match_args__
    made._put = tuple(getattr(made, name).__set__ for name in names)
    made._values = staticmethod(attrgetter(*names) if len(names) > 1 else _only(*names))
    made._shown = tuple(field.name for field in fields(made) if field.repr)
    made.__init__ = _init_checked if hasattr(made, "__post_init__") else _init
    made.__setattr__ = made.__delattr__ = _refuse
    made.__repr__, made.__eq__, made.__hash__, made.__reduce__ = _repr, _eq, _hash, _reduce
    return made  # type: ignore[no-any-return]


def _only(name: str) -> Any:
    return lambda one: (getattr(one, name),)


def _init(self: Any, *values: Any, **named: Any) -> None:
    if named or len(values) != len(self._put):
        values = _complete(self, values, named)
    for at, put in enumerate(self._put):
        put(self, values[at])


def _init_checked(self: Any, *values: Any, **named: Any) -> None:
    _init(self, *values, **named)
    self.__post_init__()


def _complete(self: Any, values: tuple[Any, ...], named: dict[str, Any]) -> tuple[Any, ...]:
    """Return a value for each field, from those by place, those by name, and the defaults."""
    given = dict(zip(self.__match_args__, values, strict=False))
    wrong = set(named).difference(self.__match_args__) | set(named).intersection(given)
    if wrong or len(values) > len(self.__match_args__):
        what = ", ".join(sorted(wrong)) or "so many values"
        raise TypeError(f"{type(self).__name__} does not take {what}")
    given |= named
    for field in fields(self):
        if field.name not in given:
            if field.default is not MISSING:
                given[field.name] = field.default
            elif field.default_factory is not MISSING:
                given[field.name] = field.default_factory()
            else:
                raise TypeError(f"{type(self).__name__} needs {field.name}")
    return tuple([given[name] for name in self.__match_args__])


def _refuse(self: Any, name: str, value: Any = None) -> NoReturn:
    raise FrozenInstanceError(f"{name} of a {type(self).__name__} cannot be changed")


def _repr(self: Any) -> str:
    shown = ", ".join(f"{name}={getattr(self, name)!r}" for name in self._shown)
    return f"{type(self).__qualname__}({shown})"


def _eq(self: Any, other: Any) -> Any:
    if type(other) is not type(self):
        return NotImplemented
    return self._values(self) == self._values(other)


def _hash(self: Any) -> int:
    return hash(self._values(self))


def _reduce(self: Any) -> tuple[Any, tuple[Any, ...]]:
    return type(self), self._values(self)
