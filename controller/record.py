"""Frozen values of named fields: dataclasses whose methods are shared, so that a start is short.

`dataclass(frozen=True, slots=True)` writes the methods of each class as text and compiles it, anew
at every start: half a millisecond a class, a hundred classes, a third of the time in which a
device starts. A record has the same methods, written once. `dataclasses.replace`, `fields` and
`asdict` take it, and then, not before, `dataclass` is asked what its fields are. It makes and
compares itself at the same speed.
"""

from __future__ import annotations

from dataclasses import MISSING, Field, FrozenInstanceError, dataclass, fields
from inspect import get_annotations
from operator import attrgetter
from typing import Any, ClassVar, NoReturn, TypeVar, dataclass_transform

_Class = TypeVar("_Class", bound=type)


@dataclass_transform(frozen_default=True)
def record(written: _Class) -> _Class:
    """Return the class as a frozen dataclass with slots."""
    own = tuple(get_annotations(written))  # without those of its bases
    names: tuple[str, ...] = getattr(written, "__match_args__", ()) + own
    # A class gets its slots when it is made, so it is made once more, of what was written.
    body = {name: value for name, value in vars(written).items() if name not in own + _NO_SLOTS}
    body |= {
        "__qualname__": written.__qualname__,
        "__slots__": own,
        "__match_args__": names,
        "__dataclass_fields__": _Fields(),
        "_written": written,
        "_values": staticmethod(attrgetter(*names) if len(names) > 1 else _only(*names)),
    }
    if hasattr(written, "__post_init__"):
        body["__init__"] = _init_checked
    bases = tuple(base for base in written.__bases__ if base is not object)
    if not issubclass(written, _Record):
        bases += (_Record,)
    made: Any = type(written)(written.__name__, bases, body)
    made._put = tuple([getattr(made, name).__set__ for name in names])
    return made  # type: ignore[no-any-return]


_NO_SLOTS = ("__dict__", "__weakref__")  # what a class without slots has in their place


def _only(name: str) -> Any:
    return lambda one: (getattr(one, name),)


class _Fields:
    """What `dataclasses` reads of a class: its fields, told by `dataclass` when somebody asks."""

    def __get__(self, one: object, kind: Any) -> dict[str, Field[Any]]:
        """Return the fields of a record's class, by name."""
        told: Any = dataclass(init=False, repr=False, eq=False)(kind._written)
        kind.__dataclass_fields__ = told.__dataclass_fields__
        kind.__dataclass_params__ = told.__dataclass_params__  # which its heirs are asked for
        return told.__dataclass_fields__  # type: ignore[no-any-return]


class _Record:
    """What all records have in common."""

    __slots__ = ()
    __match_args__: ClassVar[tuple[str, ...]]
    __dataclass_fields__: ClassVar[Any]
    _written: ClassVar[type]  # the class as it was before it got its slots
    _put: ClassVar[tuple[Any, ...]]  # sets each field, past __setattr__
    _values: ClassVar[Any]  # returns the fields of one as a tuple

    def __init__(self, *values: Any, **named: Any) -> None:
        if named or len(values) != len(self._put):
            values = _complete(self, values, named)
        for at, put in enumerate(self._put):
            put(self, values[at])

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise FrozenInstanceError(f"{name} of a {type(self).__name__} cannot be changed")

    def __delattr__(self, name: str) -> NoReturn:
        self.__setattr__(name, None)

    def __repr__(self) -> str:
        shown = [f"{f.name}={getattr(self, f.name)!r}" for f in fields(self) if f.repr]
        return f"{type(self).__qualname__}({', '.join(shown)})"

    def __eq__(self, other: object) -> Any:
        if type(other) is not type(self):
            return NotImplemented
        return self._values(self) == self._values(other)

    def __hash__(self) -> int:
        return hash(self._values(self))

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return type(self), self._values(self)


def _init_checked(self: Any, *values: Any, **named: Any) -> None:
    _Record.__init__(self, *values, **named)
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
