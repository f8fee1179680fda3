"""One game being played: its recording, its figures, and the pace of a slow hand. No pixels."""

from collections.abc import Collection, Sequence
from dataclasses import replace

from tetris.engine.events import Action, Event, GravityCap, Input, Spawned
from tetris.engine.game import Game, Phase
from tetris.engine.modes import Mode, Pace
from tetris.history.replay import Player, Recorder, Replay
from tetris.history.stats import COMMANDS, Statistics, Summary
from tetris.window.settings import Settings


class Session:
    """A game of a mode.

    Attributes:
        mode: How it is played.
        recorder: Its recording, in which the game is.
        ranked: Whether it counts for the best list; a game that was taken over does not.
    """

    def __init__(
        self, mode: Mode, seed: int, settings: Settings, *, level: int | None = None
    ) -> None:
        """Set up a game; its time begins with the first update.

        Args:
            mode: How it is played.
            seed: Which game.
            settings: How the player handles it.
            level: The start level; that of the settings if there is none.
        """
        config = mode.config(level or settings.level, seed)
        config = replace(
            config,
            soft_drop_factor=settings.soft_drop,
            guard_s=max(config.guard_s, settings.guard_ms / 1000),
        )
        self._begin(mode, Recorder(seed, config, mode.name))

    @classmethod
    def going_on(cls, mode: Mode, recorder: Recorder) -> "Session":
        """Return a game that plays on from where a replay was left."""
        session = cls.__new__(cls)
        session._begin(mode, recorder)
        session.ranked = False
        past = Player(recorder.replay())
        session._statistics.update(past.first_events)
        session._statistics.update(past.advance(past.end_s), _commands(past.replay))
        return session

    def _begin(self, mode: Mode, recorder: Recorder) -> None:
        self.mode, self.recorder = mode, recorder
        self.ranked = True
        self._statistics = Statistics(recorder.game.config)
        self._pace = Pace() if mode.paced else None
        self._fresh = False  # whether a piece has entered since the last update

    @property
    def game(self) -> Game:
        """The game."""
        return self.recorder.game

    @property
    def summary(self) -> Summary:
        """The player's figures so far."""
        return self._statistics.summary(self.game)

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

        Args:
            time_s: The present time.
            actions: What the player does.
            commands: How many of them the player gave; repeats of a held key are none.
            soft_drop: Whether soft drop is held.
            initial: Which turns, and whether the hold, are held.
        """
        inputs: list[Input] = list(actions)
        if self._pace:
            inputs += self._paced(self._pace, time_s, actions)
        events = self.recorder.update(time_s, inputs, soft_drop=soft_drop, initial=tuple(initial))
        self._statistics.update(events, commands)
        self._fresh = any(isinstance(event, Spawned) for event in events)
        return events

    def _paced(self, pace: Pace, time_s: float, actions: Sequence[Action]) -> list[Input]:
        """Measure the player; return the cap of gravity for a piece that has just entered."""
        if self.game.phase is not Phase.RUNNING or Action.PAUSE in actions:
            pace.interrupt()
            return []
        for action in actions:
            if action in COMMANDS:
                pace.command(time_s)
        changed = self._fresh and pace.level != self.game.gravity_cap
        return [GravityCap(pace.level)] if changed else []


def _commands(replay: Replay) -> int:
    """Count a recording's commands; repeats of a held key are counted, too."""
    return sum(given in COMMANDS for moment in replay.moments for given in moment.inputs)
