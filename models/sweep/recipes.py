"""A recipe's settings by their dotted names: "gesture.rate", "gesture.augmentation.turned"."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from models.recipe import RECIPES, Recipe
from models.sweep import kinds
from models.sweep.plan import nearest
from models.sweep.settings import KINDS, NETWORKS


def allow(recipe: str, key: str, value: Any) -> Any:
    """Return a setting's value as the recipe has it.

    Raises:
        ValueError: There is no such setting, or the value is of another kind.
    """
    known = settings(RECIPES[recipe])
    if key not in known:
        raise ValueError(f"there is no such setting; {nearest(key, {**KINDS['train'], **known})}")
    return kinds.like(known[key])(value)


def changed(recipe: Recipe, settings: Mapping[str, Any]) -> Recipe:
    """Return a recipe with other settings."""
    for key, value in settings.items():
        recipe = _set(recipe, key.split("."), value)
    return recipe


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
