"""Recorder of a run: its plan, labels, cues, display and provenance."""

from __future__ import annotations

import sys
from collections.abc import Callable
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

from controller import __version__
from controller.capture import cue_plan
from controller.capture.cue_plan import CuePlan
from controller.capture.cues import CueSession
from controller.capture.labels import Labeller
from controller.capture.run_files import RunFiles
from controller.capture.session_recorder import SessionRecorder
from controller.capture.status_line import StatusLine
from controller.keymap.terminal import Keyboard
from controller.recordings.recorder import Recorder
from controller.recordings.recording import Provenance, RecordingError

if TYPE_CHECKING:
    from argparse import Namespace

    from controller.recognition.frames import State
    from controller.recognition.pipeline import Pipeline
    from controller.runtime.assemble import Parts
    from controller.sensors.base import Sensor

FREE: Final = "free"  # the protocol of a recording without cues


def plan(options: Namespace, labels: tuple[str, ...]) -> CuePlan | None:
    """Return the cues of a recording, None without cues, or raise RecordingError."""
    if options.label and options.label not in labels[1:]:
        raise RecordingError(
            f"there is no label {options.label!r}; there are {', '.join(labels[1:])}"
        )
    return None if options.cues is None else cue_plan.read(options.cues, labels)


def recorder(
    parts: Parts, runs: RunFiles, sensor: Sensor, pipeline: Pipeline, keyboard: Keyboard | None
) -> SessionRecorder:
    """Return the recorder of a session from its first frame on."""
    plan = parts.plan
    cues = None if plan is None else CueSession.of(plan)
    return SessionRecorder(
        begin(parts, runs, sensor),
        pipeline,
        Labeller(parts.bundle.labels, button_label=parts.options.label, cues=cues),
        keyboard=keyboard,
        on_cue=parts.link.print_record,
        display=StatusLine(sys.stderr, pipeline.labels, keyboard=keyboard is not None),
    )


def begin(parts: Parts, runs: RunFiles, sensor: Sensor) -> Callable[[State], Recorder]:
    """Return a function that begins the next file of a session."""
    origin = _origin(parts, sensor)
    return lambda state: runs.begin(lambda path: Recorder(path, origin, state))


def _origin(parts: Parts, sensor: Sensor) -> Provenance:
    """Return the provenance of a recording that begins now."""
    grid, options = sensor.geometry, parts.options
    return Provenance(
        device_id=sensor.device_id,
        rows=grid.rows,
        columns=grid.columns,
        pitch_mm=grid.pitch_mm,
        rate_hz=sensor.rate_hz,
        labels=parts.bundle.labels,
        bundle=parts.bundle.hash,
        engine=parts.recognizer.engine,
        software=__version__,
        user=options.user,
        session=options.session,
        protocol=FREE if parts.plan is None else parts.plan.name,
        preset=sensor.preset,
        seed=sensor.seed,
        started=datetime.now(UTC).isoformat(timespec="milliseconds"),
        hardware=sensor.hardware,
    )
