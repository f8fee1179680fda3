"""Shortest input sequences that bring a piece to each of its placements."""

from collections import deque
from collections.abc import Iterator
from typing import Final

from tetris.bots.placements import Placement
from tetris.engine import moves
from tetris.engine.events import Action
from tetris.engine.kicks import Kicks
from tetris.engine.moves import Spin
from tetris.engine.pieces import Piece

_Came = dict[Piece, tuple[Piece, Action] | None]  # from where, and by what
_TURNS: Final = (Action.ROTATE_CW, Action.ROTATE_CCW)
_SHIFTS: Final = (Action.LEFT, Action.RIGHT)


def path(
    bits: int, piece: Piece, landing: Piece, spin: Spin | None = None, kicks: Kicks = "srs"
) -> tuple[Action, ...] | None:
    """Return the fewest inputs to a placement, the last a hard drop; None if out of reach.

    Args:
        bits: The board.
        piece: The piece where it is now.
        landing: Where it shall lock, in any turn that fills the same cells.
        spin: With what spin; None takes any.
        kicks: The kick table.
    """
    mask = landing.mask
    for found, actions in _walk(bits, piece, kicks):
        if found.piece.mask == mask and spin in (None, found.spin):
            return actions
    return None


def paths(bits: int, piece: Piece, kicks: Kicks = "srs") -> dict[Placement, tuple[Action, ...]]:
    """Return every placement in reach with the fewest inputs to it, the shortest first.

    `DOWN` is one row, as an orb gives it.
    """
    return dict(_walk(bits, piece, kicks))


def fewest(
    bits: int, piece: Piece, landing: Piece, *, kicks: Kicks = "srs", runs: bool = False
) -> int | None:
    """Return the fewest shifts and turns to a placement, rows down free; None if out of reach.

    Args:
        bits: The board.
        piece: The piece where it is now.
        landing: Where it shall lock, in any turn that fills the same cells.
        kicks: The kick table.
        runs: Whether a shift as far as it goes, as of a held key, counts as one.
    """
    for falls in (False, True):  # most placements need no row down, which is soon found
        costs = {piece: 0}
        queue = deque([piece])
        while queue:
            here = queue.popleft()
            if moves.landed(bits, here).mask == landing.mask:
                return costs[here]
            for there, action, _ in neighbours(bits, here, moves.TABLES[kicks]):
                down = action is Action.DOWN
                if down and not falls:
                    continue
                ways = [there]
                if runs and action in _SHIFTS:
                    ways.append(_shifted_on(bits, there, action))
                cost = costs[here] + (not down)
                for way in ways:
                    if cost < costs.get(way, cost + 1):
                        costs[way] = cost
                        (queue.appendleft if down else queue.append)(way)
    return None


def _shifted_on(bits: int, piece: Piece, action: Action) -> Piece:
    """Return a piece shifted as far as it goes."""
    while not bits & (further := piece.left if action is Action.LEFT else piece.right).mask:
        piece = further
    return piece


def _walk(bits: int, piece: Piece, kicks: Kicks) -> Iterator[tuple[Placement, tuple[Action, ...]]]:
    """Go through all positions in reach, the nearest first; each placement comes once."""
    came: _Came = {piece: None}
    landed: set[tuple[int, Spin]] = set()
    table = moves.TABLES[kicks]
    queue = deque([piece])
    first = moves.landed(bits, piece)
    landed.add((first.mask, Spin.NONE))
    yield Placement(first, Spin.NONE), (Action.HARD_DROP,)
    spins = piece.kind == "T"
    while queue:
        here = queue.popleft()
        for there, action, kick in neighbours(bits, here, table):
            new = there not in came
            if new:
                came[there] = here, action
                queue.append(there)
            elif not spins:  # only T's placements depend on the way
                continue
            if action is Action.DOWN:  # it lands where the position above does
                continue
            if bits & there.below.mask:
                landing, spin = there, moves.spin(bits, there, kick)
            elif not new:
                continue
            else:
                landing, spin = moves.landed(bits, there), Spin.NONE
            key = (landing.mask, spin)
            if key not in landed:
                landed.add(key)
                yield Placement(landing, spin), (*_way(came, here), action, Action.HARD_DROP)


def neighbours(bits: int, here: Piece, table: int) -> Iterator[tuple[Piece, Action, int | None]]:
    """Yield the positions one input away, each with the input and the kick of a turn.

    Args:
        bits: The board.
        here: The present position, which is free.
        table: Of the kicks, as in `moves.TABLES`.
    """
    if not bits & here.left.mask:
        yield here.left, Action.LEFT, None
    if not bits & here.right.mask:
        yield here.right, Action.RIGHT, None
    if here.kind != "O":
        for at, action in enumerate(_TURNS, table):
            for kick, turned in enumerate(here.turned[at]):
                if not bits & turned.mask:
                    yield turned, action, kick
                    break
    if not bits & here.below.mask:
        yield here.below, Action.DOWN, None


def _way(came: _Came, here: Piece) -> list[Action]:
    actions = []
    while step := came[here]:
        here, action = step
        actions.append(action)
    return actions[::-1]
