"""A recording as a sensor: its frames and button states at their recorded times."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from controller.recognition.images.frames import Frame
from controller.recordings import reader
from controller.recordings.recording import UNKNOWN, Recording
from controller.sensors.base import Sensor, SensorOptions
from controller.sensors.geometry import Geometry, SensorError


@dataclass(frozen=True)
class Options(SensorOptions):
    """Options of a replay: the recording."""

    path: Path | None = None


def create(options: Options, rate_hz: float | None = None) -> "Replay":
    """Return the sensor of a recording; SensorError if none is named, else RecordingError."""
    if options.path is None:
        raise SensorError("this sensor needs a recording; use --replay FILE")
    return Replay(reader.load(options.path))


class Replay(Sensor):
    """The sensor of a recording; frames are found by the time at which they were read."""

    source: Recording

    def __init__(self, source: Recording) -> None:
        origin = source.origin
        self.source = source
        self.geometry = Geometry(origin.rows, origin.columns, origin.pitch_mm)
        self.rate_hz = source.rate_hz
        self.device_id = origin.device_id
        self.signal = origin.signal

    def read(self, t_s: float) -> Frame:
        """Return the frame recorded at `t_s`, (rows, columns), pF; SensorError without one."""
        frame: Frame = self.source.frames[self._index(t_s)]
        return frame

    def button(self, t_s: float) -> str | None:
        """Return what the label button said at `t_s`, None if unknown; SensorError as `read`."""
        label = int(self.source.button[self._index(t_s)])
        return None if label == UNKNOWN else self.source.origin.labels[label]

    def _index(self, t_s: float) -> int:
        """Return which frame was recorded at `t_s`."""
        times = self.source.t
        index = int(np.searchsorted(times, t_s))
        if index == len(times) or times[index] != t_s:
            raise SensorError(f"the recording has no frame at {t_s:.3f} s")
        return index
