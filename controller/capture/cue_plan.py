"""Cue plan, read from TOML: labels to record, numbers of examples, and timing.

docs/recording.md lists the keys; only `labels` is required.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.config import ConfigError, read_toml, settings
from controller.recordings.recording import RecordingError

RANDOM: Final = "random"
BLOCKS: Final = "blocks"
MAX_EXAMPLES: Final = 10_000  # about ten hours


@dataclass(frozen=True, slots=True)
class ExampleRequest:
    """One example to record."""

    label: str  # its gesture
    # position of the touch, (x, y) in grid units; None: the usual one of the gesture
    place: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class CueTiming:
    """Durations of the phases of one example, seconds; a rest takes up to `jitter_s` longer.

    A gesture takes half a second, and users need half a second to begin. Go ends early after a
    touch that has been over for `still_s`; 0: never.
    """

    get_ready_s: float = field(default=1.0, metadata={"range": (0.0, 60.0)})
    go_s: float = field(default=2.0, metadata={"range": (0.5, 60.0)})
    rest_s: float = field(default=1.5, metadata={"range": (0.5, 60.0)})
    jitter_s: float = field(default=0.5, metadata={"range": (0.0, 60.0)})
    still_s: float = 0.0


_TIMES: Final = tuple(each.name for each in fields(CueTiming) if "range" in each.metadata)


@dataclass(frozen=True, slots=True)
class CuePlan:
    """The examples to record."""

    # stored in the recording as its protocol
    name: str = field(
        metadata={"pattern": r"[^\x00-\x1f\x7f-\x9f]{1,100}", "expected": "a short text"}
    )
    repetitions: dict[str, int]  # number of examples of each label, in the order of the file
    pace: CueTiming = CueTiming()  # durations of one example
    # "random" or "blocks", label after label
    order: str = field(default=RANDOM, metadata={"choices": (RANDOM, BLOCKS)})
    seed: int = field(default=1, metadata={"range": (0, 2**32 - 1)})  # of the order and the rests

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
        labels: All labels of the bundle.

    Raises:
        UserError: The file cannot be read, is no TOML, or makes no plan.
    """
    table = {"name": path.stem, **read_toml(path)}
    try:
        return parse(table, labels)
    except (RecordingError, ConfigError) as error:
        raise RecordingError(f"{path}: {error} (docs/recording.md)") from None


def parse(table: dict[str, Any], labels: Sequence[str]) -> CuePlan:
    """Return the plan in a TOML table.

    Raises:
        RecordingError, ConfigError: The table is no plan.
    """
    known = ("name", "labels", "repetitions", *_TIMES, "order", "seed")
    for key in table:
        _check(key in known, f"{key!r} is unknown; a plan has {', '.join(known)}")
    times = {key: value for key, value in table.items() if key in _TIMES}
    rest = {key: table[key] for key in ("name", "order", "seed") if key in table}
    plan = settings(CuePlan, {**rest, "repetitions": _repetitions(table, labels)})
    return replace(plan, pace=settings(CueTiming, times))


def _repetitions(table: dict[str, Any], labels: Sequence[str]) -> dict[str, int]:
    """Return the number of examples of each label."""
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
