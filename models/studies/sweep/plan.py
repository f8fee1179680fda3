"""Plan files of sweeps: data, recipe, hold-out, and the axes to vary.

    [data]                  recordings in folders, or settings of a simulation
    [train]                 recipe of every network
    [test]                  what is held out, and judged
    [axes]                  lists: every combination is trained

An axis is a setting of [train], of the recipe ("gesture.rate") or of a simulation
("data.preset").
"""

import difflib
import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from math import inf
from pathlib import Path
from typing import Any, Final

from controller.recognition.images.frames import MOST_WINDOW
from controller.shared import config, files
from controller.shared.errors import UserError, reason
from controller.simulator.orb import PRESETS
from models.data.examples import CHOICES, refuse_test_seed
from models.data.recipe import RECIPES
from models.data.simulate import DataSet

AMOUNTS: Final = ("users", "sessions", "minutes")
MOST_JOBS: Final = 100_000
SECTIONS: Final = ("data", "train", "test", "axes")
_TYPES: Final = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text",
    list: "a list of texts",
    tuple: "a row",
}

Job = dict[str, Any]  # "data", "train", "test" and "at", its place on the axes; JSON


class PlanError(UserError, ValueError):
    """A plan file is not valid; the message is one sentence with the line."""


@dataclass(frozen=True, slots=True)
class Setting:
    """Type and range of one setting."""

    default: Any  # value if the file does not set it; a list holds any number of texts
    least: float = -inf
    most: float = inf
    words: tuple[str, ...] = ()  # allowed texts; empty: any
    check: Callable[[Any], object] | None = None  # raises ValueError for an unusable value

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
    "gestures": Setting(
        list(DataSet().gestures),
        check=lambda labels: DataSet(gestures=tuple(labels)).repertoire(),
    ),
}
RECORDINGS: Final = {"folders": Setting(["data"])}
TRAIN: Final = {
    "task": Setting("gesture", words=("gesture", "location")),
    "recipe": Setting("default", words=tuple(RECIPES)),
    "labels": Setting("auto", words=CHOICES),
    "all": Setting(False),
    "window": Setting(0, 0, MOST_WINDOW),
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


@dataclass(frozen=True, slots=True)
class Plan:
    """A sweep's data, recipe, hold-out and axes."""

    name: str  # of the file, without its suffix
    data: dict[str, Any]  # settings of the simulation, or {"folders": [...]}
    train: dict[str, Any]  # settings of [train], the recipe's by their dotted names
    test: dict[str, Any]  # settings of [test]: "by", and "folds" or "hold"
    axes: dict[str, list[Any]]  # name and values of each axis, in the file's order

    @property
    def simulated(self) -> bool:
        """Whether the data are simulated, not recorded."""
        return "folders" not in self.data

    def jobs(self, digest: str = "") -> list[Job]:
        """Return all trainings in the order of the axes; folds of one point are neighbours.

        The digest is a hash of the recordings and their vocabulary; "" if data are simulated.
        """
        made: list[Job] = []
        for values in itertools.product(*self.axes.values()):
            at = dict(zip(self.axes, values, strict=True))
            data = {**self.data, **({"sha256": digest} if digest else {})}
            train = dict(self.train)
            for name, value in at.items():
                setting = name.removeprefix("data.")
                (train if setting == name else data)[setting] = value
            made += [
                {"at": at, "data": data, "train": train, "test": {**self.test, "fold": fold}}
                for fold in range(self.test.get("folds", 1))
            ]
        return made


class _FaultError(ValueError):
    """A mistake in a section, or at one of its keys."""

    def __init__(self, section: str, key: str, problem: object) -> None:
        super().__init__(f"[{section}] {key}: {problem}" if key else problem)
        self.section, self.key = section, key

    def line(self, text: str) -> str:
        """Return ", line N" of the mistake in the file's text; "" if it cannot be found."""
        whole = config.line_of(text, self.section) or config.line_of(text, "", self.section)
        return config.line_of(text, self.section, self.key) if self.key else whole


def read(path: Path) -> Plan:
    """Return the plan in a file; raise PlanError if it cannot be read, or holds a mistake."""
    try:
        text = files.read_text(path, config.MAX_BYTES)
    except OSError as error:
        raise PlanError(
            f"cannot read {path}: {reason(error)}; models sweep --example prints a plan"
        ) from None
    return parse(text, str(path), path.stem)


def parse(text: str, path: str, name: str) -> Plan:
    """Return the plan in a text; see `read`."""
    try:
        return _plan(config.parse_toml(text), name)
    except config.ConfigError as error:
        raise PlanError(f"{path}, {error}") from None
    except _FaultError as fault:
        raise PlanError(f"{path}{fault.line(text)}: {fault}") from None


def _plan(table: Mapping[str, Any], name: str) -> Plan:
    for section, inside in table.items():
        if section not in SECTIONS or not isinstance(inside, dict):
            listed = ", ".join(f"[{one}]" for one in SECTIONS)
            raise _FaultError(section, "", f"{section!r} is no section; there are {listed}")
    given = {section: dict(_flattened(table.get(section, {}))) for section in SECTIONS}
    simulated = "folders" not in given["data"]
    own = SIMULATION if simulated else RECORDINGS
    data = {**_defaults(own), **_settings("data", given["data"], own)}
    known = _of_train(str(given["train"].get("recipe", "default")))
    train = {**_defaults(TRAIN), **_settings("train", given["train"], known)}
    varied = {f"data.{key}": own for key, own in SIMULATION.items()} if simulated else {}
    axes = {key: _axis(key, values, known | varied) for key, values in given["axes"].items()}
    made = Plan(name, data, train, _test(given["test"]), axes)
    count = made.test.get("folds", 1) * math.prod(map(len, axes.values()))
    if count > MOST_JOBS:
        raise _FaultError("axes", "", f"these are {count:,} trainings; at most {MOST_JOBS:,}")
    return made


def _settings(section: str, given: Mapping[str, Any], known: Mapping[str, Setting]) -> Job:
    """Return the values of given settings."""
    return {key: _value(section, key, value, known) for key, value in given.items()}


def _test(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of [test]."""
    test = {"by": TEST["by"].default, **_settings("test", given, TEST)}
    if {"folds", "hold"} <= test.keys():
        raise _FaultError("test", "hold", "folds hold out every group in turn; give one of the two")
    if not {"folds", "hold"} & test.keys():
        test["folds"] = TEST["folds"].default
    return test


def _axis(key: str, values: Any, known: Mapping[str, Setting]) -> list[Any]:
    """Return the values of an axis."""
    if not isinstance(values, list) or not values:
        raise _FaultError("axes", key, f"expected a list of values, found {toml(values)}")
    if key == "task":
        raise _FaultError("axes", key, "scores of tasks do not compare; make a sweep for each")
    return [_value("axes", key, one, known) for one in values]


def _value(section: str, key: str, value: Any, known: Mapping[str, Setting]) -> Any:
    """Return the value of a known setting."""
    if key not in known:
        close = difflib.get_close_matches(key, known, 1)
        hint = f"did you mean {close[0]!r}?" if close else f"there are {', '.join(known)}"
        raise _FaultError(section, key, f"there is no such setting; {hint}")
    try:
        return known[key].read(value)
    except ValueError as error:
        raise _FaultError(section, key, error) from None


def _defaults(settings: Mapping[str, Setting]) -> dict[str, Any]:
    return {key: setting.default for key, setting in settings.items()}


def data_set(data: Mapping[str, Any]) -> DataSet:
    """Return the simulation of [data]."""
    own = {field.name for field in fields(DataSet)}
    chosen = {key: value for key, value in data.items() if key in own}
    return DataSet(**{**chosen, "gestures": tuple(data["gestures"])})


def _of_train(recipe: str) -> dict[str, Setting]:
    """Return the settings of [train]: its own, and a recipe's by dotted names."""
    if recipe not in RECIPES:
        return TRAIN
    parts = asdict(RECIPES[recipe])
    del parts["name"]
    return {**TRAIN, **{name: Setting(value) for name, value in _flattened(parts)}}


def _flattened(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of nested tables by dotted names."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _flattened(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def toml(value: Any) -> str:
    """Return a value as TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    return f'"{value}"' if isinstance(value, str) else str(value)
