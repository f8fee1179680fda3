"""Recorder of one session: frames, labels, commands and events, file after file."""

import logging
from collections.abc import Callable
from typing import Final

from controller.capture.labels import FrameLabels, Labeller
from controller.capture.status_line import Display
from controller.keymap.terminal import Keyboard
from controller.recognition.frames import Frame, State
from controller.recognition.pipeline import Pipeline, Step
from controller.recordings.recorder import Recorder

LEAST_S: Final = 1.0  # a shorter session is not kept

Plain = dict[str, object]  # a change of the cues as plain data

_log = logging.getLogger("controller")


class SessionRecorder:
    """Records one device from its first frame on.

    Attributes:
        labels: Names that the label columns index.
    """

    def __init__(
        self,
        begin: Callable[[State], Recorder],
        pipeline: Pipeline,
        labeller: Labeller,
        *,
        keyboard: Keyboard | None = None,
        on_cue: Callable[[Plain], None] = lambda plain: None,
        display: Display | None = None,
    ) -> None:
        """Begin to record.

        Args:
            begin: Begins a file, given the pipeline's state before its first frame.
            pipeline: Processes the frames.
            labeller: Labels the frames.
            keyboard: The keys, if there are any.
            on_cue: Called with every change of the cues.
            display: For people.

        Raises:
            RecordingError: The first file cannot be written.
        """
        self.labels = labeller.labels
        self._begin, self._pipeline, self._labeller = begin, pipeline, labeller
        self._keyboard, self._on_cue = keyboard, on_cue
        self._display = display or Display()
        self._recorder = begin(pipeline.state())
        self._rested = False  # this file has its rest image
        self._least_s = LEAST_S  # of the session's first file; later ones are always kept

    @property
    def done(self) -> bool:
        """Whether the whole plan has been recorded."""
        return self._labeller.done

    def turn(self) -> None:
        """Continue in a new file if the present one is full; call it between two frames.

        Raises:
            RecordingError: One of them cannot be written.
        """
        if self._recorder.full:
            self.go_on(self._begin)

    def go_on(self, begin: Callable[[State], Recorder]) -> None:
        """Seal the present file and continue in a new one, as `begin` makes it.

        Raises:
            RecordingError: One of them cannot be written.
        """
        self._seal()
        self._begin = begin
        self._recorder = begin(self._pipeline.state())
        self._rested, self._least_s = False, 0.0

    def take(self, frame: Frame, step: Step, label: int, button: str | None) -> FrameLabels:
        """Record a frame, and return its labels.

        Args:
            frame: As it was read, (rows, columns).
            step: The pipeline's result.
            label: True label as far as known: an index, -1 unknown.
            button: State of the sensor's button.
        """
        said = self._labeller.label(
            step.t_s,
            button=button,
            events=self._keyboard.poll() if self._keyboard is not None else (),
            felt=step.ready and not step.quiet,
            ready=step.ready,
        )
        self._write(frame, step, label, said)
        for void in said.voids:
            self._on_cue(void.plain(step.t_s))
        if said.asked is not None and said.fresh:
            self._on_cue(said.asked.plain(step.t_s))
        self._display.show(said, step, self._recorder.problem)
        return said

    def mark(self, t_s: float, kind: str, text: str) -> None:
        """Record an event at `t_s`."""
        self._recorder.mark(t_s, kind, text)

    def close(self) -> bool:
        """Seal the recording, and return whether it was long enough to be kept. Only once.

        Raises:
            RecordingError: It cannot be written where it should be; the message says where it is.
        """
        self._display.clear()
        return self._seal()

    def _write(self, frame: Frame, step: Step, label: int, said: FrameLabels) -> None:
        """Write a frame, (rows, columns), and what came with it."""
        recorder, rest = self._recorder, self._pipeline.rest
        recorder.add(
            frame,
            step.t_s,
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
        if rest is not None and not self._rested:
            self._rested = True
            recorder.rest(rest)

    def _seal(self) -> bool:
        path = self._recorder.close(self._least_s)
        if path is not None:
            self._display.clear()
            _log.info("recorded into %s", path)
        return path is not None
