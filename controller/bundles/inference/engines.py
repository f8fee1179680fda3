"""Inference engines: one module each, found by name.

    network = engines.open("numpy", model)
    answer = network(question)  # (1, ...) float32 to (1, ...) float32

Every engine is given the graph that `controller/bundles/inference/onnx_reader.py` found harmless.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.inference.onnx_reader import Graph

Network = Callable[[NDArray[np.float32]], NDArray[np.float32]]

STANDARD: Final = "onnxruntime"  # where it is installed
_MODULES: Final = {STANDARD: "onnxruntime_engine", "numpy": "numpy_engine"}
NAMES: Final = tuple(_MODULES)


class EngineError(ValueError):
    """The engine is not there, or cannot run this network; the message says why."""


def open_network(engine: str, model: bytes, graph: Graph) -> Network:
    """Return a network that answers one question at a time.

    Args:
        engine: One of `NAMES`.
        model: The ONNX file.
        graph: What `controller.bundles.inference.onnx_reader.read` found in it.

    Raises:
        EngineError: It cannot be run; the message is one sentence without a subject.
    """
    network: Network = _module(engine).network(model, graph)
    return network


def standard() -> str:
    """Return the engine for a bundle that was never measured here."""
    return STANDARD if importlib.util.find_spec(STANDARD) else "numpy"


def version(engine: str) -> str:
    """Return an engine's name and version, for recordings.

    Raises:
        EngineError: It is not installed.
    """
    words: str = _module(engine).version()
    return words


def _module(engine: str) -> Any:
    if engine not in _MODULES:
        raise EngineError(f"no engine is named {engine!r}; there are {', '.join(NAMES)}")
    try:
        return importlib.import_module(f"controller.bundles.inference.{_MODULES[engine]}")
    except ImportError as error:
        raise EngineError(f"the engine {engine} cannot be loaded: {error}") from None
