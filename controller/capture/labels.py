"""Labels of each frame by source: the button, the keys and the cues, side by side; pure.

Nobody is right by default: each says what it says in a column of its own, and whoever learns from
the recording chooses whom to believe.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from controller.capture.cues import NULL_LABEL, Cue, CueSession, DiscardedExample, Phase
from controller.capture.key_labels import HeldKeys, KeyLabels, LabelCorrection
from controller.keymap.terminal import Timed
from controller.keymap.terminal_decoder import KeyEvent, Signal
from controller.recordings.recording import UNKNOWN, Mark


@dataclass(frozen=True, slots=True)
class FrameLabels:
    """What is said of one frame, and what was said at its time of earlier ones.

    Attributes:
        button: Index of the label that the button gives, 0 up, -1 nobody knows.
        key: The same of the keys.
        cue: The same of the cue; 0 is hands off.
        excluded: Nobody shall learn from the frame.
        asked: What the person is asked to do now; None where there are no cues.
        amends: What is true of earlier frames after all.
        marks: What happened.
        voids: Examples that are asked for again.
        fresh: Whether `asked` is another than before, but for the time that is left.
    """

    button: int = UNKNOWN
    key: int = UNKNOWN
    cue: int = UNKNOWN
    excluded: bool = False
    asked: Cue | None = None
    amends: tuple[LabelCorrection, ...] = ()
    marks: tuple[Mark, ...] = ()
    voids: tuple[DiscardedExample, ...] = ()
    fresh: bool = False


class Labeller:
    """Joins button, keys and cues, frame by frame.

    Attributes:
        labels: What there is, "null" first.
        keys: What the keys say.
        cues: What is asked for; None without a plan.
    """

    def __init__(
        self, labels: Sequence[str], *, button_label: str = "", cues: CueSession | None = None
    ) -> None:
        """Begin a session.

        Args:
            labels: What there is, "null" first.
            button_label: What the button means where nothing else names it; "" nothing.
            cues: What to ask for.
        """
        self.keys = KeyLabels(len(labels))
        self.cues = cues
        self.labels = tuple(labels)
        self._button_label = button_label
        self._named: str | None = None  # what the button means while it is down; None: it is up
        self._holds = HeldKeys()
        self._last_s = -1.0  # of the latest frame
        self._asked: Cue | None = None

    @property
    def done(self) -> bool:
        """Whether all that was planned has been recorded."""
        return self.cues is not None and self.cues.done

    def step(
        self,
        t_s: float,
        *,
        button: str | None = None,
        told: Iterable[Timed] = (),
        felt: bool = False,
        ready: bool = True,
    ) -> FrameLabels:
        """Return what is said of the frame at `t_s`.

        Args:
            t_s: Its time.
            button: What the sensor's button says: None without one, "null" up, "" down, or a label.
            told: What the terminal said since the last frame.
            felt: Something touches.
            ready: The sensor's rest is known; cues wait for it.
        """
        amends, marks = self._hear(told, t_s)
        voids: list[DiscardedExample] = []
        if self.cues is not None:
            for amend in amends:
                if amend.column == "excluded":
                    voids += self.cues.drop(amend.from_s, amend.to_s)
            if ready:
                voids += self.cues.step(t_s, felt=felt, paused=self.keys.paused)
            amends += [LabelCorrection("excluded", void.from_s, void.to_s, True) for void in voids]
            marks += [Mark(t_s, "cue", f"again {void.label}: {void.why}") for void in voids]
        asked = self.cues.at(t_s) if self.cues is not None else None
        fresh = asked is not None and not _alike(asked, self._asked)
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

    def _hear(self, told: Iterable[Timed], t_s: float) -> tuple[list[LabelCorrection], list[Mark]]:
        """Return what the keys say of earlier frames."""
        changes = []
        for ago_s, one in told:
            when_s = t_s - ago_s
            if isinstance(one, KeyEvent):
                changes += self._holds.take(one, when_s)
            elif one is Signal.AWAY:
                changes += self._holds.let_go(when_s)
        changes += self._holds.pass_time(t_s)
        notes = [note for change in changes for note in self.keys.take(change, t_s)]
        return (
            [note for note in notes if isinstance(note, LabelCorrection)],
            [note for note in notes if isinstance(note, Mark)],
        )

    def _button(self, says: str | None) -> int:
        """Return what the button means.

        It is named when it goes down: people press it late and let go of it later.
        """
        if says is None or says == NULL_LABEL:
            self._named = None
            return UNKNOWN if says is None else 0
        if says:
            return self._index(says)
        if self._named is None:
            cued = self._asked.label if self._asked is not None else ""
            self._named = cued or self._button_label
        return self._index(self._named)

    def _cue(self, asked: Cue | None) -> int:
        """Return what the cue says: its label at go, no touch before and after."""
        if asked is None or asked.phase in (Phase.WAIT, Phase.DONE) or asked.paused:
            return UNKNOWN
        return self._index(asked.label) if asked.phase is Phase.GO else 0

    def _index(self, label: str) -> int:
        return self.labels.index(label) if label in self.labels else UNKNOWN


def _alike(one: Cue, other: Cue | None) -> bool:
    """Whether two cues ask for the same, whatever time is left."""
    return other is not None and replace(one, left_s=0.0) == replace(other, left_s=0.0)


def _words(cue: Cue) -> str:
    """Return a cue as a mark says it: "go press"."""
    if cue.paused:
        return "pause"
    place = "" if cue.place is None else f" at {cue.place[0]:g},{cue.place[1]:g}"
    return f"{cue.phase.value} {cue.label}{place}".strip()
