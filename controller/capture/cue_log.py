"""Log of a session's cues in plain lines, as over SSH."""

from collections.abc import Iterator, Mapping
from math import ceil

from controller.capture.labels import FrameLabels
from controller.cues import Cue, Phase


def lines(said: FrameLabels, t_s: float, words: Mapping[str, str]) -> Iterator[str]:
    """Yield a line for a new cue, and for each example that is asked for again.

    `words` has descriptions of labels; others are called by their names.
    """
    for void in said.voids:
        yield f"{void.label} again: {void.why}"
    if said.asked is not None and said.fresh:
        yield f"{int(t_s) // 60}:{int(t_s) % 60:02}  {_described(said.asked, words)}"


def _described(cue: Cue, words: Mapping[str, str]) -> str:
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
