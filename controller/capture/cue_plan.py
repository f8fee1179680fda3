"""A plan of what shall be recorded, read from TOML: which labels, how often, at which pace.

    name = "five gestures"                  # kept in the recording
    labels = ["press", "pinch", "twist_cw"] # of the bundle; "null" asks for no touch
    repetitions = 10                        # or a table: repetitions = { press = 20, pinch = 10 }
    get_ready_s = 1.0                       # what comes is shown
    go_s = 2.0                              # it is done
    rest_s = 1.5                            # hands off, and up to
    jitter_s = 0.5                          # so much longer, so that nobody learns the rhythm
    order = "random"                        # or "blocks": label after label
    seed = 1                                # of the order and the rests

Only `labels` must be there.
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
        label: What shall be done.
        place: Where, (x, y) in grid units; None: wherever it is always done.
    """

    label: str
    place: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class CueTiming:
    """How long the phases of one example take, seconds; a rest takes up to `jitter_s` longer.

    Go is over before its time when something was felt, and then nothing for `still_s`; 0: never.
    """

    get_ready_s: float = 1.0
    go_s: float = 2.0
    rest_s: float = 1.5
    jitter_s: float = 0.5
    still_s: float = 0.0


@dataclass(frozen=True, slots=True)
class CuePlan:
    """What shall be recorded.

    Attributes:
        name: Of the plan, kept in the recording as its protocol.
        repetitions: How many examples of each label, in the order of the file.
        pace: How long each takes.
        order: "random" or "blocks".
        seed: Of the order and the rests.
    """

    name: str
    repetitions: dict[str, int]
    pace: CueTiming = CueTiming()
    order: str = RANDOM
    seed: int = 1

    def asks(self) -> list[ExampleRequest]:
        """Return all examples in the order in which they are asked for."""
        asks = [
            ExampleRequest(label) for label, count in self.repetitions.items() for _ in range(count)
        ]
        if self.order == BLOCKS:
            return asks
        return [asks[i] for i in np.random.default_rng([self.seed, 0]).permutation(len(asks))]


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
    """Return the plan that a TOML table makes.

    Raises:
        RecordingError: It makes none; the message says what is wrong and what belongs there.
    """
    known = ("name", "labels", "repetitions", *_TIMES, "order", "seed")
    for key in table:
        if key not in known:
            raise RecordingError(f"{key!r} is unknown; a plan has {', '.join(known)}")
    name, order, seed = table.get("name", ""), table.get("order", RANDOM), table.get("seed", 1)
    if not (isinstance(name, str) and name.isprintable() and 0 < len(name) <= _MAX_NAME):
        raise RecordingError(f"name is {name!r}, not a short text")
    if order not in (RANDOM, BLOCKS):
        raise RecordingError(f"order is {order!r}, neither {RANDOM!r} nor {BLOCKS!r}")
    if type(seed) is not int or not 0 <= seed < _SEEDS:
        raise RecordingError(f"seed is {seed!r}, not a whole number from 0 to {_SEEDS - 1}")
    times = {key: _seconds(key, table[key]) for key in _TIMES if key in table}
    return CuePlan(name, _repetitions(table, labels), CueTiming(**times), order, seed)


def _seconds(key: str, value: Any) -> float:
    least, most = _TIMES[key]
    if type(value) not in (int, float) or not least <= value <= most:
        raise RecordingError(f"{key} is {value!r}, not a number of seconds, {least:g} to {most:g}")
    return float(value)


def _repetitions(table: dict[str, Any], labels: Sequence[str]) -> dict[str, int]:
    """Return how many examples of each label are wanted."""
    wanted, counts = table.get("labels"), table.get("repetitions", 10)
    if not isinstance(wanted, list) or not wanted:
        raise RecordingError(f'labels must be a list such as ["{labels[-1]}"]')
    for label in wanted:
        if label not in labels or wanted.count(label) > 1:
            problem = "there twice" if label in labels else "unknown"
            raise RecordingError(f"the label {label!r} is {problem}; known are {', '.join(labels)}")
    if not isinstance(counts, dict):
        counts = dict.fromkeys(wanted, counts)
    if set(counts) != set(wanted):
        (odd, *_) = sorted(set(counts) ^ set(wanted))
        raise RecordingError(f"repetitions and labels differ in {odd!r}; name it in both")
    for label, count in counts.items():
        if type(count) is not int or count < 1:
            raise RecordingError(f"repetitions of {label} are {count!r}, not a whole number from 1")
    if sum(counts.values()) > MAX_EXAMPLES:
        raise RecordingError(
            f"{sum(counts.values())} examples are more than {MAX_EXAMPLES}; split the plan"
        )
    return {label: counts[label] for label in wanted}
