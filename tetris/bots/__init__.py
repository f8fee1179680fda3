"""Bots, search and the learning environment. For `history` and `window`.

A bot is a function from a game to a plan; `BOTS` names them.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from tetris.bots import beam_search, greedy
from tetris.bots.greedy import Planner

BOTS: Final[Mapping[str, Planner]] = MappingProxyType(
    {"dellacherie": greedy.plan, "beam": beam_search.plan}
)
STRONGEST: Final = "beam"
