import copy
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, asdict, dataclass, field, fields, replace
from typing import Any

import pytest

from controller.record import record


@record
class Point:
    """A place."""

    x: float
    y: float = 0.0


@record
class Named(Point):
    """A place with a name."""

    name: str = ""
    tags: tuple[str, ...] = field(default_factory=tuple)


@dataclass(frozen=True, slots=True)
class Theirs:
    """What a dataclass makes of the same."""

    x: float
    y: float = 0.0


@record
class Secret:
    """What a log may not hold."""

    name: str
    key: str = field(repr=False)


@record
class Share:
    """A number from 0 to 1."""

    value: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.value <= 1.0:
            raise ValueError(f"{self.value} is no share")


def test_fields_are_given_by_place_by_name_or_by_default() -> None:
    assert Point(1.0, 2.0) == Point(y=2.0, x=1.0)
    assert Point(1.0) == Point(1.0, 0.0)
    assert Named(1.0, 2.0, "home") == Named(x=1.0, name="home", y=2.0, tags=())


def test_records_of_two_kinds_are_never_equal() -> None:
    assert Point(1.0) != Named(1.0)
    theirs: object = Theirs(1.0)
    assert Point(1.0) != theirs
    assert len({Point(1.0), Point(1.0, 0.0), Point(2.0)}) == 2


def test_record_looks_like_the_dataclass_that_it_would_be() -> None:
    one, other = Point(1.0, -2.0), Theirs(1.0, -2.0)
    assert repr(one) == repr(other).replace("Theirs", "Point")
    assert asdict(one) == asdict(other)
    assert [f.name for f in fields(one)] == [f.name for f in fields(other)]
    assert Point.__match_args__ == Theirs.__match_args__
    assert not hasattr(one, "__dict__")


def test_record_and_its_heir_are_asked_for_their_fields_in_any_order() -> None:
    for order in ((0, 1), (1, 0)):
        base = record(type("Base", (), {"__annotations__": {"x": float}}))
        heir = record(type("Heir", (base,), {"__annotations__": {"z": float}, "z": 1.0}))
        asked: list[Any] = [base, heir]
        for which in order:
            fields(asked[which])
        assert [f.name for f in fields(base)] == ["x"]
        assert [f.name for f in fields(heir)] == ["x", "z"]
        assert replace(heir(2.0), x=3.0) == heir(3.0, 1.0)


class Describes:
    """A class that is no record."""

    def described(self) -> str:
        return f"this is {self!r}"


@record
class Described(Describes):
    """A record of another family."""

    x: float


def test_record_keeps_the_classes_that_it_is_made_of() -> None:
    assert Described(1.0).described() == "this is Described(x=1.0)"
    assert isinstance(Described(1.0), Describes)
    assert replace(Described(1.0), x=2.0) == Described(2.0)


def test_heir_without_fields_of_its_own_has_those_of_its_base() -> None:
    @record
    class Same(Point):
        """A place by another name."""

    assert Same.__match_args__ == ("x", "y")
    assert repr(Same(1.0)).endswith("Same(x=1.0, y=0.0)")
    assert Same(1.0) == Same(1.0, 0.0)


def test_secret_is_not_shown() -> None:
    assert repr(Secret("orb", "1234")) == "Secret(name='orb')"


def test_changed_copy_is_checked_like_a_new_one() -> None:
    assert replace(Point(1.0, 2.0), x=3.0) == Point(3.0, 2.0)
    with pytest.raises(ValueError, match=r"2\.0 is no share"):
        replace(Share(0.5), value=2.0)


def test_record_is_frozen() -> None:
    point: Any = Point(1.0)
    with pytest.raises(FrozenInstanceError):
        point.x = 2.0
    with pytest.raises(FrozenInstanceError):
        del point.x
    with pytest.raises(AttributeError):
        point.z = 2.0


@pytest.mark.parametrize(
    "again", [copy.copy, copy.deepcopy, lambda r: pickle.loads(pickle.dumps(r))]
)
def test_copy_is_equal(again: Callable[[Any], Any]) -> None:
    assert again(Named(1.0, 2.0, "home", ("a",))) == Named(1.0, 2.0, "home", ("a",))


@pytest.mark.parametrize(
    ("values", "named", "said"),
    [
        ((), {}, "needs x"),
        ((1.0, 2.0, 3.0), {}, "so many values"),
        ((1.0,), {"x": 2.0}, "does not take x"),
        ((1.0,), {"z": 2.0}, "does not take z"),
    ],
)
def test_wrong_values_are_refused(values: Any, named: Any, said: str) -> None:
    with pytest.raises(TypeError, match=said):
        Point(*values, **named)
