"""Registry of bots by name, and a hint for a person."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, Protocol

from tetris.bots import beam_search, greedy
from tetris.bots.greedy import Plan
from tetris.engine.game import Game
from tetris.engine.pieces import Piece

__all__ = ["BOTS", "STRONGEST", "Plan", "Planner", "hint"]


class Planner(Protocol):
    """A bot: returns where to put the piece, and how.

    It may be asked again after every action, then with the landing that it wanted.
    """

    def __call__(
        self, game: Game, *, command_cost: float = 0.0, target: Piece | None = None
    ) -> Plan:
        """Plan the piece in play from where it is now; see `greedy.plan`."""
        ...


BOTS: Final[Mapping[str, Planner]] = MappingProxyType(
    {"dellacherie": greedy.plan, "beam": beam_search.plan}
)
STRONGEST: Final = "beam"


def hint(game: Game) -> Plan:
    """Return what the strongest bot would do; where it would hold first, `HOLD` comes first.

    Raises:
        ValueError: No piece is in play.
    """
    return BOTS[STRONGEST](game)
