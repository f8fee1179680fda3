"""Recorder of one session, file after file, none of which replaces another."""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from math import ceil
from pathlib import Path
from types import MappingProxyType
from typing import Final

from controller.capture.labels import FrameLabels, Labeller
from controller.recognition.images.frames import Frame
from controller.recognition.pipeline import Pipeline, Step
from controller.recordings import journal_file, writer
from controller.recordings.journal_file import LockedError
from controller.recordings.recorder import (
    Recorder,
    TakenError,
    refuse_taken,
    refuse_unwritable,
    taken,
)
from controller.recordings.recording import UNKNOWN, Provenance, RecordingError, software
from controller.sensors.base import Sensor
from controller.shared.aliases import Say, State
from controller.shared.cues import Cue, Phase

ANONYMOUS: Final = "unknown"  # the user in the names of files, if not given
LEAST_S: Final = 1.0  # a shorter session is not kept

_log = logging.getLogger("controller")


class SessionRecorder:
    """Recorder of one device from its first frame; `labels` are those of the label columns."""

    def __init__(
        self,
        begin: Callable[[State], Recorder],
        pipeline: Pipeline,
        labeller: Labeller,
        *,
        say: Say | None = None,
        words: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        """Begin the first file with `begin`, given the pipeline's state before its first frame.

        `say` is called with lines about the cues, in which `words` describe labels.
        RecordingError: it cannot be written.
        """
        self.labels = labeller.labels
        self._begin, self._pipeline, self._labeller = begin, pipeline, labeller
        self._say, self._words = say, words
        self._recorder = begin(pipeline.state())
        self._rested = False  # whether this file has its rest image
        self._least_s = LEAST_S  # of the session's first file; later ones are always kept

    @property
    def path(self) -> Path:
        """The file that is being recorded."""
        return self._recorder.path

    @property
    def full(self) -> bool:
        """Whether the file is full, and the next one is to begin."""
        return self._recorder.journal.full

    def ask(self, label: str) -> None:
        """Make a label the cue of the next frames; without a plan of cues."""
        self._labeller.given = self.labels.index(label)

    @property
    def done(self) -> bool:
        """Whether the whole plan has been recorded."""
        return self._labeller.done

    def turn(self) -> None:
        """Continue in a new file if the present one is full, or raise RecordingError."""
        if self.full:
            self.go_on(self._begin)

    def go_on(self, begin: Callable[[State], Recorder]) -> None:
        """Seal the file, continue in one that `begin` makes, or raise RecordingError."""
        self.close()
        self._begin = begin
        self._recorder = begin(self._pipeline.state())
        self._rested, self._least_s = False, 0.0

    def take(self, frame: Frame, step: Step, label: int, button: str | None) -> FrameLabels:
        """Record a frame as read, (rows, columns), with its true label, -1 unknown."""
        labels = self._labeller.label(
            step.t_s,
            button=button,
            felt=step.ready and not step.quiet,
            ready=step.ready,
        )
        self._write(frame, step, label, labels)
        if self._say is not None:
            for line in cue_lines(labels, step.t_s, self._words):
                self._say(line)
        return labels

    def mark(self, t_s: float, kind: str, text: str) -> None:
        """Record an event at `t_s`."""
        self._recorder.journal.add_mark(t_s, kind, text)

    def close(self) -> bool:
        """Seal the recording; return whether it was kept, or raise RecordingError."""
        path = self._recorder.close(self._least_s)
        if path is not None:
            _log.info("recorded into %s", path)
        return path is not None

    def _write(self, frame: Frame, step: Step, label: int, labels: FrameLabels) -> None:
        """Write a frame, (rows, columns), with its labels and marks."""
        journal, rest = self._recorder.journal, self._pipeline.rest
        sources = (label, labels.button, UNKNOWN, labels.cue)
        journal.add_frame(frame, step.t_s, step.frame, sources, step.touch)
        if step.command is not None:
            journal.add_command(step.command)
        for void in labels.voids:
            journal.exclude(void.from_s, void.to_s)
        for mark in labels.marks:
            journal.add_mark(mark.t_s, mark.kind, mark.text)
        if rest is not None and not self._rested:
            self._rested = True
            journal.add_rest(rest)


def cue_lines(said: FrameLabels, t_s: float, words: Mapping[str, str]) -> Iterator[str]:
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


class RunFiles:
    """The files of one run: a new one for each session, and when one is full."""

    def __init__(self, place: Path, user: str, session: str) -> None:
        """Prepare the files, and recover journals of a crash.

        `place` is a file, or a folder of files named by user ("" unknown) and session.
        RecordingError: nothing can be recorded there.
        """
        self._place, self._user, self._session = place, user or ANONYMOUS, session
        self._begun = False
        self._named = place.suffix == writer.SEALED and not place.is_dir()
        folder = place.parent if self._named else place
        if not self._named and not place.is_dir():
            raise RecordingError(
                f"there is no folder {place}; make it, or name a file that ends in {writer.SEALED}"
            )
        writer.next_free(folder, self._user, session)  # checks the names
        recover(folder)
        refuse_unwritable(folder)
        if self._named:
            refuse_taken(place)

    def begin(self, record: Callable[[Path], Recorder]) -> Recorder:
        """Return a recorder into the next free file; RecordingError if it cannot be written."""
        path = self.next()
        while True:
            try:
                recorder = record(path)
            except TakenError:
                before, path = path, self.next()
                if path == before:
                    raise
            else:
                self._begun = True
                return recorder

    def next(self) -> Path:
        """Return the next free file; another program may take it meanwhile."""
        if not self._named:
            return writer.next_free(self._place, self._user, self._session)
        if not self._begun:
            return self._place  # the first file has exactly the given name
        return next(path for path in writer.alternatives(self._place) if not taken(path))


def recover(folder: Path) -> None:
    """Recover the journals that crashes left in a folder, and log it; errors are logged only."""
    for journal in journal_file.leftovers(folder):
        try:
            _log.info("%s", journal_file.recover(journal).line)
        except LockedError:
            continue
        except RecordingError as error:
            _log.warning("%s", error)


def provenance(
    sensor: Sensor,
    labels: Sequence[str],
    bundle: str,
    engine: str,
    user: str,
    session: str,
    protocol: str,
) -> Provenance:
    """Return the provenance of a recording that begins now; `bundle` is a hash, "" for none."""
    grid = sensor.geometry
    return Provenance(
        sensor.device_id,
        grid.rows,
        grid.columns,
        grid.pitch_mm,
        sensor.rate_hz,
        tuple(labels),
        bundle,
        engine,
        software(),
        user,
        session,
        protocol,
        preset=sensor.preset,
        seed=sensor.seed,
        started=datetime.now(UTC).isoformat(timespec="milliseconds"),
        hardware=sensor.hardware,
        unit=sensor.signal.unit,
        sign=sensor.signal.sign,
    )
