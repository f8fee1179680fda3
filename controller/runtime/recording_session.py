"""Recorder of a run: its labels and provenance."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from controller.capture.labels import Labeller
from controller.capture.session_recorder import RunFiles, SessionRecorder, provenance
from controller.recordings.recorder import Recorder

if TYPE_CHECKING:
    from controller.recognition.pipeline import Pipeline
    from controller.runtime.parts import Parts
    from controller.sensors.base import Sensor
    from controller.shared.aliases import State

FREE: Final = "free"  # the protocol of a recording without cues


def recorder(parts: Parts, runs: RunFiles, sensor: Sensor, pipeline: Pipeline) -> SessionRecorder:
    """Return the recorder of a session from its first frame on."""
    labeller = Labeller(parts.bundle.labels, button_label=parts.options.label)
    return SessionRecorder(begin(parts, runs, sensor), pipeline, labeller)


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
        FREE,
    )
    return lambda state: runs.begin(lambda path: Recorder(path, origin, state))
