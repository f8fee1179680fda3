"""A pipeline for a sensor that there is no model for yet: it finds rest and touches, no more."""

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.bundles.golden import Golden
from controller.recognition.debounce import NULL, DebounceSettings
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Pipeline, Touch
from controller.recognition.preprocess import Image, PreprocessSettings, Window
from controller.sensors.base import Geometry


def pipeline(labels: tuple[str, ...], grid: Geometry, rate_hz: float) -> Pipeline:
    """Return a pipeline before its first frame."""
    return Pipeline(_bundle(labels, grid, rate_hz), NullModel(len(labels)), Mapping())


class NullModel:
    """Networks that see nothing."""

    def __init__(self, labels: int) -> None:
        """Know so many labels."""
        self._nothing = np.zeros(labels, dtype=np.float32)
        self._nothing[NULL] = 1.0

    def probabilities(self, window: Window) -> NDArray[np.float32]:
        """Return that nothing is done."""
        return self._nothing

    def touch(self, image: Image) -> Touch | None:
        """Return that nobody knows where."""
        return None


def _bundle(labels: tuple[str, ...], grid: Geometry, rate_hz: float) -> Bundle:
    """Return a bundle that holds no networks."""
    nothing = np.zeros(0, dtype=np.float32)
    window = max(1, round(rate_hz))
    return Bundle(
        labels=labels, rows=grid.rows, columns=grid.columns, pitch_mm=grid.pitch_mm,
        rate_hz=rate_hz, window=window,
        preprocess=PreprocessSettings(rate_hz=rate_hz, window=window),
        debounce=DebounceSettings(), mapping=Mapping(), card={}, gesture_onnx=b"",
        location_onnx=b"", golden=Golden(nothing, nothing, nothing, nothing), hash="",
    )  # fmt: skip
