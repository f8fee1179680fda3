"""ONNX Runtime, the standard engine. The one module that imports it, for training too.

The wheels of ONNX Runtime report usage to their maker by default: a persistent device identifier
and a database of events in the user's cache folder, and uploads. The environment variable that
disables this is read when the library is loaded, so it is set before the import; child processes
inherit it. Builds for Windows apps have the function only.

One thread, in sequence, without spinning: with ten small runs a second, other settings only slow
the slowest runs down (measured: a 1 ms tail instead of 10 ms).
"""

import os

import numpy as np
from numpy.typing import NDArray

from controller.bundles.inference.engines import EngineError, Network
from controller.bundles.inference.onnx_reader import Graph

os.environ["ORT_DISABLE_TELEMETRY"] = "1"
import onnxruntime as ort

ort.disable_telemetry_events()

_FATAL = 4  # ONNX Runtime's severity above which it writes to standard error


def version() -> str:
    """Return name and version, for recordings."""
    return f"onnxruntime {ort.__version__}"


def session(model: bytes) -> ort.InferenceSession:
    """Return a session; errors of ONNX Runtime have no common class below Exception."""
    options = ort.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.execution_mode = ort.ExecutionMode.ORT_SEQUENTIAL
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = _FATAL
    return ort.InferenceSession(model, options, providers=["CPUExecutionProvider"])


def network(model: bytes, graph: Graph) -> Network:
    """Return a network, (n, ...) to (n, ...); EngineError if ONNX Runtime does not load it."""
    try:
        opened = session(model)
        (entry,), (exit_,) = opened.get_inputs(), opened.get_outputs()
    except Exception as error:  # see `session`
        raise EngineError(f"does not load: {first_line(error)}") from None

    def run(batch: NDArray[np.float32]) -> NDArray[np.float32]:
        try:
            output: NDArray[np.float32] = opened.run([exit_.name], {entry.name: batch})[0]
        except Exception as error:  # see `session`
            raise EngineError(f"does not run: {first_line(error)}") from None
        return output

    return run


def first_line(error: Exception) -> str:
    """Return the first line of an error's message."""
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
