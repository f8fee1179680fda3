"""Labels of each frame by source, the button, the keys and the cues, in separate columns; pure."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from controller.capture.cues import NULL_LABEL, Cue, CueSession, DiscardedExample, Phase
from controller.capture.key_labels import HeldKeys, KeyLabels, LabelCorrection
from controller.keymap.terminal import Timed
from controller.keymap.terminal_decoder import KeyEvent, Signal
from controller.recordings.recording import UNKNOWN, Mark


@dataclass(frozen=True, slots=True)
class FrameLabels:
    """Labels of one frame, and corrections of earlier frames."""

    button: int = UNKNOWN  # index of the label from the button, 0 up, -1 unknown
    key: int = UNKNOWN  # index of the label from the keys, 0 none held, -1 unknown
    cue: int = UNKNOWN  # index of the label of the cue, 0 hands off, -1 no cue
    excluded: bool = False  # whether the frame is left out of training
    asked: Cue | None = None  # the present cue; None without a plan
    amends: tuple[LabelCorrection, ...] = ()  # corrections of earlier frames
    marks: tuple[Mark, ...] = ()
    voids: tuple[DiscardedExample, ...] = ()  # discarded examples, which are requested again
    fresh: bool = False  # whether `asked` differs from the last one in more than the time left


class Labeller:
    """Labels frame by frame from button, keys and cues.

    Attributes:
        labels: Names of the labels, "null" first.
        keys: Labels from the keys.
        cues: The plan under way; None without one.
        given: Index of the label that the host asks for; -1 unknown. Without a plan.
    """

    def __init__(
        self, labels: Sequence[str], *, button_label: str = "", cues: CueSession | None = None
    ) -> None:
        """Begin a session; `button_label` is that of the button without a cue, "" none."""
        self.keys = KeyLabels(len(labels))
        self.cues, self.given = cues, UNKNOWN
        self.labels = tuple(labels)
        self._button_label = button_label
        self._named: str | None = None  # label of the pressed button; None: it is up
        self._holds = HeldKeys()
        self._last_s = -1.0  # of the latest frame
        self._asked: Cue | None = None

    @property
    def done(self) -> bool:
        """Whether the whole plan has been recorded."""
        return self.cues is not None and self.cues.done

    def label(
        self,
        t_s: float,
        *,
        button: str | None = None,
        events: Iterable[Timed] = (),
        felt: bool = False,
        ready: bool = True,
    ) -> FrameLabels:
        """Return the labels of the frame at `t_s`, after terminal events since the last frame.

        `button` is the state of the sensor's button: None without one, "null" up, "" down, or a
        label. `felt`: the sensor is touched. `ready`: its baseline is known; cues wait for it.
        """
        amends, marks = self._key_changes(events, t_s)
        voids: list[DiscardedExample] = []
        if self.cues is not None:
            for amend in amends:
                if amend.column == "excluded":
                    voids += self.cues.drop(amend.from_s, amend.to_s)
            if ready:
                voids += self.cues.advance(t_s, felt=felt, paused=self.keys.paused)
            amends += [LabelCorrection("excluded", void.from_s, void.to_s, True) for void in voids]
            marks += [Mark(t_s, "cue", f"again {void.label}: {void.why}") for void in voids]
        asked = self.cues.at(t_s) if self.cues is not None else None
        fresh = asked is not None and not _same(asked, self._asked)
        if asked is not None and fresh:
            marks.append(Mark(t_s, "cue", _words(asked)))
        self._asked, last_s, self._last_s = asked, self._last_s, t_s
        return FrameLabels(
            button=self._button(button),
            key=self.keys.label,
            cue=self._cue(asked),
            excluded=self.keys.paused,
            asked=asked,
            amends=tuple(amend for amend in amends if amend.from_s <= last_s),
            marks=tuple(marks),
            voids=tuple(voids),
            fresh=fresh,
        )

    def _key_changes(
        self, events: Iterable[Timed], t_s: float
    ) -> tuple[list[LabelCorrection], list[Mark]]:
        """Return the corrections and marks from the keys since the last frame."""
        changes = []
        for ago_s, event in events:
            when_s = t_s - ago_s
            if isinstance(event, KeyEvent):
                changes += self._holds.take(event, when_s)
            elif event is Signal.AWAY:
                changes += self._holds.let_go(when_s)
        changes += self._holds.pass_time(t_s)
        notes = [note for change in changes for note in self.keys.take(change, t_s)]
        return (
            [note for note in notes if isinstance(note, LabelCorrection)],
            [note for note in notes if isinstance(note, Mark)],
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
        if asked is None or asked.phase in (Phase.WAIT, Phase.DONE) or asked.paused:
            return UNKNOWN
        return self._index(asked.label) if asked.phase is Phase.GO else 0

    def _index(self, label: str) -> int:
        return self.labels.index(label) if label in self.labels else UNKNOWN


def _same(one: Cue, other: Cue | None) -> bool:
    """Return whether two cues are equal except for the time left."""
    return other is not None and replace(one, left_s=0.0) == replace(other, left_s=0.0)


def _words(cue: Cue) -> str:
    """Return the text of a cue's mark: "go press"."""
    if cue.paused:
        return "pause"
    place = "" if cue.place is None else f" at {cue.place[0]:g},{cue.place[1]:g}"
    return f"{cue.phase.value} {cue.label}{place}".strip()
