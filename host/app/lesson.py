"""Steps of the introduction, made from the gestures and the mapping that an orb has in use."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from controller.shared.protocol.messages import COMMANDS
from controller.shared.protocol.teaching import CommandRule, GestureInfo
from host.ui.pointer_input import DomeArea

Point = tuple[float, float]  # grid units
Side = Literal["left", "right", "low", "high", "middle"]

_SHOWN: Final = COMMANDS[:-1]  # what a piece can show; a pause shows nothing
_MIRRORED: Final = {"twist_cw": "twist_ccw"}  # one of the two is enough
_OFF_CENTRE: Final = 0.6  # grid units; nearer to the middle a place has no side
_GRID: Final = 0.25  # grid units between the places that are tried


@dataclass(frozen=True, slots=True)
class Step:
    """One gesture to make."""

    label: str
    command: str  # what it is for
    place: Point
    located: bool  # whether the gesture is for another command elsewhere
    say: str  # its name for people

    def side(self, pad: DomeArea) -> Side:
        """Return the part of the dome in which the place lies."""
        across, up = self.place[0] - pad.centre[0], self.place[1] - pad.centre[1]
        if max(abs(across), abs(up)) < _OFF_CENTRE:
            return "middle"
        if abs(up) > abs(across):
            return "high" if up > 0 else "low"
        return "right" if across > 0 else "left"


def steps(infos: Sequence[GestureInfo], pad: DomeArea) -> tuple[Step, ...]:
    """Return the steps for an orb with these gestures, in the order of their commands."""
    found = [
        Step(info.label, rule.command, place, len(info.rules) > 1, info.say)
        for info in infos
        for number, rule in enumerate(info.rules)
        if (place := _place(info.rules[:number], rule, pad)) is not None
    ]
    left_out = {_MIRRORED.get(step.label) for step in found}
    wanted = [step for step in found if step.command in _SHOWN and step.label not in left_out]
    return tuple(sorted(wanted, key=lambda step: _SHOWN.index(step.command)))


def _place(before: Sequence[CommandRule], rule: CommandRule, pad: DomeArea) -> Point | None:
    """Return a place well inside a rule's region; None if the rules before it leave none."""
    if not before and _everywhere(rule):
        return pad.centre
    points = [
        (column * _GRID, row * _GRID)
        for row in range(round((pad.rows - 1) / _GRID) + 1)
        for column in range(round((pad.columns - 1) / _GRID) + 1)
    ]
    inside = [p for p in points if _fits(rule, p) and not any(_fits(one, p) for one in before)]
    if not inside:
        return None
    middle = tuple(math.fsum(values) / len(inside) for values in zip(*inside, strict=True))
    return min(inside, key=lambda point: math.dist(point, middle))


def _everywhere(rule: CommandRule) -> bool:
    return all(map(math.isinf, (rule.left_of, rule.right_of, rule.below, rule.above)))


def _fits(rule: CommandRule, point: Point) -> bool:
    x, y = point
    return rule.right_of <= x < rule.left_of and rule.above <= y < rule.below
