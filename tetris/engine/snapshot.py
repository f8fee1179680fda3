"""A game at one moment, as it is kept and restored: its clock, position, pieces and board."""

from dataclasses import dataclass, field
from typing import Final

from tetris.engine.pieces import Kind
from tetris.engine.rules import Config

NS: Final = 1_000_000_000
# Names of the attributes of `Game` that make up its clock and its position.
CLOCK: Final = (  # goes on when a lock is taken back
    "_wall_ns",
    "_offset_ns",
    "_now_ns",
    "_soft_since_ns",
    "_started",
    "_soft",
    "_initial",
)
POSITION: Final = (
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


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A game at one moment, complete; two are equal when the games will go on alike."""

    seed: int
    config: Config
    clock: tuple[object, ...]  # for `Game.restore` alone, like the next three
    position: tuple[object, ...]
    pieces: tuple[int, tuple[Kind, ...]]
    board: tuple[int, tuple[int, int, int]]
    row_us: int | None = field(repr=False)  # of the last `Gravity`
    # The moment at which the piece before this one had entered, if locks can be taken back.
    before: "Snapshot | None" = field(compare=False, repr=False)

    @property
    def time_s(self) -> float:
        """The caller's time at that moment."""
        return float(self.clock[0]) / NS  # type: ignore[arg-type]
