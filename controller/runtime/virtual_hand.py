"""The virtual orb's own hand: gestures by a script, or as cues ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from controller.protocol.messages import Perform

if TYPE_CHECKING:
    from controller.capture.cues import Cue

Wish = tuple[float, Perform]  # seconds, and what the hand shall do then


class VirtualHand:
    """Gestures that wait for their time."""

    def __init__(
        self,
        script: Iterator[Wish] | None = None,
        obey: Callable[[Cue, float], Wish | None] | None = None,
    ) -> None:
        """Prepare the first gesture.

        Args:
            script: What the hand does unasked, in order; None: nothing.
            obey: Returns what it does for a cue that begins at a time; None: it heeds no cues.
        """
        self._script, self._obey = script or iter(()), obey
        self._next = next(self._script, None)
        self._asked: Wish | None = None  # by a cue, and not due yet

    def heed(self, cue: Cue, t_s: float) -> None:
        """Take a new cue."""
        if self._obey is not None:
            self._asked = self._obey(cue, t_s)

    def due(self, t_s: float) -> Iterator[Wish]:
        """Yield what begins by `t_s`, once."""
        while self._next is not None and self._next[0] <= t_s:
            yield self._next
            self._next = next(self._script, None)
        if self._asked is not None and self._asked[0] <= t_s:
            yield self._asked
            self._asked = None
