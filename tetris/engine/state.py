"""State of a game at one moment, kept and restored; and the pieces to come, from a seed."""

from collections import deque
from collections.abc import Collection
from dataclasses import dataclass, field
from random import Random
from typing import Final

from tetris.engine import moves, scoring
from tetris.engine.board import Board
from tetris.engine.events import Action, Event, Finish, TopOut
from tetris.engine.pieces import KINDS, Kind, Piece
from tetris.engine.rules import Config, Phase, Randomiser, seconds_per_row

NS: Final = 1_000_000_000
NEVER: Final = 1 << 62  # later than any moment, in nanoseconds

_CLOCK: Final = (  # goes on when a lock is taken back
    "_wall_ns",
    "_offset_ns",
    "_now_ns",
    "_soft_since_ns",
    "_started",
    "_soft",
    "_initial",
    "gravity_cap",
)
_POSITION: Final = (
    "phase",
    "piece",
    "in_play",
    "hold",
    "can_hold",
    "score",
    "lines",
    "level",
    "pieces_placed",
    "streak",
    "result",
    "_row_since_ns",
    "_lock_ns",
    "_enter_ns",
    "_guard_ns",
    "_ground_ns",
    "_resets",
    "_touched",
    "_lowest",
    "_kick",
)


class Randomizer:
    """Deals pieces from a seed: docs/tetris.md "randomizer"."""

    __slots__ = ("_randomiser", "_source", "drawn", "seed")

    def __init__(self, seed: int, randomiser: Randomiser = "7-bag") -> None:
        self.seed: Final = seed
        self._randomiser = randomiser
        self._source = Random(seed)
        self.drawn = 0  # random numbers used so far: with the seed, all there is to know

    def deal(self) -> list[Kind]:
        """Return the next pieces: a shuffled bag of all seven, or one of any kind."""
        # random() alone is promised to give the same numbers in every Python version.
        number = self._source.random
        if self._randomiser == "uniform":
            self.drawn += 1
            return [KINDS[int(number() * len(KINDS))]]
        self.drawn += len(KINDS)
        return sorted(KINDS, key=lambda _: number())

    def rewind(self, drawn: int) -> None:
        """Go to where so many random numbers have been used."""
        self._source = Random(self.seed)
        for _ in range(drawn):
            self._source.random()
        self.drawn = drawn


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A game at one moment, complete; two are equal when the games will go on alike."""

    seed: int
    config: Config
    clock: tuple[object, ...]  # for `Game.restore` alone, like the next three
    position: tuple[object, ...]
    pieces: tuple[int, tuple[Kind, ...]]
    board: tuple[int, tuple[int, int, int]]
    # The moment at which the piece before this one had entered, if locks can be taken back.
    before: "Snapshot | None" = field(compare=False, repr=False)

    @property
    def time_s(self) -> float:
        """The caller's time at that moment."""
        return float(self.clock[0]) / NS  # type: ignore[arg-type]


class State:
    """State of a game, visible and internal."""

    phase: Phase
    board: Board
    piece: Piece  # in play; else the one before, and at the end the one that ended the game
    result: TopOut | Finish | None  # how the game ended; None before
    hold: Kind | None
    score: int
    lines: int
    level: int
    pieces_placed: int
    streak: scoring.Streak

    def __init__(self, seed: int, config: Config) -> None:
        self.seed: Final = seed
        self.config: Final = config
        self.gravity_cap = config.gravity_cap  # the level whose gravity is not exceeded
        # Whether the piece can be moved: not between a lock and the next entrance, nor at the end.
        self.in_play = False
        self.can_hold = False  # before the next lock
        self._dealer = Randomizer(seed, config.randomiser)
        self._queue: deque[Kind] = deque()
        self._events: list[Event] = []
        self._past: Snapshot | None = None
        self._entrances = {
            kind: Piece.entering(kind, config.columns, config.rows) for kind in KINDS
        }
        self._table = moves.TABLES[config.kicks]
        self._started = self._soft = self._touched = False
        self._initial: Collection[Action] = ()
        self._wall_ns = self._offset_ns = 0  # the caller's time, and when the game began in it
        self._now_ns = self._soft_since_ns = 0  # the game's own time, which pauses
        self._at_s = 0.0  # the caller's time of what happens now
        self._row_since_ns = self._guard_ns = self._resets = self._lowest = 0
        self._lock_ns: int | None = None  # when the piece locks; None in the air
        self._enter_ns: int | None = None  # when the next one enters; None while one is in play
        self._ground_ns: int | None = None  # when it touched ground after its last fall
        self._kick: int | None = None  # of the turn that was the piece's last movement
        self._gravity_ns = self._soft_ns = self._next_ns = self._due_ns = NEVER
        self._delay_ns = round(config.lock_delay_s * NS) if config.gravity else NEVER
        self._guard_span_ns = round(config.guard_s * NS)
        self._generation_ns = round(config.generation_delay_s * NS)
        limit_s = config.time_limit_s
        self._limit_ns = NEVER if limit_s is None else round(limit_s * NS)

    @property
    def next(self) -> tuple[Kind, ...]:
        """The next pieces, the nearest first."""
        return tuple(self._queue)[: self.config.previews]

    @property
    def ghost_y(self) -> int:
        """The y of the piece's box if it were dropped now."""
        return self.piece.y - moves.rows_to_fall(self.board.bits, self.piece)

    @property
    def time_s(self) -> float:
        """Seconds played, without pauses."""
        return self._now_ns / NS

    @property
    def garbage_rows(self) -> int:
        """Number of rows that hold blocks that no piece left."""
        return sum("#" in row for row in self.board.rows)

    def snapshot(self) -> Snapshot:
        """Return this moment, to come back to it."""
        return Snapshot(
            self.seed,
            self.config,
            tuple(getattr(self, name) for name in _CLOCK),
            tuple(getattr(self, name) for name in _POSITION),
            (self._dealer.drawn, tuple(self._queue)),
            (self.board.bits, self.board.planes),
            self._past,
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Go to a moment, before which the next update's time must not lie.

        Raises:
            ValueError: It is a moment of a game with another seed or other rules.
        """
        if (snapshot.seed, snapshot.config) != (self.seed, self.config):
            raise ValueError("the snapshot is of a game with another seed or other rules")
        for name, value in zip(_CLOCK, snapshot.clock, strict=True):
            setattr(self, name, value)
        self._events = []
        self._return_to(snapshot)

    def _return_to(self, snapshot: Snapshot) -> None:
        """Take up the position, and leave the clock as it is."""
        for name, value in zip(_POSITION, snapshot.position, strict=True):
            setattr(self, name, value)
        drawn, queue = snapshot.pieces
        self._dealer.rewind(drawn)
        self._queue = deque(queue)
        self.board = Board(self.config.columns)
        self.board.bits, self.board.planes = snapshot.board
        self._past = snapshot.before
        self._pace()
        self._schedule()

    def _pace(self) -> None:
        row_s = seconds_per_row(min(self.level, self.gravity_cap))
        self._gravity_ns = round(row_s * NS) if self.config.gravity else NEVER
        self._soft_ns = round(row_s * NS / self.config.soft_drop_factor)

    def _schedule(self) -> None:
        """Work out when something happens next without the player."""
        if self.phase is not Phase.RUNNING:
            self._due_ns = NEVER
        elif self._enter_ns is not None:
            self._next_ns = self._enter_ns
            self._due_ns = min(self._enter_ns, self._limit_ns)
        elif self._lock_ns is not None:
            self._next_ns = self._lock_ns
            self._due_ns = min(self._lock_ns, self._limit_ns)
        else:
            self._schedule_fall()

    def _schedule_fall(self) -> None:
        next_ns = self._row_since_ns + self._gravity_ns
        if self._soft:
            soft_ns = max(self._row_since_ns, self._soft_since_ns) + self._soft_ns
            if soft_ns < next_ns:
                next_ns = soft_ns
        if next_ns <= self._now_ns:  # a change of pace made it overdue
            next_ns = self._now_ns + 1  # after the inputs of the same moment
        self._next_ns = next_ns
        self._due_ns = next_ns if next_ns < self._limit_ns else self._limit_ns
