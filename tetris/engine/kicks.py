"""Kick tables as data: what a quarter turn tries, in order, until the piece fits.

Source: docs/tetris.md "srs". "srs" is the guideline's Super Rotation System. "srs+" is
another game's, which differs for I only: its table is the same seen in a mirror.
"""

from collections.abc import Mapping
from typing import Final, Literal

Kicks = Literal["srs", "srs+"]
KickTable = Mapping[tuple[int, int], tuple[tuple[int, int], ...]]  # (turn, next): shifts (x, y)
LAST_KICK: Final = 4  # the fifth test, which moves the centre by one column and two rows

_JLSTZ: Final[KickTable] = {
    (0, 1): ((0, 0), (-1, 0), (-1, 1), (0, -2), (-1, -2)),
    (1, 0): ((0, 0), (1, 0), (1, -1), (0, 2), (1, 2)),
    (1, 2): ((0, 0), (1, 0), (1, -1), (0, 2), (1, 2)),
    (2, 1): ((0, 0), (-1, 0), (-1, 1), (0, -2), (-1, -2)),
    (2, 3): ((0, 0), (1, 0), (1, 1), (0, -2), (1, -2)),
    (3, 2): ((0, 0), (-1, 0), (-1, -1), (0, 2), (-1, 2)),
    (3, 0): ((0, 0), (-1, 0), (-1, -1), (0, 2), (-1, 2)),
    (0, 3): ((0, 0), (1, 0), (1, 1), (0, -2), (1, -2)),
}
_I: Final[KickTable] = {
    (0, 1): ((0, 0), (-2, 0), (1, 0), (-2, -1), (1, 2)),
    (1, 0): ((0, 0), (2, 0), (-1, 0), (2, 1), (-1, -2)),
    (1, 2): ((0, 0), (-1, 0), (2, 0), (-1, 2), (2, -1)),
    (2, 1): ((0, 0), (1, 0), (-2, 0), (1, -2), (-2, 1)),
    (2, 3): ((0, 0), (2, 0), (-1, 0), (2, 1), (-1, -2)),
    (3, 2): ((0, 0), (-2, 0), (1, 0), (-2, -1), (1, 2)),
    (3, 0): ((0, 0), (1, 0), (-2, 0), (1, -2), (-2, 1)),
    (0, 3): ((0, 0), (-1, 0), (2, 0), (-1, 2), (2, -1)),
}
_I_PLUS: Final[KickTable] = {
    (0, 1): ((0, 0), (1, 0), (-2, 0), (-2, -1), (1, 2)),
    (1, 0): ((0, 0), (-1, 0), (2, 0), (-1, -2), (2, 1)),
    (1, 2): ((0, 0), (-1, 0), (2, 0), (-1, 2), (2, -1)),
    (2, 1): ((0, 0), (-2, 0), (1, 0), (-2, 1), (1, -2)),
    (2, 3): ((0, 0), (2, 0), (-1, 0), (2, 1), (-1, -2)),
    (3, 2): ((0, 0), (1, 0), (-2, 0), (1, 2), (-2, -1)),
    (3, 0): ((0, 0), (1, 0), (-2, 0), (1, -2), (-2, 1)),
    (0, 3): ((0, 0), (-1, 0), (2, 0), (2, -1), (-1, 2)),
}
_O: Final[KickTable] = dict.fromkeys(_JLSTZ, ((0, 0),))  # it never moves


def _table(i: KickTable) -> Mapping[str, KickTable]:
    return dict.fromkeys("TSZJL", _JLSTZ) | {"I": i, "O": _O}


KICKS: Final[Mapping[Kicks, Mapping[str, KickTable]]] = {"srs": _table(_I), "srs+": _table(_I_PLUS)}
"""By the name of the rules, and by the kind of the piece."""
