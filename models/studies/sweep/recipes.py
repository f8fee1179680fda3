"""A recipe's settings by their dotted names: "gesture.rate", "gesture.augmentation.turned".

People are learned by a course of their own ("user.rate"), and vary as a person does ("mood.firm").
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, TypeVar

from models.data.recipe import (
    RECIPES,
    UNVARIED_USER,
    USER,
    VARIED_USER,
    NetworkRecipe,
    Recipe,
    UserAugmentation,
)
from models.studies.sweep import kinds
from models.studies.sweep.plan import nearest
from models.studies.sweep.settings import KINDS, NETWORKS, PEOPLE

_Made = TypeVar("_Made", Recipe, NetworkRecipe, UserAugmentation)


@dataclass(frozen=True, slots=True)
class Asked:
    """How everything is trained.

    Attributes:
        recipe: Gestures and places.
        user: Who touches.
        mood: How people's examples are varied.
    """

    recipe: Recipe
    user: NetworkRecipe
    mood: UserAugmentation


def asked(train: Mapping[str, Any]) -> Asked:
    """Return how a job trains, from its settings; the paper learned people as gestures."""
    name = train["recipe"]
    own = {key: value for key, value in train.items() if key not in KINDS["train"]}
    parts: dict[str, dict[str, Any]] = {part: {} for part in PEOPLE}
    for key in [key for key in own if key.partition(".")[0] in PEOPLE]:
        part, _, field = key.partition(".")
        parts[part][field] = own.pop(key)
    recipe = changed(RECIPES[name], own)
    if name == "paper":
        return Asked(recipe, recipe.gesture, UNVARIED_USER)
    return Asked(recipe, changed(USER, parts["user"]), changed(VARIED_USER, parts["mood"]))


def allow(recipe: str, key: str, value: Any) -> Any:
    """Return a setting's value as the recipe has it.

    Raises:
        ValueError: There is no such setting, or the value is of another kind.
    """
    known = {
        **settings(RECIPES[recipe]),
        **settings(USER, "user."),
        **settings(VARIED_USER, "mood."),
    }
    if recipe == "paper" and key.partition(".")[0] in PEOPLE:
        raise ValueError("the paper learned people as it did gestures; say gesture.epochs and such")
    if key not in known:
        raise ValueError(f"there is no such setting; {nearest(key, {**KINDS['train'], **known})}")
    return kinds.like(known[key])(value)


def changed(made: _Made, settings: Mapping[str, Any]) -> _Made:
    """Return a recipe, or a part of one, with other settings."""
    for key, value in settings.items():
        made = _set(made, key.split("."), value)
    return made


def settings(made: Any, before: str = "") -> dict[str, Any]:
    """Return all settings by their dotted names."""
    found: dict[str, Any] = {}
    for field in fields(made):
        value = getattr(made, field.name)
        if is_dataclass(value) and not isinstance(value, type):
            found |= settings(value, f"{before}{field.name}.")
        elif before or field.name not in ("name", *NETWORKS):
            found[f"{before}{field.name}"] = value
    return found


def _set(made: Any, path: list[str], value: Any) -> Any:
    first, *rest = path
    if rest:
        value = _set(getattr(made, first), rest, value)
    return replace(made, **{first: tuple(value) if isinstance(value, list) else value})
