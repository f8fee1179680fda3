"""Simulated hand of the virtual orb: gestures by a script, or by cues."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from controller.protocol.messages import Perform

if TYPE_CHECKING:
    from controller.capture.cues import Cue

TimedPerform = tuple[float, Perform]  # seconds, and the gesture that begins then


class VirtualHand:
    """Gestures scheduled by time."""

    def __init__(
        self,
        script: Iterator[TimedPerform] | None = None,
        respond: Callable[[Cue, float], TimedPerform | None] | None = None,
    ) -> None:
        """Prepare the first gesture.

        Args:
            script: Gestures in order of time; None: none.
            respond: Returns the gesture for a cue that begins at a time; None: cues are ignored.
        """
        self._script, self._respond = script or iter(()), respond
        self._next = next(self._script, None)
        self._cued: TimedPerform | None = None  # for a cue, and not due yet

    def take_cue(self, cue: Cue, t_s: float) -> None:
        """Take a new cue."""
        if self._respond is not None:
            self._cued = self._respond(cue, t_s)

    def due(self, t_s: float) -> Iterator[TimedPerform]:
        """Yield each gesture that begins by `t_s`, once."""
        while self._next is not None and self._next[0] <= t_s:
            yield self._next
            self._next = next(self._script, None)
        if self._cued is not None and self._cued[0] <= t_s:
            yield self._cued
            self._cued = None
