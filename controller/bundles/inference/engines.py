"""Inference engines: one module each, found by name.

    network = engines.open_network("numpy", model, onnx_reader.read(model))
    outputs = network(inputs)  # (n, ...) float32 to (n, ...) float32

Every graph was checked by `onnx_reader` before.
"""

import importlib
import importlib.util
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.inference.onnx_reader import Graph

Network = Callable[[NDArray[np.float32]], NDArray[np.float32]]  # (n, ...) to (n, ...)

STANDARD: Final = "onnxruntime"  # if it is installed
_MODULES: Final = {STANDARD: "onnxruntime_engine", "numpy": "numpy_engine"}
NAMES: Final = tuple(_MODULES)


class EngineError(ValueError):
    """The engine is missing, or cannot run this network; the message has no subject."""


def open_network(engine: str, model: bytes, graph: Graph) -> Network:
    """Return a network, (n, ...) to (n, ...), of a file and its graph; EngineError if it fails."""
    network: Network = _module(engine).network(model, graph)
    return network


def standard() -> str:
    """Return the engine for a bundle that was not measured on this device."""
    return STANDARD if importlib.util.find_spec(STANDARD) else "numpy"


def version(engine: str) -> str:
    """Return an engine's name and version, for recordings; EngineError if it is missing."""
    return str(_module(engine).version())


def _module(engine: str) -> Any:
    if engine not in _MODULES:
        raise EngineError(f"no engine is named {engine!r}; there are {', '.join(NAMES)}")
    try:
        return importlib.import_module(f"controller.bundles.inference.{_MODULES[engine]}")
    except ImportError as error:
        raise EngineError(f"the engine {engine} cannot be loaded: {error}") from None
