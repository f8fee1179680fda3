"""The settings of a sweep's file: of what kind each is, and what it is if nothing is said."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, Final

from controller.simulator.presets import PRESETS
from models.data.examples import refuse_test_seed
from models.data.simulate import DataSet
from models.studies.sweep import kinds

SECTIONS: Final = ("data", "train", "test", "axes")
NETWORKS: Final = ("gesture", "location")  # parts of a recipe
ENROLLED: Final = "user"  # the task in which people are judged who were learned from
PEOPLE: Final = ("user", "mood")  # how people are learned, and vary
_SEED: Final = kinds.whole(0, 2**32 - 1)
_LEARNED: Final[dict[str, kinds.Kind]] = {
    "users": kinds.whole(0, 100_000),
    "sessions": kinds.whole(0, 100_000),
    "minutes": kinds.number(0.0, 6000.0),
}
SIMULATED: Final[dict[str, kinds.Kind]] = {
    "seed": _SEED,
    "users": kinds.whole(1, 100_000),
    "sessions": kinds.whole(1, 10_000),
    "minutes": kinds.number(0.5, 600.0),
    "preset": kinds.word(*PRESETS),
    "protocol": kinds.word("free", "blocks"),
    "hand": kinds.word("person", "pointer"),
    "rate_hz": kinds.number(1.0, 200.0),
    "rows": kinds.whole(2, 32),
    "columns": kinds.whole(2, 32),
    "one_orb": kinds.like(False),
    "gestures": kinds.texts('a list of labels, such as ["press", "pinch"]'),
}
KINDS: Final[dict[str, dict[str, kinds.Kind]]] = {
    "data": {"folders": kinds.texts('a list of folders, such as ["data"]'), **SIMULATED},
    "train": {
        "task": kinds.word("gesture", "location", "user"),
        "recipe": kinds.word("default", "paper"),
        "labels": kinds.word("auto", "true", "button", "key", "cue"),
        "all": kinds.like(False),
        "window": kinds.whole(0, 250),
        "seed": _SEED,
        **_LEARNED,
    },
    "test": {
        "by": kinds.word("user", "session"),
        "folds": kinds.whole(2, 1000),
        "hold": kinds.whole(1, 10_000),
    },
}
DEFAULTS: Final[dict[str, dict[str, Any]]] = {
    "data": {
        "seed": 0, "users": 10, "sessions": 2, "minutes": 3.0, "preset": "nominal",
        "protocol": "free", "hand": "person", "rate_hz": 10.0, "rows": 5, "columns": 5,
        "one_orb": False,
        "gestures": list(DataSet().gestures),
    },
    "train": {
        "task": "gesture", "recipe": "default", "labels": "auto", "all": False,
        "window": 0, "seed": 0, "users": 0, "sessions": 0, "minutes": 0.0,
    },
    "test": {"by": "user"},
}  # fmt: skip


def data_set(data: Mapping[str, Any]) -> DataSet:
    """Return a simulation's settings as the simulator takes them."""
    own = {field.name for field in fields(DataSet)}
    settings = {key: value for key, value in data.items() if key in own}
    return DataSet(**{**settings, "gestures": tuple(data["gestures"])})


CHECKS: Final[dict[str, Callable[[Mapping[str, Any]], object]]] = {
    "seed": lambda data: refuse_test_seed(data["seed"], "this simulation"),
    "gestures": lambda data: data_set(data).repertoire(),
}
