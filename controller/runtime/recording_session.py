"""Recorder of a run: its plan, labels, cues, display and provenance."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Final

from controller.capture.cue_plan import CuePlan, read_plan
from controller.capture.labels import Labeller
from controller.capture.session_recorder import RunFiles, SessionRecorder, provenance
from controller.recordings.recorder import Recorder
from controller.recordings.recording import RecordingError

if TYPE_CHECKING:
    from controller.recognition.pipeline import Pipeline
    from controller.runtime.parts import Parts, RunOptions
    from controller.sensors.base import Sensor
    from controller.shared.aliases import State

FREE: Final = "free"  # the protocol of a recording without cues


def plan(options: RunOptions, labels: tuple[str, ...]) -> CuePlan | None:
    """Return the cues of a recording, None without cues, or raise RecordingError."""
    if options.label and options.label not in labels[1:]:
        raise RecordingError(
            f"there is no label {options.label!r}; there are {', '.join(labels[1:])}"
        )
    return None if options.cues is None else read_plan(options.cues, labels)


def recorder(parts: Parts, runs: RunFiles, sensor: Sensor, pipeline: Pipeline) -> SessionRecorder:
    """Return the recorder of a session from its first frame on."""
    plan = parts.plan
    cues = None if plan is None else plan.session()
    return SessionRecorder(
        begin(parts, runs, sensor),
        pipeline,
        Labeller(parts.bundle.labels, button_label=parts.options.label, cues=cues),
        on_cue=parts.link.print_record,
        say=partial(print, file=sys.stderr, flush=True),
    )


def begin(parts: Parts, runs: RunFiles, sensor: Sensor) -> Callable[[State], Recorder]:
    """Return a function that begins the next file of a session."""
    options = parts.options
    origin = provenance(
        sensor,
        parts.bundle.labels,
        parts.bundle.hash,
        parts.recognizer.engine,
        options.user,
        options.session,
        FREE if parts.plan is None else parts.plan.name,
    )
    return lambda state: runs.begin(lambda path: Recorder(path, origin, state))
