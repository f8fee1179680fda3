"""Angle of a touch of several fingers, by which twists are told from their winding up.

A twist may be wound up in contact: the fingers first turn the other way, by up to 30 degrees. So a
twist is answered when it has turned farther than that, for longer than that takes, or back and
beyond where it began. What turns is no pinch, though fingers that begin to turn, or change their
direction, look as if they closed. Angles are of `controller.recognition.contact`.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from controller.recognition.contact import ContactEstimate
from controller.shared.aliases import State

_HALVED_DEG: Final = 45.0  # deviation of an angle that halves its weight in the running mean
_WOUND_DEG: Final = (36.0, 6.0)  # a smaller angle may be winding up: at first, and later
_WOUND_S: Final = (0.43, 0.66)  # time in the touch from which, and up to which it falls
_MARGIN_SIGMAS: Final = 0.3  # of the newest angle, added to that
_BACK_DEG: Final = 4.0  # below its greatest, a turn has ended or goes back
_REVERSED_DEG: Final = (8.0, 4.0)  # turned the other way, and beyond zero
_TURNING_DEG: Final = (8.0, 15.0)  # now, or at any time: no pinch for now
_DOUBTED_S: Final = 0.35  # time in the touch up to which a pinch may be a twist that begins
CONFIRMED_PROBABILITY: Final = 0.6  # that suffices, smoothed, where the angle says the same
DOUBTED_PROBABILITY: Final = 0.99  # that is needed where a touch may be a twist that begins


class Turned(NamedTuple):
    """What the angle says of a touch.

    Attributes:
        waiting: Classes that are not answered yet.
        never: Classes that the touch is not.
        confirmed: Classes that the angle says, too.
        doubted: Classes that may be twists which begin.
    """

    waiting: Sequence[int] = ()
    never: Sequence[int] = ()
    confirmed: Sequence[int] = ()
    doubted: Sequence[int] = ()


class TurnTracker:
    """Angle of the present touch, and its extremes."""

    def __init__(self, clockwise: int, counter: int, others: Sequence[int]) -> None:
        """Begin without a touch.

        Args:
            clockwise: The class that turns clockwise.
            counter: That which turns counter-clockwise.
            others: Classes of several fingers that do not turn.
        """
        self._twists, self._others = (clockwise, counter), others
        self._there = False  # something touches
        # Running mean of the angle, its least, its greatest, deviation of the newest, degrees
        self._angle = np.zeros(4)

    def step(self, contact: ContactEstimate | None, *, begins: bool) -> None:
        """Take what touches in the next frame, if anything; `begins`: no touch lasts."""
        if begins:
            self._angle[:] = 0.0
        self._there = contact is not None
        if contact is None or contact.fingers == 1:
            return
        mean, least, most, _ = self._angle
        weight = 1.0 / (1.0 + (contact.angle_sigma / _HALVED_DEG) ** 2)
        mean += weight * (contact.angle_deg - mean)
        self._angle[:] = mean, min(least, mean), max(most, mean), contact.angle_sigma

    @property
    def turning(self) -> bool:
        """Whether fingers that are still there have turned."""
        return self._there and bool(max(-self._angle[1], self._angle[2]) > _TURNING_DEG[0])

    def says(self, touch_s: float) -> Turned:
        """Return what the angle says of a touch that has lasted for so long."""
        mean, least, most, sigma = self._angle.tolist()
        clockwise, counter = self._twists
        needed = float(np.interp(touch_s, _WOUND_S, _WOUND_DEG)) + _MARGIN_SIGMAS * sigma
        wound, beyond = _REVERSED_DEG
        waiting, never, confirmed = list[int](), list[int](), list[int]()
        turns = (
            (counter, clockwise, mean, most, -least),
            (clockwise, counter, -mean, -least, most),
        )
        for kind, other, angle, greatest, against in turns:
            if against >= wound and angle >= beyond:
                never = [other, *self._others]
                confirmed.append(kind)
            elif angle >= max(needed, greatest - _BACK_DEG):
                confirmed.append(kind)
            else:
                waiting.append(kind)
        if abs(mean) > _TURNING_DEG[0] or max(-least, most) > _TURNING_DEG[1]:
            waiting += self._others
        doubted = self._others if touch_s < _DOUBTED_S else ()
        return Turned(waiting, never, confirmed, doubted)

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        return {"turned": np.append(self._angle, float(self._there))}

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._angle, self._there = state["turned"][:4].copy(), bool(state["turned"][4])
