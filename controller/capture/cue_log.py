"""Log of a session's cues in plain lines, as over SSH."""

from collections.abc import Mapping
from math import ceil

from controller.aliases import Say
from controller.capture.cues import Cue, Phase
from controller.capture.labels import FrameLabels
from controller.recognition.pipeline import Step


class Display:
    """A display of a recording session; this base class shows nothing."""

    def show(self, said: FrameLabels, step: Step) -> None:
        """Show a frame."""


class CueLog(Display):
    """A line for each cue, and for each example that is asked for again."""

    def __init__(self, say: Say) -> None:
        """Pass lines to `say`."""
        self._say = say

    def show(self, said: FrameLabels, step: Step) -> None:
        """Log what a frame changed."""
        for void in said.voids:
            self._say(f"{void.label} again: {void.why}")
        if said.asked is not None and said.fresh:
            self._say(f"{int(step.t_s) // 60}:{int(step.t_s) % 60:02}  {describe(said.asked)}")


def describe(cue: Cue, gestures: Mapping[str, str] | None = None) -> str:
    """Return a cue in words; `gestures` describes labels."""
    words = gestures or {}
    if cue.phase is Phase.WAIT:
        return "hands off: the sensor finds its rest"
    if cue.phase not in (Phase.GET_READY, Phase.GO):
        return str(cue.phase.value)
    place = "" if cue.place is None else f" at {cue.place[0]:g},{cue.place[1]:g}"
    what = f"{words.get(cue.label, cue.label)}{place}"
    if cue.phase is Phase.GET_READY:
        return f"get ready: {what}  ({cue.left} left)"
    then = f"; then: {words.get(cue.then, cue.then)}" if cue.then else ""
    return f"GO: {what} {ceil(cue.left_s)} s{then}"
