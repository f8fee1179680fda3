"""Capacity of a noisy channel, and played games as such a channel.

Source: C. Shannon, A mathematical theory of communication, 1948; R. Blahut, Computation of channel
capacity and rate-distortion functions, and S. Arimoto, An algorithm for computing the capacity of
arbitrary discrete memoryless channels, both IEEE Transactions on Information Theory 18, 1972.
Each use is taken to be independent of those before it.

A game is what `host --demo --json` prints: its "events" are the intended gestures, its "commands"
the recognised ones. One gesture is one use of the channel, and its output is the first command that
answers it (controller/shared/event_metric.py), or nothing. A further command for the same
gesture is ignored, one for none is a false alarm.
"""

import itertools
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import rel_entr  # the [train] extra

from controller.shared.config import ConfigError, parse_json
from controller.shared.errors import UserError
from controller.shared.event_metric import Answer, Event, attach
from models.evaluation import bootstrap
from models.results import storage
from models.studies.paper.section6 import mutual_information

TOLERANCE: Final = 1e-9  # nats between the bounds of the capacity
ROUNDS: Final = 20_000
NOTHING: Final = "nothing"
DRAWS: Final = 200
HOW_TO_PLAY: Final = "host --demo --headless --json > FILE"
_LEAST: Final = 1e-300

Shares = NDArray[np.float64]  # (inputs,): how often each input is sent; sums to 1
Transitions = NDArray[np.float64]  # (inputs, outputs): probability of each output given the input
Numbers = NDArray[np.int64]  # (gestures,): index of a command, or of `NOTHING` behind the last


def information(share: ArrayLike, given: Transitions) -> float:
    """Return I(input; output), nats, for shares (inputs,) and transitions (inputs, outputs)."""
    p = np.asarray(share, dtype=np.float64)
    return float(p @ _divergence(given, p @ given))


def counted(counts: ArrayLike) -> float:
    """Return I(input; output) of counted uses (inputs, outputs), nats, its bias removed."""
    table = np.asarray(counts, dtype=np.float64)
    total = float(table.sum())
    return max(0.0, float(mutual_information(table[None] / total, total).information[0]))


def best_use(given: Transitions) -> tuple[float, Shares]:
    """Return the greatest information of a use, nats, and the shares of its inputs, (inputs,).

    Transitions are (inputs, outputs).
    """
    share = np.full(len(given), 1.0 / len(given))
    for _ in range(ROUNDS):
        worth = _divergence(given, share @ given)
        if worth.max() - share @ worth < TOLERANCE:
            break
        share = share * np.exp(worth - worth.max())
        share /= share.sum()
    return information(share, given), share


def _divergence(given: Transitions, output: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the relative entropy of each input's outputs to the outputs (outputs,), (inputs,)."""
    return np.asarray(rel_entr(given, np.maximum(output, _LEAST)).sum(axis=1))


class GameError(UserError, ValueError):
    """A file holds no game; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Session:
    """One session of play: intended gestures and recognised commands in order, and its length."""

    events: Sequence[Event]
    answers: Sequence[Answer]
    minutes: float


@dataclass(frozen=True, slots=True, eq=False)
class Played:
    """Some sessions of one player, pooled."""

    commands: tuple[str, ...]  # names of the commands, the inputs of the channel
    meant: Numbers  # command intended by each gesture, (gestures,)
    output: Numbers  # output of each gesture, (gestures,)
    # duration of a use of each command, the mean gesture and a pause, (commands,)
    seconds: NDArray[np.float64]
    late_s: float  # from touch to command, median
    minutes: float  # length
    alarms: int  # commands that answer no gesture

    def counts(self, pick: Numbers | slice = slice(None)) -> NDArray[np.int64]:
        """Return the counts of picked gestures (n,) by intention (rows) and output (columns)."""
        counts = np.zeros((len(self.commands), len(self.commands) + 1), dtype=np.int64)
        np.add.at(counts, (self.meant[pick], self.output[pick]), 1)
        return counts


def read(path: Path) -> Session:
    """Return the game in a file's last line that is JSON; raise UserError if there is none."""
    for line in reversed(storage.read_text(path).splitlines()):
        with suppress(ConfigError, TypeError, KeyError, ValueError, AttributeError):
            return session(parse_json(line, storage.MAX_BYTES))
    raise GameError(f"{path} holds no game; make one with: {HOW_TO_PLAY}")


def session(value: Any) -> Session:
    """Return a game, plain data with times in milliseconds, as a session; ValueError: it is none.

    Its entries are `events`, [[begin, end, intended command], ...], `commands`, [[time, recognised
    command], ...], and `seconds`.
    """
    events, commands = value["events"], value["commands"]
    if not all(isinstance(row[-1], str) for row in (*events, *commands)):
        raise ValueError("a command of the game has no name")
    return Session(
        [Event(float(on) / 1000, float(off) / 1000, name) for on, off, name in events],
        [Answer(float(ms) / 1000, name) for ms, name in commands],
        float(value["seconds"]) / 60.0,
    )


def gather(sessions: Iterable[Session]) -> Played:
    """Return the sessions of one player pooled; raise GameError if they have no gesture.

    Commands are those that occur, in alphabetical order. The pause from one gesture's last touch to
    the next is the median of the sessions.
    """
    meant: list[str] = []
    outputs: list[str] = []
    hand, pause, late = [], [], []
    minutes, alarms = 0.0, 0
    for one in sessions:
        first: dict[int, Answer] = {}
        for answer, owner in zip(one.answers, attach(one.events, one.answers), strict=True):
            alarms += owner < 0
            if owner >= 0:
                first.setdefault(owner, answer)
        late += [answer.time_s - one.events[owner].onset_s for owner, answer in first.items()]
        meant += [event.kind for event in one.events]
        outputs += [first[i].kind if i in first else NOTHING for i in range(len(one.events))]
        hand += [event.release_s - event.onset_s for event in one.events]
        pause += [b.onset_s - a.release_s for a, b in itertools.pairwise(one.events)]
        minutes += one.minutes
    if not meant:
        raise GameError("the games have no intended gesture; play longer")
    commands = sorted({*meant, *outputs} - {NOTHING})
    names = [*commands, NOTHING]
    of_meant, of_output = (
        np.array([names.index(one) for one in kinds]) for kinds in (meant, outputs)
    )
    lasts, mean_s = np.array(hand), []
    for number in range(len(commands)):
        own = of_meant == number
        mean_s.append(lasts[own if own.any() else slice(None)].mean())
    seconds = np.array(mean_s) + (float(np.median(pause)) if pause else 0.0)
    late_s = float(np.median(late)) if late else np.nan
    return Played(tuple(commands), of_meant, of_output, seconds, late_s, minutes, alarms)


def figures(played: Played) -> dict[str, Any]:
    """Return the figures of a player's channel: plain data, nats and seconds.

    `played` is the information of a gesture as commands were used, [value, low, high] by resampling
    gestures; `capacity` that with the best use.
    """
    counts, total = played.counts(), len(played.meant)
    used = counts.sum(axis=1) > 0
    lasts, uses = played.seconds[used], counts[used].sum(axis=1, keepdims=True)
    capacity, _ = best_use(counts[used] / uses)
    now, mean_s = counted(counts), float(uses[:, 0] @ lasts / total)
    rng = np.random.default_rng(0)
    drawn = [counted(played.counts(rng.integers(0, total, total))) for _ in range(DRAWS)]
    return {
        "commands": list(itertools.compress(played.commands, used)),
        "gestures": total,
        "minutes": round(played.minutes, 3),
        "right": float(np.trace(counts) / total),
        "alarms": played.alarms,
        "late_s": played.late_s,
        "mean_s": mean_s,
        "played": [now, *bootstrap.middle(np.array(drawn))],
        "played_per_min": 60.0 * now / mean_s,
        "capacity": capacity,
    }
