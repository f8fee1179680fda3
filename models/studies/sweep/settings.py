"""Settings of a plan file: type, range and default of each, and the recipe that they make."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from math import inf
from typing import Any, Final, TypeVar

from controller.simulator.presets import PRESETS
from models.data.examples import refuse_test_seed
from models.data.recipe import (
    RECIPES,
    UNVARIED_USER,
    USER,
    VARIED_USER,
    NetworkRecipe,
    Recipe,
    UserAugmentation,
)
from models.data.simulate import DataSet

SECTIONS: Final = ("data", "train", "test", "axes")
_TYPES: Final = {
    bool: "true or false", int: "a whole number", float: "a number", str: "a text",
    list: "a list of texts", tuple: "a row",
}  # fmt: skip

_Made = TypeVar("_Made")


@dataclass(frozen=True, slots=True)
class Setting:
    """Type and range of one setting."""

    default: Any  # value if the file does not set it; a list holds any number of texts
    least: float = -inf  # smallest number
    most: float = inf  # largest number
    words: tuple[str, ...] = ()  # allowed texts; empty: any
    # raises ValueError for a value that cannot be used
    check: Callable[[Any], object] | None = None

    def read(self, value: Any) -> Any:
        """Return a value of the file with the default's type.

        Raises:
            ValueError: It has another type, is out of range, or cannot be used.
        """
        default = self.default
        if isinstance(default, tuple) and isinstance(value, list) and len(value) == len(default):
            return [Setting(one).read(item) for one, item in zip(default, value, strict=True)]
        made = float(value) if type(value) is int and type(default) is float else value
        if isinstance(default, list) and isinstance(value, str):
            made = [value]
        if type(made) is not type(default) or not self._allows(made):
            raise ValueError(f"expected {self}, found {toml(value)}")
        if self.check is not None:
            self.check(made)
        return made

    def _allows(self, value: Any) -> bool:
        if isinstance(value, list):
            return bool(value) and all(isinstance(text, str) for text in value)
        if isinstance(value, str):
            return value in self.words or not self.words
        return bool(self.least <= value <= self.most)

    def __str__(self) -> str:
        """Return what the file may say, such as "a whole number from 1 to 9"."""
        if self.words:
            return f"one of {', '.join(self.words)}"
        name = _TYPES[type(self.default)]
        if self.most < inf:
            return f"{name} from {self.least:g} to {self.most:g}"
        return f"{name}, such as {toml(self.default)}"


def _seed(use: str) -> Setting:
    """Return the setting of a seed; those of tests are refused."""
    return Setting(0, 0, 2**32 - 1, check=lambda seed: refuse_test_seed(seed, use))


def _check_gestures(labels: list[str]) -> None:
    DataSet(gestures=tuple(labels)).repertoire()


SIMULATION: Final = {
    "seed": _seed("this simulation"),
    "users": Setting(10, 1, 100_000),
    "sessions": Setting(2, 1, 10_000),
    "minutes": Setting(3.0, 0.5, 600.0),
    "preset": Setting("nominal", words=tuple(PRESETS)),
    "protocol": Setting("free", words=("free", "blocks")),
    "hand": Setting("person", words=("person", "pointer")),
    "rate_hz": Setting(10.0, 1.0, 200.0),
    "rows": Setting(5, 2, 32),
    "columns": Setting(5, 2, 32),
    "one_orb": Setting(False),
    "gestures": Setting(list(DataSet().gestures), check=_check_gestures),
}
RECORDINGS: Final = {"folders": Setting(["data"])}
TRAIN: Final = {
    "task": Setting("gesture", words=("gesture", "location", "user")),
    "recipe": Setting("default", words=tuple(RECIPES)),
    "labels": Setting("auto", words=("auto", "true", "button", "key", "cue")),
    "all": Setting(False),
    "window": Setting(0, 0, 250),
    "seed": _seed("this training"),
    "users": Setting(0, 0, 100_000),
    "sessions": Setting(0, 0, 100_000),
    "minutes": Setting(0.0, 0.0, 6000.0),
}
TEST: Final = {
    "by": Setting("user", words=("user", "session")),
    "folds": Setting(5, 2, 1000),
    "hold": Setting(1, 1, 10_000),
}


def defaults(settings: Mapping[str, Setting]) -> dict[str, Any]:
    """Return the default of every setting."""
    return {key: setting.default for key, setting in settings.items()}


def data_set(data: Mapping[str, Any]) -> DataSet:
    """Return the simulation of [data]."""
    own = {field.name for field in fields(DataSet)}
    chosen = {key: value for key, value in data.items() if key in own}
    return DataSet(**{**chosen, "gestures": tuple(data["gestures"])})


def of_train(recipe: str) -> Mapping[str, Setting]:
    """Return the settings of [train]: its own, and a recipe's by dotted names."""
    if recipe not in RECIPES:
        return TRAIN
    parts = {**asdict(RECIPES[recipe]), "user": asdict(USER), "mood": asdict(VARIED_USER)}
    del parts["name"]
    return {**TRAIN, **{name: Setting(value) for name, value in flattened(parts)}}


def recipe_of(train: Mapping[str, Any]) -> Recipe:
    """Return the recipe of the gesture and location networks, from the settings of [train]."""
    own = {key: value for key, value in train.items() if key not in TRAIN}
    known = {key: own[key] for key in own if not key.startswith(("user.", "mood."))}
    return changed(RECIPES[train["recipe"]], known)


def user_recipe_of(train: Mapping[str, Any]) -> tuple[NetworkRecipe, UserAugmentation]:
    """Return how users are learned; the paper's recipe learns them as it does gestures."""
    if train["recipe"] == "paper":
        return recipe_of(train).gesture, UNVARIED_USER
    user, mood = (
        {key.removeprefix(part): value for key, value in train.items() if key.startswith(part)}
        for part in ("user.", "mood.")
    )
    return changed(USER, user), changed(VARIED_USER, mood)


def changed(made: _Made, settings: Mapping[str, Any]) -> _Made:
    """Return a dataclass in which settings, by dotted names, have other values."""
    for key, value in settings.items():
        made = _set(made, key.split("."), tuple(value) if isinstance(value, list) else value)
    return made


def _set(made: Any, path: list[str], value: Any) -> Any:
    first, *rest = path
    return replace(made, **{first: _set(getattr(made, first), rest, value) if rest else value})


def flattened(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of nested tables by dotted names."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from flattened(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def toml(value: Any) -> str:
    """Return a value as TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    return f'"{value}"' if isinstance(value, str) else str(value)
