"""Replays: seed, rules and timed inputs of a game, from which it can be played again.

A seed, a configuration and the timed inputs make a game, so nothing else is kept. Times are
whole microseconds, which the game is given too: what is played is what is recorded, and the
replay's events are the game's, bit for bit.
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

from tetris.bots.greedy import Planner
from tetris.engine.events import Action, Event, Input
from tetris.engine.game import Game, Phase, Snapshot
from tetris.engine.pieces import Piece
from tetris.engine.rules import Config

LAST_SEED: Final = 2**64 - 1
MODE: Final = re.compile(r"[a-z0-9_]{0,32}", re.ASCII)
HOLDABLE: Final = (Action.ROTATE_CW, Action.ROTATE_CCW, Action.HOLD)
_US: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class Moment:
    """One update with inputs, at a microsecond of the recording's clock."""

    time_us: int
    inputs: tuple[Input, ...] = ()  # in order
    soft_drop: bool = False  # held from then on
    initial: tuple[Action, ...] = ()  # held from then on, in the order of `HOLDABLE`


@dataclass(frozen=True, slots=True)
class Outcome:
    """End of a recording, by which a replay can be checked."""

    score: int
    lines: int
    pieces: int
    over: bool

    @classmethod
    def of(cls, game: Game) -> "Outcome":
        """Return how a game stands."""
        return cls(game.score, game.lines, game.pieces_placed, game.phase is Phase.OVER)


@dataclass(frozen=True, slots=True)
class Replay:
    """A whole game, or several one after another."""

    seed: int
    config: Config
    mode: str  # its name; "" for none
    moments: tuple[Moment, ...]  # oldest first; the first one begins the game
    end_us: int  # the time of the last update; not before the last moment
    outcome: Outcome  # how the game stood then

    @property
    def length_s(self) -> float:
        """Time from the first moment to the end, pauses included."""
        return (self.end_us - self.moments[0].time_us) / _US


class Recorder:
    """A game that is recorded while it is played: update it in place of the game."""

    def __init__(self, seed: int, config: Config | None = None, mode: str = "") -> None:
        """Begin a game; its time begins with the first update.

        Raises:
            ValueError: A replay cannot hold such a game: see `check_game`.
        """
        check_game(seed, mode)
        self.seed, self.game, self.mode = seed, Game(seed, config), mode
        self._moments: list[Moment] = []
        self._last_us = 0

    @property
    def time_s(self) -> float:
        """The time of the last update; the next one is not before it."""
        return self._last_us / _US

    def update(
        self,
        time_s: float,
        inputs: Sequence[Input] = (),
        *,
        soft_drop: bool = False,
        initial: Collection[Action] = (),
    ) -> list[Event]:
        """Update the game, as `Game.update` does, at the nearest microsecond.

        Raises:
            ValueError: Time went backwards, or is below 0 s.
        """
        time_us = round(time_s * _US)
        if time_us < 0:
            raise ValueError(f"a clock at {time_s} s must be at 0 s or later")
        held = tuple(action for action in HOLDABLE if action in initial)
        moment = Moment(time_us, tuple(inputs), soft_drop, held)
        events = _tell(self.game, moment)
        before = [(last.soft_drop, last.initial) for last in self._moments[-1:]]
        if moment.inputs or before != [(soft_drop, held)]:
            self._moments.append(moment)
        self._last_us = time_us
        return events

    def go_on(self, position: Snapshot, moments: Sequence[Moment], time_us: int) -> None:
        """Continue a recording that has come to a position."""
        self.game.restore(position)
        self._moments, self._last_us = list(moments), time_us

    @property
    def begun(self) -> bool:
        """Whether anything has been played."""
        return bool(self._moments)

    def replay(self) -> Replay:
        """Return what has been played so far.

        Raises:
            ValueError: There has been no update yet.
        """
        if not self._moments:
            raise ValueError("nothing has been played yet; update the game first")
        game, moments = self.game, tuple(self._moments)
        return Replay(self.seed, game.config, self.mode, moments, self._last_us, Outcome.of(game))


def check_game(seed: int, mode: str) -> None:
    """Raise ValueError for a seed or a mode's name that a replay cannot hold."""
    if not 0 <= seed <= LAST_SEED:
        raise ValueError(f"seed {seed} must be from 0 to {LAST_SEED}")
    if not MODE.fullmatch(mode):
        raise ValueError(f"mode {mode!r} must be up to 32 of a-z, 0-9 and _")


class Player:
    """Plays a replay, and goes to any time of the recording's clock, forwards and back."""

    def __init__(self, replay: Replay) -> None:
        self.replay = replay
        self.game = Game(replay.seed, replay.config)
        self.moments_played = 0
        self.time_us = self._start_us = replay.moments[0].time_us
        self.first_events = self._play(self.time_us)
        self._start, self._begun = self.game.snapshot(), self.moments_played

    @property
    def start_s(self) -> float:
        """When the replay begins."""
        return self._start_us / _US

    @property
    def end_s(self) -> float:
        """When it ends."""
        return self.replay.end_us / _US

    @property
    def time_s(self) -> float:
        """Present position, seconds."""
        return self.time_us / _US

    @property
    def at_end(self) -> bool:
        """Whether all of it has been played."""
        return self.time_us >= self.replay.end_us

    def advance(self, time_s: float) -> list[Event]:
        """Play on to a time, at most to the end, and return what happened, oldest first.

        A time that lies behind changes nothing.
        """
        return self._play(min(round(time_s * _US), self.replay.end_us))

    def seek(self, time_s: float) -> None:
        """Go to any time of the replay; outside of it, to its start or its end."""
        time_us = min(max(round(time_s * _US), self._start_us), self.replay.end_us)
        if time_us < self.time_us:
            self.game.restore(self._start)
            self.moments_played, self.time_us = self._begun, self._start_us
        self._play(time_us)

    def take_over(self) -> Recorder:
        """Return a recorder that plays on from here; what was played until here is in it.

        Its clock is the replay's. Nothing is held down any more unless its next update says so.
        """
        replay = self.replay
        recorder = Recorder(replay.seed, replay.config, replay.mode)
        recorder.go_on(self.game.snapshot(), replay.moments[: self.moments_played], self.time_us)
        return recorder

    @property
    def differs(self) -> bool:
        """Whether the end was reached, but not with the recorded outcome."""
        return self.at_end and Outcome.of(self.game) != self.replay.outcome

    def _play(self, until_us: int) -> list[Event]:
        events: list[Event] = []
        moments = self.replay.moments
        while self.moments_played < len(moments):
            moment = moments[self.moments_played]
            if moment.time_us > until_us:
                break
            events += _tell(self.game, moment)
            self.moments_played += 1
            self.time_us = moment.time_us
        if until_us > self.time_us:
            last = moments[self.moments_played - 1]
            quiet = Moment(until_us, (), last.soft_drop, last.initial)
            events += _tell(self.game, quiet)
            self.time_us = until_us
        return events


def _tell(game: Game, moment: Moment) -> list[Event]:
    time_s, soft_drop = moment.time_us / _US, moment.soft_drop
    return game.update(time_s, moment.inputs, soft_drop=soft_drop, initial=moment.initial)


def play_bot(
    recorder: Recorder, planner: Planner, *, pieces: int, action_s: float = 0.0
) -> list[Event]:
    """Let a bot play until the game is over or so many pieces are placed; return the events.

    It looks at the board after each action, which takes `action_s`; 0: as fast as the rules allow.
    """
    game, config = recorder.game, recorder.game.config
    wait_s = config.generation_delay_s + config.guard_s  # in which nothing or no drop is taken
    now_s = recorder.time_s
    events = recorder.update(now_s)
    target: Piece | None = None
    placed = game.pieces_placed
    while game.phase is Phase.RUNNING and game.pieces_placed < pieces:
        if game.pieces_placed != placed or not game.in_play:
            placed, target = game.pieces_placed, None
            if wait_s:
                now_s += wait_s
                events += recorder.update(now_s)
                continue
        plan = planner(game, target=target)
        target = plan.landing
        actions = plan.actions[:1] if action_s else plan.actions
        now_s += action_s
        events += recorder.update(now_s, actions)
    return events
