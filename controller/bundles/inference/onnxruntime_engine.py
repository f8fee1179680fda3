"""ONNX Runtime, which runs the networks. The one module that imports it, for training too.

    network = onnxruntime_engine.network(model)
    outputs = network(inputs)  # (n, ...) float32 to (n, ...) float32

`checked` refuses a graph that is not what a bundle's manifest says, before it is loaded.

The library is imported with the first network, because it takes a fifth of a second.

The wheels of ONNX Runtime report usage to their maker by default: a persistent device identifier
and a database of events in the user's cache folder, and uploads. The environment variable that
disables this is read when the library is loaded, so it is set before the import; child processes
inherit it. Builds for Windows apps have the function only.

One thread, in sequence, without spinning: with ten small runs a second, other settings only slow
the slowest runs down (measured: a 1 ms tail instead of 10 ms).
"""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.bundles.inference import onnx_reader, onnx_shapes
from controller.bundles.inference.onnx_reader import GraphError

os.environ["ORT_DISABLE_TELEMETRY"] = "1"

Network = Callable[[NDArray[np.float32]], NDArray[np.float32]]  # (n, ...) to (n, ...)

_FATAL = 4  # ONNX Runtime's severity above which it writes to standard error


class EngineError(ValueError):
    """ONNX Runtime is missing, or cannot run this network; the message has no subject."""


def version() -> str:
    """Return name and version, for recordings; EngineError if it is missing."""
    return f"onnxruntime {_library().__version__}"


def network(model: bytes) -> Network:
    """Return a network, (n, ...) to (n, ...); EngineError if ONNX Runtime does not load it."""
    library = _library()
    try:
        opened = _session(library, model)
        (entry,), (exit_,) = opened.get_inputs(), opened.get_outputs()
    except Exception as error:  # its errors have no common class below Exception
        raise EngineError(f"does not load: {first_line(error)}") from None

    def run(batch: NDArray[np.float32]) -> NDArray[np.float32]:
        if entry.shape[0] == 1 != len(batch):  # its shapes are for one input at a time
            return np.concatenate([run(one[None]) for one in batch])
        try:
            output: NDArray[np.float32] = opened.run([exit_.name], {entry.name: batch})[0]
        except Exception as error:  # as above
            raise EngineError(f"does not run: {first_line(error)}") from None
        return output

    return run


def checked(model: bytes, shape: tuple[int, ...], outputs: int, last: str = "") -> Network:
    """Return a network of so many outputs for inputs of a shape, whose operators were checked.

    `last` is the operator that it must end in, if any. EngineError if it is another network.
    """
    try:
        read = onnx_reader.read(model)
        given = onnx_shapes.sizes(read).shapes[read.output]
    except GraphError as error:
        raise EngineError(str(error)) from None
    if (read.shape, given) != ((1, *shape), (1, outputs)):
        raise EngineError(
            f"makes {given[1:]} of {read.shape[1:]}; the bundle wants {(outputs,)} of {shape}"
        )
    if last and read.nodes[-1].op != last:
        raise EngineError(f"does not end in {last}, so its answers are no probabilities")
    return network(model)


def folded(model: bytes) -> bytes:
    """Return a network without operators on shapes and constants; EngineError if it is none."""
    library = _library()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "folded.onnx")
        try:
            _session(library, model, str(path))
        except Exception as error:  # as above
            raise EngineError(f"does not load: {first_line(error)}") from None
        return path.read_bytes()


def first_line(error: Exception) -> str:
    """Return the first line of an error's message."""
    return (str(error).splitlines() or [type(error).__name__])[0][:200]


def _library() -> Any:
    try:
        import onnxruntime
    except ImportError as error:
        raise EngineError(
            f"needs ONNX Runtime, which cannot be loaded ({first_line(error)}); use a computer "
            "for which `pip install onnxruntime` finds a wheel"
        ) from None
    onnxruntime.disable_telemetry_events()
    return onnxruntime


def _session(library: Any, model: bytes, written: str = "") -> Any:
    """Return a session; `written` is a file for the model after constants were folded."""
    options = library.SessionOptions()
    if written:
        options.graph_optimization_level = library.GraphOptimizationLevel.ORT_ENABLE_BASIC
        options.optimized_model_filepath = written
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.execution_mode = library.ExecutionMode.ORT_SEQUENTIAL
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = _FATAL
    return library.InferenceSession(model, options, providers=["CPUExecutionProvider"])
