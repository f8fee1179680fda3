"""Labels of each frame by source, the button and the cues, in separate columns; pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from controller.recordings.recording import UNKNOWN, Mark
from controller.shared.cues import NULL_LABEL, Cue, CueSession, DiscardedExample, Phase


@dataclass(frozen=True, slots=True)
class FrameLabels:
    """Labels of one frame, and examples of earlier frames that do not count."""

    button: int = UNKNOWN  # index of the label from the button, 0 up, -1 unknown
    cue: int = UNKNOWN  # index of the label of the cue, 0 hands off, -1 no cue
    asked: Cue | None = None  # the present cue; None without a plan
    marks: tuple[Mark, ...] = ()
    voids: tuple[DiscardedExample, ...] = ()  # requested again, their frames left out of training
    fresh: bool = False  # whether `asked` differs from the last one in more than the time left


class Labeller:
    """Labels frame by frame from button and cues.

    Attributes:
        labels: Names of the labels, "null" first.
        cues: The plan under way; None without one.
        given: Index of the label that the host asks for; -1 unknown. Without a plan.
    """

    def __init__(
        self, labels: Sequence[str], *, button_label: str = "", cues: CueSession | None = None
    ) -> None:
        """Begin a session; `button_label` is that of the button without a cue, "" none."""
        self.cues, self.given = cues, UNKNOWN
        self.labels = tuple(labels)
        self._button_label = button_label
        self._named: str | None = None  # label of the pressed button; None: it is up
        self._asked: Cue | None = None  # the present cue, and the same without the time left
        self._timeless: Cue | None = None

    @property
    def done(self) -> bool:
        """Whether the whole plan has been recorded."""
        return self.cues is not None and self.cues.done

    def label(
        self,
        t_s: float,
        *,
        button: str | None = None,
        felt: bool = False,
        ready: bool = True,
    ) -> FrameLabels:
        """Return the labels of the frame at `t_s`.

        `button` is the state of the sensor's button: None without one, "null" up, "" down, or a
        label. `felt`: the sensor is touched. `ready`: its baseline is known; cues wait for it.
        """
        voids: list[DiscardedExample] = []
        if self.cues is not None and ready:
            voids = self.cues.advance(t_s, felt=felt)
        marks = [Mark(t_s, "cue", f"again {void.label}: {void.why}") for void in voids]
        asked = self.cues.at(t_s) if self.cues is not None else None
        timeless = asked and replace(asked, left_s=0.0)
        fresh = asked is not None and timeless != self._timeless
        if asked is not None and fresh:
            marks.append(Mark(t_s, "cue", _words(asked)))
        self._asked, self._timeless = asked, timeless
        return FrameLabels(
            button=self._button(button),
            cue=self._cue(asked),
            asked=asked,
            marks=tuple(marks),
            voids=tuple(voids),
            fresh=fresh,
        )

    def _button(self, state: str | None) -> int:
        """Return the label of the button, chosen at its press: its release is often late."""
        if state is None or state == NULL_LABEL:
            self._named = None
            return UNKNOWN if state is None else 0
        if state:
            return self._index(state)
        if self._named is None:
            cued = self._asked.label if self._asked is not None else ""
            self._named = cued or self._button_label
        return self._index(self._named)

    def _cue(self, asked: Cue | None) -> int:
        """Return the label of a cue: its own at go, no touch before and after."""
        if self.cues is None:
            return self.given
        if asked is None or asked.phase in (Phase.WAIT, Phase.DONE):
            return UNKNOWN
        return self._index(asked.label) if asked.phase is Phase.GO else 0

    def _index(self, label: str) -> int:
        return self.labels.index(label) if label in self.labels else UNKNOWN


def _words(cue: Cue) -> str:
    """Return the text of a cue's mark: "go press"."""
    place = "" if cue.place is None else f" at {cue.place[0]:g},{cue.place[1]:g}"
    return f"{cue.phase.value} {cue.label}{place}".strip()
