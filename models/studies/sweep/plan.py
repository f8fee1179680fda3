"""Plan files of sweeps: data, recipe, hold-out, and the axes to vary.

    [data]                  folders of recordings
    [train]                 recipe of every network
    [test]                  what is held out, and judged
    [axes]                  lists: every combination is trained

An axis is a setting of [train], or of the recipe ("gesture.rate").
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final, Literal

from controller.recognition.images.frames import MOST_WINDOW
from controller.shared import config
from controller.shared.config import ConfigError
from controller.shared.errors import UserError
from models.data.examples import Choice
from models.data.recipe import RECIPES, Recipe
from models.data.splits import HoldOut

AMOUNTS: Final = ("users", "sessions", "minutes")
MODELS: Final = ("network", "trees", "mlp", "dtw", "gru")
PLACE_MODELS: Final = MODELS[:2]
MOST_JOBS: Final = 100_000
FOLDS: Final = 5  # without [test]
_PAGE: Final = "orbtouch docs sweeps"

Table = Mapping[str, Any]  # a table of the file
Job = dict[str, Any]  # "data", "train", "test" and "at", its place on the axes; JSON


class PlanError(UserError, ValueError):
    """A plan file is not valid; the message is one sentence with the line."""


def _upto(default: float, most: float) -> Any:
    """Return a field for a number from 0 to a limit."""
    return field(default=default, metadata={"range": (0, most)})


@dataclass(frozen=True, slots=True)
class Recorded:
    """[data]: recordings."""

    folders: tuple[str, ...] = ("data",)  # beside the file, or elsewhere


@dataclass(frozen=True, slots=True, kw_only=True)
class Training(Recipe):
    """[train]: a recipe, and what is learned with it."""

    name: str = field(default="default", metadata={"key": "recipe", "choices": tuple(RECIPES)})
    task: Literal["gesture", "location"] = "gesture"
    # the networks, or a peer (models/studies/sweep/peers.py); of places the trees are the only one
    model: str = field(default="network", metadata={"choices": MODELS})
    labels: Choice = "auto"
    every: bool = field(default=False, metadata={"key": "all"})  # recordings that fail the check
    window: int = _upto(0, MOST_WINDOW)  # images; 0: those of a second
    declared: bool = False  # try no symmetries that are not declared
    seed: int = _upto(0, 2**32 - 1)
    # learn from so many of those not held out, 0: all
    users: int = _upto(0, 100_000)
    sessions: int = _upto(0, 100_000)
    minutes: float = _upto(0.0, 6000.0)

    @property
    def recipe(self) -> Recipe:
        """The recipe alone."""
        return Recipe(**{one.name: getattr(self, one.name) for one in fields(Recipe)})


@dataclass(frozen=True, slots=True)
class Plan:
    """A sweep's data, recipe, hold-out and axes, as the file has them."""

    name: str = ""  # default: that of the file, without its suffix
    data: Recorded = field(default_factory=Recorded)
    train: dict[str, Any] = field(default_factory=dict)
    test: HoldOut = field(default_factory=HoldOut)
    axes: dict[str, Any] = field(default_factory=dict)  # values by name, in the file's order

    def jobs(self, digest: str) -> list[Job]:
        """Return all trainings in the order of the axes; folds of one point are neighbours.

        The digest is a hash of the recordings and their vocabulary.
        """
        data, test = {**asdict(self.data), "sha256": digest}, asdict(self.test)
        made: list[Job] = []
        for values in itertools.product(*self.axes.values()):
            at = dict(zip(self.axes, values, strict=True))
            whole = {"at": at, "data": data, "train": self.at(at)}
            folds = range(self.test.folds or 1)
            made += [{**whole, "test": {**test, "fold": fold}} for fold in folds]
        return made

    def at(self, at: Table) -> dict[str, Any]:
        """Return [train] at a place on the axes."""
        train = self.train
        for name, value in at.items():
            train = _placed(train, name.split("."), value)
        return train


def read(path: Path) -> Plan:
    """Return the plan in a file; raise PlanError if it cannot be read, or holds a mistake."""
    return config.checked(path, lambda table: parse(table, path.stem), PlanError, _PAGE)


def parse(table: Table, name: str) -> Plan:
    """Return the plan in the table of a file; ConfigError if it holds a mistake."""
    plan = config.settings(Plan, table)
    plan = replace(plan, name=plan.name or name, axes=dict(_flattened(plan.axes)))
    if plan.test.folds and plan.test.hold:
        raise ConfigError("has folds, which hold out all in turn, and hold; give one", "test")
    if not plan.test.hold:
        plan = replace(plan, test=replace(plan.test, folds=plan.test.folds or FOLDS))
    training(plan.train)
    for axis, values in plan.axes.items():
        _check_axis(plan, axis, values)
    count = (plan.test.folds or 1) * math.prod(map(len, plan.axes.values()))
    if count > MOST_JOBS:
        raise ConfigError(f"is of {count:,} trainings; at most {MOST_JOBS:,} are done", "axes")
    return plan


def training(table: Table) -> Training:
    """Return the settings in [train], the others those of its recipe; or ConfigError."""
    recipe = RECIPES.get(str(table.get("recipe")), RECIPES["default"])
    base = Training(**{one.name: getattr(recipe, one.name) for one in fields(Recipe)})
    made = config.settings(Training, table, "train", base)
    if made.task == "location" and made.model not in PLACE_MODELS:
        expected = f"for places there are {' and '.join(PLACE_MODELS)}"
        raise ConfigError(f"has model = {made.model!r}; {expected}", "train", "model")
    return made


def _check_axis(plan: Plan, axis: str, values: Any) -> None:
    """Raise ConfigError for an axis that cannot be used."""
    if not isinstance(values, list) or not values:
        expected = "expected is a list of values"
        raise ConfigError(f"has {axis} = {values!r} under [axes]; {expected}", "axes", axis)
    if axis == "task":
        why = "scores of tasks do not compare; make a sweep for each"
        raise ConfigError(f"has an axis task under [axes], and {why}", "axes", axis)
    for value in values:
        try:
            training(plan.at({axis: value}))
        except ConfigError as error:
            raise ConfigError(str(error), "axes", axis) from None


def _placed(table: Table, path: Sequence[str], value: Any) -> dict[str, Any]:
    """Return a table with a value at a path of keys."""
    first, *rest = path
    inside = table.get(first)
    inside = inside if isinstance(inside, Mapping) else {}
    return {**table, first: _placed(inside, rest, value) if rest else value}


def _flattened(table: Table, before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of nested tables by dotted names."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _flattened(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value
