"""From window to probabilities and from image to touch: the one file that knows ONNX Runtime.

One thread, in sequence, without spinning: at ten small runs a second anything else only
makes the slowest run slower (measured: a 1 ms tail instead of 10 ms).
"""

from collections.abc import Callable

import numpy as np
import onnxruntime as ort
from numpy.typing import NDArray

from controller.bundle import Bundle, BundleError
from controller.preprocess import Image, Window

TOLERANCE = 1e-4  # greatest difference from a golden answer: processors round differently
_FATAL = 4  # ONNX Runtime's severity above which it writes to standard error


class Recognizer:
    """The two networks of a bundle, proved with its golden vectors before they are used."""

    def __init__(self, bundle: Bundle) -> None:
        """Load both networks and ask them the golden questions.

        Raises:
            BundleError: A network does not load, or answers differently than when it was made.
        """
        golden = bundle.golden
        self._gesture = _network(bundle.gesture_onnx, "gesture")
        _prove("gesture", self._gesture, golden.windows, golden.probabilities)
        self._location: Network | None = None
        if bundle.locates:
            self._location = _network(bundle.location_onnx, "location")
            _prove("location", self._location, golden.images, golden.touches)

    def probabilities(self, window: Window) -> NDArray[np.float32]:
        """Return the probability of each label, (classes,), for a window of z images."""
        answer: NDArray[np.float32] = self._gesture(window[None])[0]
        return answer

    def touch(self, image: Image) -> tuple[float, float] | None:
        """Return where a z image is touched, (x, y) in grid units; meaningless where it is not.

        None where the bundle locates nothing.
        """
        if self._location is None:
            return None
        x, y = self._location(image[None])[0]
        return float(x), float(y)


def engine() -> str:
    """Return name and version of what runs the networks, for recordings."""
    return f"onnxruntime {ort.__version__}"


Network = Callable[[NDArray[np.float32]], NDArray[np.float32]]


def _network(model: bytes, name: str) -> Network:
    """Return a network as a function from a batch of one to a batch of one."""
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
        raise BundleError(f"the {name} network does not load: {_first_line(error)}") from None

    def network(batch: NDArray[np.float32]) -> NDArray[np.float32]:
        answer: NDArray[np.float32] = session.run([exit_.name], {entry.name: batch})[0]
        return answer

    return network


def _prove(
    name: str, network: Network, questions: NDArray[np.float32], answers: NDArray[np.float32]
) -> None:
    """Ask a network its golden questions, one at a time as the device will.

    Raises:
        BundleError: It fails, or an answer is off by more than `TOLERANCE`.
    """
    for question, answer in zip(questions, answers, strict=True):
        try:
            given = network(question[None])
        except Exception as error:  # as above
            raise BundleError(f"the {name} network does not run: {_first_line(error)}") from None
        fits = isinstance(given, np.ndarray) and given.shape == (1, *answer.shape)
        if not fits or not np.abs(given[0] - answer).max() <= TOLERANCE:  # NaN is refused as well
            raise BundleError(
                f"the {name} network answers differently than when it was made; "
                "copy the bundle again, or train it anew on this version"
            )


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
