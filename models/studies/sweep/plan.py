"""Plan files of sweeps: data, recipes, what is held out, and the axes.

    [data]                  recordings in folders, or a simulation by its seed
    [train]                 how every network is trained
    [test]                  what is held out, and judged
    [axes]                  lists: every combination is trained

An axis is a setting of [train], of the recipe ("gesture.rate") or of a simulation
("data.preset"). What the file does not say is as in `DEFAULTS`.
"""

import difflib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from controller import config, files
from controller.errors import UserError, reason
from models.data.examples import refuse_test_seed
from models.studies.sweep import kinds
from models.studies.sweep.settings import (
    CHECKS,
    DEFAULTS,
    ENROLLED,
    KINDS,
    NETWORKS,
    PEOPLE,
    SECTIONS,
    SIMULATED,
)

MOST_JOBS: Final = 100_000
_HEADER: Final = re.compile(r"\s*\[+\s*([^\]\[]+?)\s*\]+")
_KEY: Final = re.compile(r"\s*([\w\"'.\- ]+?)\s*=")

Allow = Callable[[str, str, Any], Any]  # recipe, setting, value -> the value, as the recipe has it


class PlanError(UserError, ValueError):
    """A sweep's file is not one; the message is one sentence with the line."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What a sweep is about.

    Attributes:
        name: Of its file, without the ending.
        data: Settings of the simulation, or {"folders": [...]}.
        train: Settings of [train], the recipe's by their dotted names.
        test: Settings of [test]: "by", and "folds" or "hold".
        axes: Name and values of each axis, in the file's order.
    """

    name: str
    data: dict[str, Any]
    train: dict[str, Any]
    test: dict[str, Any]
    axes: tuple[tuple[str, tuple[Any, ...]], ...]

    @property
    def simulated(self) -> bool:
        """Whether people are simulated; else they were recorded."""
        return "folders" not in self.data


def read(path: Path, allow: Allow) -> Plan:
    """Return what a file says.

    Args:
        path: The file.
        allow: Returns the value of a recipe's setting, or raises ValueError.

    Raises:
        PlanError: It cannot be read, or says something that cannot be.
    """
    try:
        text = files.read_text(path, config.MAX_BYTES)
    except OSError as error:
        raise PlanError(
            f"cannot read {path}: {reason(error)}; models sweep --example prints one to begin with"
        ) from None
    return parse(text, str(path), path.stem, allow)


def parse(text: str, path: str, name: str, allow: Allow) -> Plan:
    """Return what a text says; see `read`."""
    try:
        said = config.parse_toml(text)
    except config.ConfigError as error:
        raise PlanError(f"{path}, {error}") from None
    try:
        return _plan(said, name, allow)
    except _FaultError as fault:
        line = line_of(text, fault.keys)
        where = f"{path}, line {line}" if line else path
        raise PlanError(f"{where}: {fault}") from None


class _FaultError(ValueError):
    """Something is wrong at a key."""

    def __init__(self, keys: tuple[str, ...], why: str) -> None:
        section, *rest = keys
        inside = f" {'.'.join(rest)}" if rest else ""
        super().__init__(f"[{section}]{inside}: {why}" if section in SECTIONS else why)
        self.keys = keys


def _plan(said: Mapping[str, Any], name: str, allow: Allow) -> Plan:
    for section, inside in said.items():
        if section not in SECTIONS or not isinstance(inside, dict):
            listed = ", ".join(f"[{one}]" for one in SECTIONS)
            raise _FaultError((section,), f"{section!r} is no section; there are {listed}")
    flat = {section: _flat(said.get(section, {})) for section in SECTIONS}
    data = _data(flat["data"])
    train = dict(DEFAULTS["train"])
    recipe = flat["train"].get("recipe", train["recipe"])
    for key, value in flat["train"].items():
        train[key] = _value(("train", key), key, value, recipe, allow)
    test = {**DEFAULTS["test"], **_section("test", flat["test"])}
    if train["task"] == ENROLLED:
        _enrolled(flat, test)
    if "folds" in test and "hold" in test:
        raise _FaultError(("test", "hold"), "folds hold everybody out in turn; say one of the two")
    if "folds" not in test and "hold" not in test:
        test["folds"] = 5
    axes = tuple(_axis(key, value, "folders" in data, train, allow)
                 for key, value in flat["axes"].items())  # fmt: skip
    count = test.get("folds", 1)
    for _, values in axes:
        count *= len(values)
    if count > MOST_JOBS:
        raise _FaultError(("axes",), f"these are {count:,} trainings; the most are {MOST_JOBS:,}")
    made = Plan(name, data, train, test, axes)
    if made.simulated:
        _enough(made)
    return made


def _enrolled(flat: Mapping[str, dict[str, Any]], test: dict[str, Any]) -> None:
    """Refuse what has no meaning where people are told apart: they are judged on other days."""
    if "by" in flat["test"] and test["by"] != "session":
        why = 'whoever was never enrolled cannot be named; say by = "session"'
        raise _FaultError(("test", "by"), why)
    test["by"] = "session"
    if "folds" not in test and "hold" not in test:
        test["hold"] = 1
    for section, users in (("train", [flat["train"].get("users")]),
                           ("axes", flat["axes"].get("users", []))):  # fmt: skip
        if isinstance(users, list) and 1 in users:
            raise _FaultError((section, "users"), "one person is told apart from nobody; say two")


def _data(said: dict[str, Any]) -> dict[str, Any]:
    """Return what is learned from."""
    if "folders" in said:
        odd = next((key for key in said if key != "folders"), None)
        if odd:
            why = "folders hold recordings, and nothing is simulated; leave one of the two out"
            raise _FaultError(("data", odd), why)
        return _section("data", said)
    data = {**DEFAULTS["data"], **_section("data", said)}
    for key in CHECKS:
        _checked(key, ("data", key), data)
    return data


def _checked(key: str, keys: tuple[str, ...], data: dict[str, Any]) -> None:
    """Refuse a simulation that cannot be, or that is for tests only."""
    try:
        CHECKS[key](data)
    except ValueError as error:
        raise _FaultError(keys, str(error)) from None


def _axis(
    key: str, values: Any, recorded: bool, train: Mapping[str, Any], allow: Allow
) -> tuple[str, tuple[Any, ...]]:
    """Return an axis."""
    keys = ("axes", key)
    if not isinstance(values, list) or not values:
        raise _FaultError(keys, f"expected a list of values, found {kinds.told(values)}")
    if key == "task":
        raise _FaultError(keys, "tasks are not judged alike; make a sweep for each")
    section, _, setting = key.rpartition("data.")
    if key.startswith("data.") and not section:
        if setting == "folders" or (setting in SIMULATED and recorded):
            raise _FaultError(keys, "only simulations have such an axis; make a sweep for each set")
        made = [_value(keys, setting, one, "", allow, "data") for one in values]
        for one in made if setting in CHECKS else ():
            _checked(setting, keys, {**DEFAULTS["data"], setting: one})
    else:
        made = [_value(keys, key, one, train["recipe"], allow) for one in values]
    if any(one in made[:place] for place, one in enumerate(made)):
        raise _FaultError(keys, "a value is there twice; say each once")
    return key, tuple(made)


def _section(section: str, said: Mapping[str, Any]) -> dict[str, Any]:
    return {key: _known((section, key), section, key, value) for key, value in said.items()}


def _value(
    keys: tuple[str, ...], key: str, value: Any, recipe: str, allow: Allow, section: str = "train"
) -> Any:
    """Return a setting's value: of a section, or of the recipe."""
    if section == "data" or key in KINDS["train"]:
        made = _known(keys, section, key, value)
        if section == "train" and key == "seed":
            try:
                refuse_test_seed(made, "this training")
            except ValueError as error:
                raise _FaultError(keys, str(error)) from None
        return made
    if key.partition(".")[0] not in (*NETWORKS, *PEOPLE) and "." in key:
        return _known(keys, section, key, value)
    try:
        return allow(recipe, key, value)
    except ValueError as error:
        raise _FaultError(keys, str(error)) from None


def _known(keys: tuple[str, ...], section: str, key: str, value: Any) -> Any:
    kind = KINDS[section].get(key)
    if kind is None:
        raise _FaultError(keys, f"there is no such setting; {nearest(key, KINDS[section])}")
    try:
        return kind(value)
    except ValueError as error:
        raise _FaultError(keys, str(error)) from None


def _enough(plan: Plan) -> None:
    """Refuse to hold out or to learn from more people than are simulated."""
    axes = dict(plan.axes)
    amounts = ("users", "sessions", "minutes")
    fewest = {key: min(axes.get(f"data.{key}", (plan.data[key],))) for key in amounts}
    enrolled, by_user = plan.train["task"] == ENROLLED, plan.test["by"] == "user"
    whom = "users" if by_user else "sessions of each user" if enrolled else "sessions"
    units = fewest["users"] if by_user else fewest["sessions"]
    units *= 1 if by_user or enrolled else fewest["users"]
    held = plan.test.get("hold") or -(-units // plan.test["folds"])
    key = "hold" if "hold" in plan.test else "folds"
    if plan.test.get("folds", 0) > units or held >= units:
        why = f"{plan.test[key]} is too many of {units} {whom}; say fewer, or simulate more"
        raise _FaultError(("test", key), why)
    left = dict(fewest)
    if by_user or enrolled:
        left["users" if by_user else "sessions"] -= held
    for key, most in left.items():
        asked = max(axes.get(key, (plan.train[key],)))
        if asked > most:
            keys = ("axes", key) if key in axes else ("train", key)
            why = f"{asked:g} cannot be learned from: {most:g} are there beside what is held out"
            raise _FaultError(keys, f"{why}; say fewer, or simulate more")


def _flat(said: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Return nested tables as dotted names."""
    flat: dict[str, Any] = {}
    for key, value in said.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{before}{key}.")
        else:
            flat[f"{before}{key}"] = value
    return flat


def nearest(key: str, known: Mapping[str, Any]) -> str:
    """Return what somebody may have meant, and what there is."""
    close = difflib.get_close_matches(key, known, 1)
    return f"did you mean {close[0]!r}?" if close else f"there are {', '.join(known)}"


def line_of(text: str, keys: tuple[str, ...]) -> int:
    """Return the line in which a key is set, or the nearest one around it; 0: none is."""
    wanted = [part for key in keys for part in key.split(".")]
    header: list[str] = []
    best, deepest = 0, 0
    for number, line in enumerate(text.splitlines(), 1):
        if found := _HEADER.match(line):
            here = header = _parts(found[1])
        elif found := _KEY.match(line):
            here = header + _parts(found[1])
        else:
            continue
        same = 0
        while same < min(len(here), len(wanted)) and here[same] == wanted[same]:
            same += 1
        if same > deepest:
            best, deepest = number, same
    return best


def _parts(name: str) -> list[str]:
    return [part.strip(" \"'") for part in name.split(".")]
