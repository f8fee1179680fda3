"""Cue plan, read from TOML: which labels are recorded, how often and at which pace.

docs/recording.md lists the keys; only `labels` must be there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.config import read_toml
from controller.recordings.recording import RecordingError

RANDOM: Final = "random"
BLOCKS: Final = "blocks"

MAX_EXAMPLES: Final = 10_000  # about ten hours
_MAX_NAME: Final = 100  # characters
_SEEDS: Final = 2**32
# Shortest and longest, seconds. A gesture takes half a second and people half of one to begin.
_TIMES: Final = {
    "get_ready_s": (0.0, 60.0),
    "go_s": (0.5, 60.0),
    "rest_s": (0.5, 60.0),
    "jitter_s": (0.0, 60.0),
}


@dataclass(frozen=True, slots=True)
class ExampleRequest:
    """One example that is wanted.

    Attributes:
        label: Of the gesture.
        place: Where, (x, y) in grid units; None: at its usual place.
    """

    label: str
    place: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class CueTiming:
    """Durations of the phases of one example, seconds; a rest takes up to `jitter_s` longer.

    Go ends early when a touch was felt, and then nothing for `still_s`; 0: never.
    """

    get_ready_s: float = 1.0
    go_s: float = 2.0
    rest_s: float = 1.5
    jitter_s: float = 0.5
    still_s: float = 0.0


@dataclass(frozen=True, slots=True)
class CuePlan:
    """The examples to record.

    Attributes:
        name: Kept in the recording as its protocol.
        repetitions: How many examples of each label, in the order of the file.
        pace: Durations of one example.
        order: "random" or "blocks", label after label.
        seed: Of the order and the rests.
    """

    name: str
    repetitions: dict[str, int]
    pace: CueTiming = CueTiming()
    order: str = RANDOM
    seed: int = 1

    def asks(self) -> list[ExampleRequest]:
        """Return all examples in order."""
        labels = [label for label, count in self.repetitions.items() for _ in range(count)]
        if self.order == RANDOM:
            order = np.random.default_rng([self.seed, 0]).permutation(len(labels))
            labels = [labels[i] for i in order]
        return [ExampleRequest(label) for label in labels]


def read(path: Path, labels: Sequence[str]) -> CuePlan:
    """Return the plan in a TOML file, for `--cues`.

    Args:
        path: The file.
        labels: The labels that there are.

    Raises:
        UserError: The file cannot be read, is no TOML, or makes no plan.
    """
    table = {"name": path.stem, **read_toml(path)}
    try:
        return parse(table, labels)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error} (docs/recording.md)") from None


def parse(table: dict[str, Any], labels: Sequence[str]) -> CuePlan:
    """Return the plan in a TOML table.

    Raises:
        RecordingError: It makes none; the message says what was found and what is expected.
    """
    known = ("name", "labels", "repetitions", *_TIMES, "order", "seed")
    name, order, seed = table.get("name", ""), table.get("order", RANDOM), table.get("seed", 1)
    times = {key: value for key, value in table.items() if key in _TIMES}
    for key in table:
        _check(key in known, f"{key!r} is unknown; a plan has {', '.join(known)}")
    _check(isinstance(name, str) and name.isprintable() and 0 < len(name) <= _MAX_NAME,
           f"name is {name!r}, not a short text")  # fmt: skip
    _check(order in (RANDOM, BLOCKS), f"order is {order!r}, neither {RANDOM!r} nor {BLOCKS!r}")
    _check(type(seed) is int and 0 <= seed < _SEEDS,
           f"seed is {seed!r}, not a whole number from 0 to {_SEEDS - 1}")  # fmt: skip
    for key, value in times.items():
        least, most = _TIMES[key]
        _check(type(value) in (int, float) and least <= value <= most,
               f"{key} is {value!r}, not a number of seconds, {least:g} to {most:g}")  # fmt: skip
    return CuePlan(
        name,
        _repetitions(table, labels),
        CueTiming(**{key: float(value) for key, value in times.items()}),
        order,
        seed,
    )


def _repetitions(table: dict[str, Any], labels: Sequence[str]) -> dict[str, int]:
    """Return how many examples of each label are wanted."""
    wanted, counts = table.get("labels"), table.get("repetitions", 10)
    if not isinstance(wanted, list) or not wanted:
        raise RecordingError(f'labels must be a list such as ["{labels[-1]}"]')
    for label in wanted:
        problem = "there twice" if label in labels else "unknown"
        _check(label in labels and wanted.count(label) == 1,
               f"the label {label!r} is {problem}; known are {', '.join(labels)}")  # fmt: skip
    if not isinstance(counts, dict):
        counts = dict.fromkeys(wanted, counts)
    for label in sorted(set(counts) ^ set(wanted)):
        _check(False, f"repetitions and labels differ in {label!r}; name it in both")
    for label, count in counts.items():
        _check(type(count) is int and count >= 1,
               f"repetitions of {label} are {count!r}, not a whole number from 1")  # fmt: skip
    total = sum(counts.values())
    _check(total <= MAX_EXAMPLES, f"{total} examples are more than {MAX_EXAMPLES}; split the plan")
    return {label: counts[label] for label in wanted}


def _check(holds: bool, problem: str) -> None:
    if not holds:
        raise RecordingError(problem)
