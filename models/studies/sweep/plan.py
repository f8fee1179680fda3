"""Plan files of sweeps: data, recipe, hold-out, and the axes to vary.

    [data]                  recordings in folders, or settings of a simulation
    [train]                 recipe of every network
    [test]                  what is held out, and judged
    [axes]                  lists: every combination is trained

An axis is a setting of [train], of the recipe ("gesture.rate") or of a simulation
("data.preset"). What the file leaves out has the default of `settings`.
"""

import difflib
import itertools
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller import config, files
from controller.errors import UserError, reason
from models.data import splits
from models.data.splits import HoldOut
from models.studies.sweep import settings
from models.studies.sweep.settings import RECORDINGS, SECTIONS, SIMULATION, TEST, TRAIN, Setting

AMOUNTS: Final = ("users", "sessions", "minutes")
MOST_JOBS: Final = 100_000
MOST_CHECKED: Final = 10_000  # recordings; of more, each training checks its own hold-out

Job = dict[str, Any]  # "data", "train", "test" and "at", its place on the axes; JSON


class PlanError(UserError, ValueError):
    """A plan file is not valid; the message is one sentence with the line."""


@dataclass(frozen=True, slots=True)
class Plan:
    """A sweep's data, recipe, hold-out and axes."""

    name: str  # name of the file, without its suffix
    data: dict[str, Any]  # settings of the simulation, or {"folders": [...]}.
    train: dict[str, Any]  # settings of [train], the recipe's by their dotted names
    test: dict[str, Any]  # settings of [test]: "by", and "folds" or "hold"
    axes: dict[str, list[Any]]  # name and values of each axis, in the file's order

    @property
    def simulated(self) -> bool:
        """Whether the data are simulated, not recorded."""
        return "folders" not in self.data

    def jobs(self, digest: str = "") -> list[Job]:
        """Return all trainings in the order of the axes; folds of one point are neighbours.

        Args:
            digest: Hash of the recordings and their vocabulary; "" if data are simulated.
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
        known = section in SECTIONS
        super().__init__(f"[{section}]{' ' * bool(key)}{key}: {problem}" if known else problem)
        self.section, self.key = section, key

    def line(self, text: str) -> str:
        """Return ", line N" of the mistake in the file's text; "" if it cannot be found."""
        parts = self.key.split(".")
        for inner in range(len(parts) if self.key else 0):  # [axes.gesture] is a table, too
            table, key = ".".join([self.section, *parts[:inner]]), ".".join(parts[inner:])
            if found := config.line_of(text, table, key):
                return found
        return config.line_of(text, self.section) or config.line_of(text, "", self.section)


@contextmanager
def _at(section: str, key: str) -> Iterator[None]:
    """Make errors in here mistakes at a key of the file."""
    try:
        yield
    except ValueError as error:
        raise _FaultError(section, key, error) from None


def read(path: Path) -> Plan:
    """Return the plan in a file.

    Raises:
        PlanError: It cannot be read, or holds a mistake.
    """
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
    given = {section: dict(settings.flattened(table.get(section, {}))) for section in SECTIONS}
    known = RECORDINGS if "folders" in given["data"] else SIMULATION
    data = settings.defaults(SIMULATION) if known is SIMULATION else {}
    data |= {key: _value("data", key, value, known) for key, value in given["data"].items()}
    train = settings.defaults(TRAIN)
    recipe = str(given["train"].get("recipe", train["recipe"]))
    for key, value in given["train"].items():
        train[key] = _value("train", key, value, settings.of_train(recipe))
    simulated = known is SIMULATION
    axes = {
        key: _axis(key, values, recipe, simulated=simulated)
        for key, values in given["axes"].items()
    }
    made = Plan(name, data, train, _test(given["test"], train["task"] == "user"), axes)
    count = made.test.get("folds", 1) * math.prod(map(len, axes.values()))
    if count > MOST_JOBS:
        raise _FaultError("axes", "", f"these are {count:,} trainings; at most {MOST_JOBS:,}")
    if made.simulated:
        _check_amounts(made)
    return made


def _test(given: Mapping[str, Any], enrolled: bool) -> dict[str, Any]:
    """Return the settings of [test]."""
    test = {key: _value("test", key, value, TEST) for key, value in given.items()}
    if enrolled and test.get("by") == "user":
        why = 'a user who is not enrolled cannot be identified; say by = "session"'
        raise _FaultError("test", "by", why)
    if {"folds", "hold"} <= test.keys():
        raise _FaultError("test", "hold", "folds hold out every group in turn; give one of the two")
    if not {"folds", "hold"} & test.keys():
        key = "hold" if enrolled else "folds"
        test[key] = TEST[key].default
    return {"by": "session" if enrolled else TEST["by"].default, **test}


def _axis(key: str, values: Any, recipe: str, *, simulated: bool) -> list[Any]:
    """Return the values of an axis."""
    if not isinstance(values, list) or not values:
        found = settings.toml(values)
        raise _FaultError("axes", key, f"expected a list of values, found {found}")
    if key == "task":
        raise _FaultError("axes", key, "scores of tasks do not compare; make a sweep for each")
    if not key.startswith("data."):
        return [_value("axes", key, one, settings.of_train(recipe)) for one in values]
    if not simulated:
        why = "only simulations have such an axis; make a sweep for each data set"
        raise _FaultError("axes", key, why)
    known = {f"data.{setting}": own for setting, own in SIMULATION.items()}
    return [_value("axes", key, one, known) for one in values]


def _value(section: str, key: str, value: Any, known: Mapping[str, Setting]) -> Any:
    """Return the value of a known setting."""
    with _at(section, key):
        if key not in known:
            close = difflib.get_close_matches(key, known, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"there are {', '.join(known)}"
            raise ValueError(f"there is no such setting; {hint}")
        return known[key].read(value)


def _check_amounts(plan: Plan) -> None:
    """Refuse to hold out, or to learn from, more than the smallest simulation has."""
    least = {key: min(plan.axes.get(f"data.{key}", [plan.data[key]])) for key in AMOUNTS}
    most = {key: max(plan.axes.get(key, [plan.train[key]])) for key in AMOUNTS}
    if most["minutes"] > least["minutes"]:
        why = f"{most['minutes']:g} are wanted, and {least['minutes']:g} simulated; simulate more"
        raise _FaultError("axes" if "minutes" in plan.axes else "train", "minutes", why)
    if least["users"] * least["sessions"] > MOST_CHECKED:
        return
    session = np.arange(least["users"] * least["sessions"])
    user = session // least["sessions"]
    with _at("test", "folds" if "folds" in plan.test else "hold"):
        rule = HoldOut(**plan.test, enrolled=plan.train["task"] == "user")
        held = rule.held(user, session)
    with _at("axes" if {"users", "sessions"} & plan.axes.keys() else "train", ""):
        splits.learned(user, session, held, most["users"], most["sessions"], 0)
