"""A pipeline for a sensor without a model yet: it finds rest and touches, no more."""

import numpy as np
from numpy.typing import NDArray

from controller.recognition.debounce import NULL, DebounceSettings
from controller.recognition.frames import PreprocessSettings, Window
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Networks, Pipeline, PipelineSettings
from controller.sensors.base import Geometry


def pipeline(labels: tuple[str, ...], grid: Geometry, rate_hz: float) -> Pipeline:
    """Return a pipeline before its first frame."""
    preprocess = PreprocessSettings(rate_hz=rate_hz, window=max(1, round(rate_hz)))
    settings = PipelineSettings(labels, grid.rows, grid.columns, preprocess, DebounceSettings())
    return Pipeline(settings, NullModel(len(labels)), Mapping())


class NullModel(Networks):
    """Networks that recognise nothing."""

    def __init__(self, labels: int) -> None:
        """Answer for so many labels."""
        self._nothing = np.zeros(labels, dtype=np.float32)
        self._nothing[NULL] = 1.0

    def probabilities(self, window: Window, user: str = "") -> NDArray[np.float32]:
        """Return "null" for certain, (classes,)."""
        return self._nothing
