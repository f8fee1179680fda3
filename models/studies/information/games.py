"""Played games as a channel: what the hand meant, what was understood, and how long it took.

A game is what `host --demo --json` prints: its "events" are what the hand meant, its "commands"
what was understood. One gesture is one use of the channel, and what comes out of it is the first
command that answers it (controller/recognition/event_metric.py), or nothing. A further command for
the same gesture, or one for none, is counted beside it.
"""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.config import ConfigError, parse_json
from controller.errors import UserError
from controller.recognition.event_metric import Answer, Event
from models import user_files
from models.evaluation.bootstrap import LEVEL
from models.evaluation.event_counts import attach
from models.results.figure import Figure
from models.studies.information import channel

NOTHING: Final = "nothing"
DRAWS: Final = 200


class GameError(UserError, ValueError):
    """A file holds no game; the message is one sentence."""


@dataclass(frozen=True, slots=True, eq=False)
class Played:
    """Some games by one player.

    Attributes:
        commands: What was meant, in alphabetical order.
        counts: How often what was meant (rows) came out as what (columns; the last: nothing).
        meant: Number of what was meant by each gesture, (gestures,).
        heard: Number of what came out, (gestures,).
        hand_s: From the first touch of a gesture to the last, mean of each command.
        pause_s: From there to the next touch, median.
        late_s: From touch to command, median.
        minutes: Played.
        alarms: Commands that nobody meant.
        again: Commands that came out twice.
    """

    commands: tuple[str, ...]
    counts: NDArray[np.int64]
    meant: NDArray[np.int64]
    heard: NDArray[np.int64]
    hand_s: NDArray[np.float64]
    pause_s: float
    late_s: float
    minutes: float
    alarms: int
    again: int

    @property
    def seconds(self) -> NDArray[np.float64]:
        """How long a use of each command takes, (commands,)."""
        return self.hand_s + self.pause_s


def read(path: Path) -> dict[str, Any]:
    """Return the game in a file: its last line that is JSON.

    Raises:
        UserError: It cannot be read, or holds none that says what was meant.
    """
    for line in reversed(user_files.read_text(path).splitlines()):
        with suppress(ConfigError):
            if _is_game(game := parse_json(line, user_files.MAX_BYTES)):
                return dict(game)
    raise GameError(
        f"{path} holds no game; make one with: host --demo --headless --speed 0 --json > FILE"
    )


def _is_game(value: Any) -> bool:
    """Whether this is what a demo prints: what was meant, what was understood, and how long."""

    def rows(key: str, *kinds: tuple[type, ...]) -> bool:
        listed = value.get(key)
        return isinstance(listed, list) and all(
            isinstance(row, list) and len(row) == len(kinds) and all(map(isinstance, row, kinds))
            for row in listed
        )

    number = (int, float)
    return (
        isinstance(value, dict)
        and isinstance(value.get("seconds"), number)
        and rows("events", number, number, (str,))
        and rows("commands", number, (str,))
    )


def gather(games: Iterable[Mapping[str, Any]]) -> Played:
    """Return what some games have in common.

    Raises:
        GameError: Nothing was meant in them.
    """
    meant: list[str] = []
    heard: list[str] = []
    hand: list[float] = []
    pause: list[float] = []
    late: list[float] = []
    minutes, alarms, again = 0.0, 0, 0
    for game in games:
        events = [Event(on / 1000, off / 1000, name) for on, off, name in game["events"]]
        answers = [Answer(ms / 1000, name) for ms, name in game["commands"]]
        first: dict[int, Answer] = {}
        for answer, owner in zip(answers, attach(events, answers), strict=True):
            if owner < 0:
                alarms += 1
            elif owner in first:
                again += 1
            else:
                first[owner] = answer
                late.append(answer.time_s - events[owner].onset_s)
        meant += [event.kind for event in events]
        heard += [first[i].kind if i in first else NOTHING for i in range(len(events))]
        hand += [event.release_s - event.onset_s for event in events]
        pause += [after.onset_s - before.release_s for before, after in itertools.pairwise(events)]
        minutes += game["seconds"] / 60.0
    if not meant:
        raise GameError("nothing was meant in these games; play longer")
    commands = tuple(sorted({*meant, *heard} - {NOTHING}))
    of_meant = np.array([commands.index(name) for name in meant])
    of_heard = np.array([[*commands, NOTHING].index(name) for name in heard])
    count = np.zeros((len(commands), len(commands) + 1), dtype=np.int64)
    np.add.at(count, (of_meant, of_heard), 1)
    lasts = np.array(hand)
    mean_s = [
        lasts[of_meant == i].mean() if (of_meant == i).any() else lasts.mean()
        for i in range(len(commands))
    ]
    return Played(
        commands, count, of_meant, of_heard, np.array(mean_s),
        float(np.median(pause)) if pause else 0.0, float(np.median(late)) if late else np.nan,
        minutes, alarms, again,
    )  # fmt: skip


def figures(played: Played, seed: int = 0) -> dict[str, Any]:
    """Return what a player's channel is worth: plain data, nats and seconds.

    Returns:
        `played`: information of a gesture as commands were used, [value, low, high] by resampling
        gestures; `capacity`: with the best use; `played_per_min`, `fastest_per_min`; `share`: how
        often each command is sent in the fastest use; and what was counted.
    """
    used = played.counts.sum(axis=1) > 0
    given, lasts = channel.rows(played.counts), played.seconds[used]
    share = played.counts.sum(axis=1)[used] / played.counts.sum()
    now = channel.counted(played.counts)
    drawn = _drawn(played, seed)
    edge = (1.0 - LEVEL) / 2.0
    low, high = np.quantile(drawn, [edge, 1.0 - edge])
    best, fastest = channel.best_use(given), channel.fastest_use(given, lasts)
    mean_s = float(share @ lasts)
    names = [name for name, sent in zip(played.commands, used, strict=True) if sent]
    return {
        "commands": names,
        "outputs": [*played.commands, NOTHING],
        "counts": played.counts[used].tolist(),
        "gestures": int(played.counts.sum()),
        "minutes": round(played.minutes, 3),
        "right": float(sum(played.counts[i, i] for i in range(len(played.commands)))
                       / played.counts.sum()),
        "alarms": played.alarms,
        "again": played.again,
        "late_s": played.late_s,
        "seconds": [round(float(one), 4) for one in lasts],
        "mean_s": mean_s,
        "played": [now, float(low), float(high)],
        "played_per_min": 60.0 * now / mean_s,
        "capacity": best.nats,
        "fastest": fastest.nats,
        "fastest_s": fastest.seconds,
        "fastest_per_min": fastest.nats_per_min,
        "share": [round(float(one), 4) for one in share],
        "best_share": [round(float(one), 4) for one in fastest.share],
    }  # fmt: skip


def interval(figure: Sequence[float]) -> Figure:
    """Return [value, low, high] as a figure."""
    return Figure(*figure)


def _drawn(played: Played, seed: int) -> NDArray[np.float64]:
    """Return the information of a gesture with gestures drawn anew, (draws,)."""
    rng = np.random.default_rng(seed)
    shape, found = played.counts.shape, []
    for _ in range(DRAWS):
        pick = rng.integers(0, len(played.meant), len(played.meant))
        count = np.zeros(shape)
        np.add.at(count, (played.meant[pick], played.heard[pick]), 1)
        found.append(channel.counted(count))
    return np.array(found)
