"""Plans of cues: `--cues` reads one from TOML; docs/recording.md lists its keys."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.recordings.recording import RecordingError
from controller.shared.config import ConfigError, read_toml, settings
from controller.shared.cues import CueSession, CueTiming, ExampleRequest

RANDOM: Final = "random"
BLOCKS: Final = "blocks"
MAX_EXAMPLES: Final = 10_000  # about ten hours


@dataclass(frozen=True, slots=True)
class CuePlan:
    """The examples to record."""

    name: str  # stored in the recording as its protocol
    repetitions: dict[str, int]  # number of examples of each label, in the order of the file
    pace: CueTiming = field(default_factory=CueTiming)  # durations of one example
    order: str = RANDOM  # or "blocks", label after label
    seed: int = 1  # of the order and the rests

    def asks(self) -> list[ExampleRequest]:
        """Return all examples in order."""
        labels = [label for label, count in self.repetitions.items() for _ in range(count)]
        if self.order == RANDOM:
            order = np.random.default_rng([self.seed, 0]).permutation(len(labels))
            labels = [labels[i] for i in order]
        return [ExampleRequest(label) for label in labels]

    def session(self) -> CueSession:
        """Return the session of this plan."""
        rng = np.random.default_rng([self.seed, 1])
        return CueSession(self.asks(), self.pace, rng, shuffled=self.order != BLOCKS)


@dataclass(frozen=True, kw_only=True)
class _PlanTable(CueTiming):
    """Keys of a plan's file, besides the durations."""

    name: str = field(
        metadata={"pattern": r"[^\x00-\x1f\x7f-\x9f]{1,100}", "expected": "a short text"}
    )
    labels: tuple[str, ...] = field(metadata={"count": (1, 1000)})
    repetitions: int | dict[str, int] = 10
    order: str = field(default=RANDOM, metadata={"choices": (RANDOM, BLOCKS)})
    seed: int = field(default=1, metadata={"range": (0, 2**32 - 1)})


def read_plan(path: Path, labels: Sequence[str]) -> CuePlan:
    """Return the plan in a TOML file, for a bundle's labels; UserError if it makes no plan."""
    table = {"name": path.stem, **read_toml(path)}
    try:
        return parse_plan(table, labels)
    except (RecordingError, ConfigError) as error:
        raise RecordingError(f"{path}: {error} (docs/recording.md)") from None


def parse_plan(table: dict[str, Any], labels: Sequence[str]) -> CuePlan:
    """Return the plan in a TOML table; RecordingError, ConfigError if the table is no plan."""
    told = settings(_PlanTable, table)
    for label in told.labels:
        if label not in labels:
            raise RecordingError(f"the label {label!r} is unknown; known are {', '.join(labels)}")
    counts = told.repetitions
    if not isinstance(counts, dict):
        counts = dict.fromkeys(told.labels, counts)
    whole = all(type(count) is int and count >= 1 for count in counts.values())
    if set(counts) != set(told.labels) or not whole:
        raise RecordingError(
            f"repetitions are {told.repetitions!r}, not a number from 1, or one for each label"
        )
    total = sum(counts.values())
    if total > MAX_EXAMPLES:
        raise RecordingError(f"{total} examples are more than {MAX_EXAMPLES}; split the plan")
    pace = CueTiming(*(getattr(told, each.name) for each in fields(CueTiming)))
    repetitions = {label: counts[label] for label in told.labels}
    return CuePlan(told.name, repetitions, pace, told.order, told.seed)
