"""Networks of a bundle: window to probabilities, image to touch, window to user.

They are proved with the bundle's golden vectors before use.
"""

import math

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle, BundleError
from controller.bundles.inference import engines, onnx_reader, onnx_shapes
from controller.bundles.inference.engines import EngineError, Network
from controller.bundles.inference.onnx_reader import GraphError
from controller.recognition.frames import Image, Window
from controller.recognition.pipeline import Networks

TOLERANCE = 1e-5  # greatest difference from a golden answer: processors round differently
A_FEW = 8  # golden questions to each network, where all were asked before


class Recognizer(Networks):
    """The networks of a bundle, proved with its golden vectors before they are used.

    Attributes:
        engine: Name and version of the inference engine, for recordings.
    """

    def __init__(self, bundle: Bundle, engine: str = "", *, proved: bool = False) -> None:
        """Load the networks and ask them the golden questions.

        Args:
            bundle: Networks and golden vectors.
            engine: One of `engines.NAMES`; "" is the standard one.
            proved: These bytes have answered all golden questions before; then a few of them show
                whether this machine still computes as it did.

        Raises:
            BundleError: A network does not load, or answers differently than when it was made.
        """
        engine = engine or engines.standard()
        try:
            self.engine = engines.version(engine)
        except EngineError as error:
            raise BundleError(str(error)) from None
        golden = bundle.golden
        models = {
            "gesture": (bundle.gesture_onnx, golden.windows, golden.probabilities),
            "location": (bundle.location_onnx, golden.images, golden.touches),
            "user": (bundle.user_onnx, golden.windows, golden.people),
        }
        for user, head in bundle.heads.items():
            models[f"gesture-{user}"] = (head, golden.windows, golden.heads[user])
        self._networks: dict[str, Network] = {}
        for name, (model, questions, answers) in models.items():
            if model or name == "gesture":
                step = max(1, len(questions) // A_FEW) if proved else 1
                network = _network(name, model, questions.shape[1:], answers.shape[1], engine)
                _prove(name, network, questions[::step], answers[::step])
                self._networks[name] = network

    def probabilities(self, window: Window, user: str = "") -> NDArray[np.float32]:
        """Return the probability of each label, (classes,), for a window of z images.

        Args:
            window: The latest images, (window, rows, columns).
            user: Name of a user, whose own network answers if there is one.
        """
        network = self._networks.get(f"gesture-{user}", self._networks["gesture"])
        return _finite(network(window[None])[0])

    def people(self, window: Window) -> NDArray[np.float32] | None:
        """Return the probability of each user, (1 + users,), people not enrolled first.

        None for a bundle that does not identify users.
        """
        network = self._networks.get("user")
        return None if network is None else _finite(network(window[None])[0])

    def touch(self, image: Image) -> tuple[float, float] | None:
        """Return the position of a touch in a z image, (x, y) in grid units.

        It is meaningless without a touch, and None for a bundle without positions.
        """
        network = self._networks.get("location")
        if network is None:
            return None
        x, y = network(image[None])[0].tolist()
        return (x, y) if math.isfinite(x + y) else None


def _finite(answer: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return an answer as it is, or certainly "null" if one of its numbers is not finite.

    Networks of unknown origin may give such answers, although their golden ones are right.
    """
    if np.isfinite(answer).all():
        return answer
    certain = np.zeros_like(answer)
    certain[0] = 1.0
    return certain


def _network(name: str, model: bytes, asked: tuple[int, ...], answers: int, engine: str) -> Network:
    """Return a network whose every operator was looked at before any engine saw it.

    Raises:
        BundleError: It is no plain network, too large a one, or one for other questions.
    """
    try:
        read = onnx_reader.read(model)
        given = onnx_shapes.sizes(read).shapes[read.output]
        if (read.shape, given) != ((1, *asked), (1, answers)):
            raise GraphError(
                f"makes {given[1:]} of {read.shape[1:]}; the bundle wants {(answers,)} of {asked}"
            )
        if name != "location" and read.nodes[-1].op != "Softmax":
            raise GraphError("does not end in Softmax, so its answers are no probabilities")
        return engines.open_network(engine, model, read)
    except (GraphError, EngineError) as error:
        raise BundleError(f"the {name} network {error}") from None


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
        except EngineError as error:
            raise BundleError(f"the {name} network {error}") from None
        fits = isinstance(given, np.ndarray) and given.shape == (1, *answer.shape)
        if not fits or not np.abs(given[0] - answer).max() <= TOLERANCE:  # NaN is refused as well
            raise BundleError(
                f"the {name} network answers differently than when it was made; "
                "copy the bundle again, or train it with this version"
            )
