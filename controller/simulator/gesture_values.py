"""Numbers of gesture files, drawn for each event.

    hold = [0.12, 0.35]                                # uniform between two limits
    depth = { of = "press_depth", scatter = 0.12 }     # a user's own, 12 % more or less
    lag = { delay = 0.04 }                             # seconds, each finger its own

docs/gestures.md explains every field.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from controller import config
from controller.config import ConfigError
from controller.errors import UserError

Array = NDArray[np.float64]
Value = float | Array  # one number, or one for each finger
Known = dict[str, Value]
Checked = TypeVar("Checked")

_TERMS: Final = ("of", "times", "plus", "least", "most")
_SHARE: Final = {"range": (0.0, 1.0)}


class GestureError(UserError, ValueError):
    """A gesture cannot be used; the message gives the reason, in one sentence."""


@dataclass(frozen=True, slots=True)
class Name:
    """A style parameter or an earlier quantity, perhaps with a minus sign before it."""

    name: str
    sign: float = 1.0


Term = float | tuple[float, float] | Name  # a number, a range to draw from, or a name


@dataclass(frozen=True, slots=True)
class Quantity:
    """One line of [vary]; what is not given changes nothing. Applied in this order."""

    of: Term = 0.0  # what it starts from
    values: Sequence[float] = ()  # in its place, one for each finger; the last for all others
    delay: float = 0.0  # in its place, the deviation of a half-normal number, drawn for each finger
    times: Term | None = None  # factor
    plus: Term | None = None  # summand
    scatter: float = 0.0  # deviation of a log-normal factor: 0.1 is 10 % more or less
    jitter: float = 0.0  # deviation of a normal summand
    handed: bool = False  # an angle in degrees, mirrored for left hands
    least: Term | None = None  # lower limit
    most: Term | None = None  # upper limit
    each: bool = False  # whether every finger draws its own

    def draw(
        self, known: Known, fingers: int, left_handed: bool, rng: np.random.Generator
    ) -> Value:
        """Return the quantity for one event: a number, or an array (fingers,)."""
        size = fingers if self.each else None
        value = self._start(known, fingers, rng)
        if self.times is not None:
            value = value * term(self.times, known, rng, size)
        if self.plus is not None:
            value = value + term(self.plus, known, rng, size)
        if self.scatter:
            value = value * np.exp(rng.normal(0.0, self.scatter, size))
        if self.jitter:
            value = value + rng.normal(0.0, self.jitter, size)
        if self.handed and left_handed:
            value = 180.0 - value
        if self.least is not None:
            value = np.maximum(value, term(self.least, known, rng, size))
        if self.most is not None:
            value = np.minimum(value, term(self.most, known, rng, size))
        return value

    def _start(self, known: Known, fingers: int, rng: np.random.Generator) -> Value:
        if self.delay:
            return np.abs(rng.normal(0.0, self.delay, fingers))
        if self.values:
            last = len(self.values) - 1
            return np.array([float(self.values[min(i, last)]) for i in range(fingers)])
        return term(self.of, known, rng, fingers if self.each else None)


@dataclass(frozen=True, slots=True)
class Count:
    """The line `fingers` of [vary]: how many touch."""

    of: Term = 1.0  # a number, the two limits of evenly drawn ones, or a style parameter
    one_more: float = field(default=0.0, metadata=_SHARE)  # probability of one finger more
    off_by_one: float = field(default=0.0, metadata=_SHARE)  # probability of one more or fewer
    least: int = 1  # lower limit
    most: int = 6  # upper limit

    def draw(self, known: Known, rng: np.random.Generator) -> int:
        """Return how many fingers touch in one event."""
        if isinstance(self.of, tuple):
            count = int(rng.integers(int(self.of[0]), int(self.of[1]) + 1))
        else:
            count = round(float(term(self.of, known, rng, None)))
        if self.one_more and rng.random() < self.one_more:
            count += 1
        if self.off_by_one and rng.random() < self.off_by_one:
            count += int(rng.choice([-1, 1]))
        return min(max(count, self.least), self.most)


def term(what: Term, known: Known, rng: np.random.Generator, size: int | None) -> Value:
    """Return a number, a drawn one, or the value of a name."""
    return rng.uniform(*what, size) if isinstance(what, tuple) else value_of(what, known)


def value_of(what: float | Name, known: Known) -> Value:
    """Return a number, or the value of a name."""
    if not isinstance(what, Name):
        return float(what)
    return known[what.name] if what.sign > 0.0 else -known[what.name]


def quantity(raw: Any, names: Collection[str], where: str) -> Quantity:
    """Return the quantity of a file's value, which may refer to `names`.

    Raises:
        GestureError: It is none; the message begins with `where`.
    """
    if not isinstance(raw, dict):
        return Quantity(parse_term(raw, names, where))
    if len({"of", "values", "delay"} & set(raw)) > 1:
        raise GestureError(f"{where} starts twice; give one of of, values and delay")
    values = raw.get("values", [0])
    if not isinstance(values, list) or not values or not all(map(_is_number, values)):
        raise GestureError(f"{where} has values = {values!r}; write a list of numbers")
    terms = {
        name: parse_term(raw[name], names, f"{where} ({name})") for name in _TERMS if name in raw
    }
    return checked(Quantity, {**raw, **terms}, where)


def count(raw: Any, names: Collection[str], where: str) -> Count:
    """Return the number of fingers of a file's value; arguments and errors as of `quantity`."""
    table = raw if isinstance(raw, dict) else {"of": raw}
    of = parse_term(table.get("of", 1), names, where)
    return checked(Count, {**table, "of": of}, where)


def checked(kind: type[Checked], table: dict[str, Any], where: str) -> Checked:
    """Return the dataclass of a table.

    Raises:
        GestureError: It is none; the message begins with `where`.
    """
    try:
        return config.settings(kind, table)
    except ConfigError as error:
        raise GestureError(f"{where} {error}") from None


def parse_term(raw: Any, names: Collection[str], where: str) -> Term:
    """Return a number, a range or a name.

    Raises:
        GestureError: It is none of them, or an unknown name.
    """
    if _is_number(raw):
        return float(raw)
    if isinstance(raw, str):
        name = raw.removeprefix("-")
        if name not in names:
            raise GestureError(
                f"{where} names {name!r}, which is neither a user's parameter nor a line above; "
                f"known are {', '.join(names)}"
            )
        return Name(name, -1.0 if raw.startswith("-") else 1.0)
    if isinstance(raw, list) and len(raw) == 2 and all(map(_is_number, raw)) and raw[0] <= raw[1]:
        return float(raw[0]), float(raw[1])
    raise GestureError(f"{where} is {raw!r}; write a number, a name in quotes, or [least, most]")


def _is_number(raw: Any) -> bool:
    return type(raw) in (int, float) and bool(np.isfinite(raw))
