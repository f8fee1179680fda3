"""ONNX Runtime, the standard engine: the one file that knows it.

One thread, in sequence, without spinning: at ten small runs a second anything else only
makes the slowest run slower (measured: a 1 ms tail instead of 10 ms).
"""

import numpy as np
import onnxruntime as ort
from numpy.typing import NDArray

from controller.engines import EngineError, Network
from controller.graph import Graph

_FATAL = 4  # ONNX Runtime's severity above which it writes to standard error


def version() -> str:
    """Return name and version, for recordings."""
    return f"onnxruntime {ort.__version__}"


def network(model: bytes, graph: Graph) -> Network:
    """Return a network as a function from a batch of one to a batch of one.

    Raises:
        EngineError: ONNX Runtime does not load it.
    """
    options = ort.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.execution_mode = ort.ExecutionMode.ORT_SEQUENTIAL
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = _FATAL
    try:
        session = ort.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        (entry,), (exit_,) = session.get_inputs(), session.get_outputs()
    except Exception as error:  # ONNX Runtime has a dozen kinds, all derived from Exception only
        raise EngineError(f"does not load: {first_line(error)}") from None

    def run(batch: NDArray[np.float32]) -> NDArray[np.float32]:
        try:
            answer: NDArray[np.float32] = session.run([exit_.name], {entry.name: batch})[0]
        except Exception as error:  # as above
            raise EngineError(f"does not run: {first_line(error)}") from None
        return answer

    return run


def first_line(error: Exception) -> str:
    """Return the first line of what an error says."""
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
