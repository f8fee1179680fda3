"""Played games as a channel: intended gestures, recognised commands, and their durations.

A game is what `host --demo --json` prints: its "events" are the intended gestures, its "commands"
the recognised ones. One gesture is one use of the channel, and its output is the first command that
answers it (controller/recognition/event_metric.py), or nothing. A further command for the same
gesture is ignored, one for none is a false alarm.
"""

import itertools
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.config import ConfigError, parse_json
from controller.errors import UserError
from controller.recognition.event_metric import Answer, Event, attach
from models.evaluation import bootstrap
from models.results import storage
from models.studies.information import channel

NOTHING: Final = "nothing"
DRAWS: Final = 200
HOW_TO_PLAY: Final = "host --demo --headless --speed 0 --json > FILE"

Numbers = NDArray[np.int64]  # (gestures,): index of a command, or of `NOTHING` behind the last


class GameError(UserError, ValueError):
    """A file holds no game; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Session:
    """One session of play.

    Attributes:
        events: Intended gestures, in order.
        answers: Recognised commands, in order.
        minutes: Length.
    """

    events: Sequence[Event]
    answers: Sequence[Answer]
    minutes: float


@dataclass(frozen=True, slots=True)
class _Game:
    """A game as a demo prints it; times in milliseconds."""

    seconds: float
    events: tuple[tuple[float, float, str], ...]  # begin, end, and intended command
    commands: tuple[tuple[float, str], ...]  # time, and recognised command


@dataclass(frozen=True, slots=True, eq=False)
class Played:
    """Some sessions of one player, pooled.

    Attributes:
        commands: Names of the commands, the inputs of the channel.
        meant: Command intended by each gesture, (gestures,).
        output: Output of each gesture, (gestures,).
        seconds: Duration of a use of each command, the mean gesture and a pause, (commands,).
        late_s: From touch to command, median.
        minutes: Length.
        alarms: Commands that answer no gesture.
    """

    commands: tuple[str, ...]
    meant: Numbers
    output: Numbers
    seconds: NDArray[np.float64]
    late_s: float
    minutes: float
    alarms: int

    def counts(self, pick: Numbers | slice = slice(None)) -> NDArray[np.int64]:
        """Return the counts of picked gestures (n,) by intention (rows) and output (columns)."""
        counts = np.zeros((len(self.commands), len(self.commands) + 1), dtype=np.int64)
        np.add.at(counts, (self.meant[pick], self.output[pick]), 1)
        return counts


def read(path: Path) -> Session:
    """Return the game in a file: its last line that is JSON.

    Raises:
        UserError: It cannot be read, or holds no game with its intended gestures.
    """
    for line in reversed(storage.read_text(path).splitlines()):
        with suppress(ConfigError, TypeError, KeyError, ValueError, AttributeError):
            return session(parse_json(line, storage.MAX_BYTES))
    raise GameError(f"{path} holds no game; make one with: {HOW_TO_PLAY}")


def session(value: Any) -> Session:
    """Return a game as a session.

    Raises:
        TypeError, KeyError, ValueError, AttributeError: The value is no game.
    """
    game = storage.from_plain(_Game, value)
    events = [Event(on / 1000, off / 1000, name) for on, off, name in game.events]
    answers = [Answer(ms / 1000, name) for ms, name in game.commands]
    return Session(events, answers, game.seconds / 60.0)


def gather(
    sessions: Iterable[Session],
    commands: Sequence[str] | None = None,
    pause_s: float | None = None,
) -> Played:
    """Return some sessions pooled.

    Args:
        sessions: Of one player.
        commands: Names of the commands; None: those that occur, in alphabetical order.
        pause_s: From one gesture's last touch to the next; None: the median of the sessions.

    Raises:
        GameError: They have no gesture.
    """
    meant: list[str] = []
    outputs: list[str] = []
    hand, pause, late = [], [], []
    minutes, alarms = 0.0, 0
    for one in sessions:
        first: dict[int, Answer] = {}
        for answer, owner in zip(one.answers, attach(one.events, one.answers), strict=True):
            if owner < 0:
                alarms += 1
            elif owner not in first:
                first[owner] = answer
                late.append(answer.time_s - one.events[owner].onset_s)
        meant += [event.kind for event in one.events]
        outputs += [first[i].kind if i in first else NOTHING for i in range(len(one.events))]
        hand += [event.release_s - event.onset_s for event in one.events]
        pause += [b.onset_s - a.release_s for a, b in itertools.pairwise(one.events)]
        minutes += one.minutes
    if not meant:
        raise GameError("the games have no intended gesture; play longer")
    names = [*(commands or sorted({*meant, *outputs} - {NOTHING})), NOTHING]
    of_meant, of_output = (
        np.array([names.index(one) for one in kinds]) for kinds in (meant, outputs)
    )
    lasts = np.array(hand)
    mean_s = [lasts[own if own.any() else slice(None)].mean()
              for own in (of_meant == i for i in range(len(names) - 1))]  # fmt: skip
    if pause_s is None:
        pause_s = float(np.median(pause)) if pause else 0.0
    late_s = float(np.median(late)) if late else np.nan
    return Played(
        tuple(names[:-1]), of_meant, of_output, np.array(mean_s) + pause_s,
        late_s, minutes, alarms,
    )  # fmt: skip


def figures(played: Played, seed: int = 0) -> dict[str, Any]:
    """Return the figures of a player's channel: plain data, nats and seconds.

    Returns:
        `played`: information of a gesture as commands were used, [value, low, high] by resampling
        gestures; `capacity`: with the best use; `played_per_min`, `fastest_per_min`; and the counts
        behind them, the last column for no answer.
    """
    counts = played.counts()
    used = counts.sum(axis=1) > 0
    given, lasts = channel.transitions(counts), played.seconds[used]
    share = counts.sum(axis=1)[used] / counts.sum()
    best, fastest = channel.best_use(given), channel.best_use(given, lasts)
    now, mean_s = channel.counted(counts), float(share @ lasts)
    return {
        "commands": list(itertools.compress(played.commands, used)),
        "counts": counts[used].tolist(),
        "gestures": len(played.meant),
        "minutes": round(played.minutes, 3),
        "right": float(np.trace(counts) / counts.sum()),
        "alarms": played.alarms,
        "late_s": played.late_s,
        "seconds": lasts.round(4).tolist(),
        "mean_s": mean_s,
        "played": [now, *_interval(played, seed)],
        "played_per_min": 60.0 * now / mean_s,
        "capacity": best.nats,
        "fastest": fastest.nats,
        "fastest_s": fastest.seconds,
        "fastest_per_min": fastest.nats_per_min,
    }


def _interval(played: Played, seed: int) -> tuple[float, float]:
    """Return the bounds of a gesture's information by resampling gestures, nats."""
    rng, n = np.random.default_rng(seed), len(played.meant)
    drawn = [channel.counted(played.counts(rng.integers(0, n, n))) for _ in range(DRAWS)]
    return bootstrap.middle(np.array(drawn))
