"""The tape that runs along with a session: what was felt, what was said of it, file after file."""

import logging
from collections.abc import Callable
from typing import Final, Protocol

from controller.capture.labels import FrameLabels, Labeller
from controller.keymap.terminal import Keyboard
from controller.recognition.pipeline import Pipeline, Step
from controller.recognition.preprocess import Frame, State
from controller.recordings.recorder import Recorder

LEAST_S: Final = 1.0  # a session that ended sooner is not kept

Plain = dict[str, object]  # what goes to a screen, as plain data

_log = logging.getLogger("controller")


class Display(Protocol):
    """What people look at."""

    def show(self, said: FrameLabels, step: Step, problem: str) -> None:
        """Show a frame; `problem` is what is wrong with the disk, "" if nothing."""

    def clear(self) -> None:
        """Make room for whoever writes next."""


class NullDisplay:
    """A screen that nobody looks at."""

    def show(self, said: FrameLabels, step: Step, problem: str) -> None:
        """Show nothing."""

    def clear(self) -> None:
        """Nothing is there."""


class SessionRecorder:
    """Records one device from its first frame on."""

    def __init__(
        self,
        begin: Callable[[State], Recorder],
        pipeline: Pipeline,
        labeller: Labeller,
        *,
        keyboard: Keyboard | None = None,
        tell: Callable[[Plain], None] = lambda plain: None,
        screen: Display | None = None,
    ) -> None:
        """Begin to record.

        Args:
            begin: Begins a file, given the pipeline's state before its first frame.
            pipeline: What the frames go through.
            labeller: Who says what of each frame.
            keyboard: The keys, where there are any.
            tell: Takes every change of the cues.
            screen: For people.

        Raises:
            RecordingError: The first file cannot be written.
        """
        self._begin, self._pipeline, self._labeller = begin, pipeline, labeller
        self._keyboard, self._tell, self._screen = keyboard, tell, screen or NullDisplay()
        self._recorder = begin(pipeline.state())
        self._rested = False  # this file has its rest image
        self._least_s = LEAST_S  # of the session's first file; those that go on are kept

    @property
    def labels(self) -> tuple[str, ...]:
        """What the label columns count."""
        return self._labeller.labels

    @property
    def done(self) -> bool:
        """Whether all that was planned has been recorded."""
        return self._labeller.done

    def turn(self) -> None:
        """Go on in a new file if the present one is full; the next frame is not taken yet.

        Raises:
            RecordingError: One of them cannot be written.
        """
        if self._recorder.full:
            self.go_on(self._begin)

    def go_on(self, begin: Callable[[State], Recorder]) -> None:
        """Seal the present file and go on in a new one, as `begin` makes it.

        Raises:
            RecordingError: One of them cannot be written.
        """
        self._seal()
        self._begin = begin
        self._recorder = begin(self._pipeline.state())
        self._rested, self._least_s = False, 0.0

    def take(self, frame: Frame, step: Step, label: int, button: str | None) -> FrameLabels:
        """Keep a frame, and return what was said of it.

        Args:
            frame: As it was read.
            step: What the pipeline made of it.
            label: What truly happens, as far as known: an index, -1 unknown.
            button: What the sensor's button says.
        """
        t_s, recorder = step.t_s, self._recorder
        said = self._labeller.step(
            t_s,
            button=button,
            told=self._keyboard.poll() if self._keyboard is not None else (),
            felt=step.ready and not step.quiet,
            ready=step.ready,
        )
        recorder.add(
            frame,
            t_s,
            step.frame,
            label=label,
            button=said.button,
            key=said.key,
            cue=said.cue,
            excluded=said.excluded,
            touch=step.touch,
            command=step.command,
        )
        for amend in said.amends:
            recorder.amend(amend.column, amend.from_s, amend.to_s, amend.value)
        for mark in said.marks:
            recorder.mark(mark.t_s, mark.kind, mark.text)
        rest = self._pipeline.rest
        if rest is not None and not self._rested:
            self._rested = True
            recorder.rest(rest)
        for void in said.voids:
            self._tell(void.plain(t_s))
        if said.asked is not None and said.fresh:
            self._tell(said.asked.plain(t_s))
        self._screen.show(said, step, recorder.problem)
        return said

    def mark(self, t_s: float, kind: str, text: str) -> None:
        """Note something that happened at `t_s`."""
        self._recorder.mark(t_s, kind, text)

    def close(self) -> bool:
        """Seal the recording, and return whether it was long enough to be kept. Only once.

        Raises:
            RecordingError: It cannot be written where it should be; the message says where it is.
        """
        self._screen.clear()
        return self._seal()

    def _seal(self) -> bool:
        path = self._recorder.close(self._least_s)
        if path is not None:
            self._screen.clear()
            _log.info("recorded into %s", path)
        return path is not None
