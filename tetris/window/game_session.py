"""One game being played: its recording, figures and bot, and how it is kept. No pixels."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Final

from tetris.bots import greedy
from tetris.bots.greedy import Planner
from tetris.engine.events import (
    Action,
    Event,
    Finish,
    Input,
    Locked,
    Restarted,
    Spawned,
    ToppedOut,
    Undone,
)
from tetris.engine.game import Game, Phase
from tetris.engine.modes import Mode, Pace, pace_of
from tetris.engine.pieces import Piece
from tetris.history.high_scores import Entry, HighScores
from tetris.history.replay import Player, Recorder
from tetris.history.replay_file import SUFFIX, ReplayError, save
from tetris.kit.settings import Settings

COMMANDS: Final = frozenset(Action) - {Action.PAUSE, Action.RESTART, Action.UNDO}
_FOLDER: Final = "replays"
_MOST: Final = 1000  # replays kept; a few kilobytes each
_LEAST_PIECES: Final = 10  # of a game that was left, for its replay to be kept
_REST_S: Final = 4.0  # how long a bot's lost game stays on the screen


class Session:
    """A game of a mode.

    Attributes:
        commands: Number of `COMMANDS` that the player gave.
        pace: Sets the gravity of a mode that is paced; else None.
    """

    def __init__(self, mode: Mode, recorder: Recorder) -> None:
        """Play on with a recorder; its time begins with the first update, if it has not begun."""
        self.mode, self.recorder = mode, recorder
        self.ranked = not recorder.begun  # whether it counts for the best list
        self.commands = 0
        self._clears: list[str] = []  # name of the clear of each lock; "" for a plain lock
        self.pace = Pace() if mode.paced else None
        self._fresh = True  # whether a piece has entered since the last update
        if recorder.begun:
            if self.game.row_us and self.pace:
                self.pace = Pace(pace_of(self.game.row_us), self.game.lines)
            past = Player(recorder.replay())
            given = [each for moment in past.replay.moments for each in moment.inputs]
            # Repeats of a held key are counted, too: a recording does not tell them apart.
            commands = sum(each in COMMANDS for each in given)
            self._count(past.first_events + past.advance(past.end_s), commands)

    @classmethod
    def new(
        cls, mode: Mode, seed: int, settings: Settings, *, level: int | None = None
    ) -> "Session":
        """Return a new game; without a level, with that of the settings."""
        config = mode.config(level or settings.level, seed)
        guard_s = max(config.guard_s, settings.guard_ms / 1000)
        config = replace(config, soft_drop_factor=settings.soft_drop, guard_s=guard_s)
        return cls(mode, Recorder(seed, config, mode.name))

    @property
    def game(self) -> Game:
        """The game."""
        return self.recorder.game

    @property
    def commands_per_piece(self) -> float:
        """Commands for each piece; 0 before the first."""
        return self.commands / len(self._clears) if self._clears else 0.0

    @property
    def grand_clears(self) -> int:
        """Number of tetrises and T-spins."""
        return sum(name == "tetris" or "t-spin" in name for name in self._clears)

    def update(
        self,
        time_s: float,
        actions: Sequence[Action] = (),
        *,
        commands: int = 0,
        soft_drop: bool = False,
        initial: Collection[Action] = (),
    ) -> list[Event]:
        """Let time pass, then act, and return what happened, as `Game.update` does.

        Of the actions so many are commands of the player; repeats of a held key are none.
        """
        inputs: list[Input] = list(actions)
        if self.pace:
            inputs += self._paced(self.pace, time_s, actions, commands)
        events = self.recorder.update(time_s, inputs, soft_drop=soft_drop, initial=tuple(initial))
        self._count(events, commands)
        self._fresh = any(isinstance(event, Spawned) for event in events)
        if self.pace and any(isinstance(event, Restarted) for event in events):
            self.pace = Pace()
        return events

    def _count(self, events: Sequence[Event], commands: int) -> None:
        for event in events:
            match event:
                case Locked(clear=clear):
                    self._clears.append(clear.name)
                case Undone() if self._clears:
                    self._clears.pop()
                case Restarted():
                    self._clears.clear()
                    self.commands = 0
        self.commands += commands

    def _paced(
        self, pace: Pace, time_s: float, actions: Sequence[Action], commands: int
    ) -> list[Input]:
        """Measure the player; return the gravity for a piece that has just entered."""
        if self.game.phase is not Phase.RUNNING or Action.PAUSE in actions:
            pace.interrupt()
            return []
        for _ in range(commands):
            pace.command(time_s, self.game.lines)
        gravity = pace.gravity(self.game.lines)
        return [gravity] if self._fresh and gravity.row_us != self.game.row_us else []


class BotPlayer:
    """Plays a game one action at a time, looking at the board before each."""

    def __init__(self, action_s: float, plan: Planner = greedy.plan) -> None:
        """Act every `action_s` seconds, as a bot plans."""
        self._action_s = action_s
        self._plan = plan
        self._next_s = 0.0
        self._target: Piece | None = None

    def actions(self, game: Game, time_s: float) -> list[Action]:
        """Return what to do now: one action or none."""
        if time_s < self._next_s or game.phase is Phase.PAUSED:
            return []
        if game.phase is Phase.OVER:
            self._next_s = time_s + self._action_s
            return [Action.RESTART]
        if not game.in_play:
            return []
        plan = self._plan(game, target=self._target)
        self._target = plan.landing
        self._next_s = time_s + self._action_s
        return [plan.actions[0]]

    def watch(self, events: list[Event]) -> None:
        """Forget the target when a new piece has come."""
        if any(isinstance(event, Spawned) for event in events):
            self._target = None
        if any(isinstance(event, ToppedOut) for event in events):
            self._next_s += _REST_S


# -- how it is kept ----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SavedGame:
    """Result of saving a game: its place in the best list, from 1, and a sentence of trouble."""

    place: int | None = None
    notice: str = ""


class Saves:
    """The player's games; `records` are the best lists."""

    def __init__(self, folder: Path | None) -> None:
        """Keep them in a folder; None keeps nothing."""
        self._folder, self.records = folder, HighScores(folder)

    def keep(self, session: Session) -> SavedGame:
        """Put a game on the store that is over; or one that was left, as far as it went.

        A game that was left has no place, unless it is of a mode that has no end of its own.
        """
        game, mode = session.game, session.mode
        if self._folder is None:
            return SavedGame()
        over = game.phase is Phase.OVER
        if not over and game.pieces_placed < _LEAST_PIECES:
            return SavedGame()
        path = _free(self._folder / _FOLDER, mode.name, SUFFIX)
        notice = ""
        try:
            save(path, session.recorder.replay())
            for old in self.replays()[_MOST:]:
                old.unlink(missing_ok=True)
        except OSError as error:
            notice = f"cannot save the replay: {error.strerror or error}"
        except ReplayError as error:
            notice = str(error)
        if not session.ranked or not (over or not game.config.gravity):
            return SavedGame(notice=notice)
        date, pace_hz = f"{datetime.now():%Y-%m-%d %H:%M}", pace_of(game.row_us)
        entry = Entry(game.score, game.lines, game.pieces_placed, game.time_s, date, pace_hz)
        won, level = isinstance(game.result, Finish), game.config.start_level
        place = self.records.add(mode, entry, won=won, level=level)
        return SavedGame(place, notice or self.records.trouble)

    def replays(self) -> list[Path]:
        """Return the replays' files, the newest first."""
        if self._folder is None:
            return []
        return sorted((self._folder / _FOLDER).glob(f"*{SUFFIX}"), reverse=True)


def _free(folder: Path, mode: str, suffix: str) -> Path:
    """Return a file's name with date and mode, which no other file has."""
    now = f"{datetime.now():%Y-%m-%d_%H-%M-%S}"
    number, path = 1, folder / f"{now}_{mode}{suffix}"
    while path.exists():
        number += 1
        path = folder / f"{now}-{number}_{mode}{suffix}"
    return path
