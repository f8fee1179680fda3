"""From window to probabilities, from image to touch, and from window to who touches.

A bundle's networks, proved before use.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle, BundleError
from controller.bundles.inference import engines, onnx_reader, onnx_shapes
from controller.bundles.inference.engines import EngineError, Network
from controller.bundles.inference.onnx_reader import GraphError
from controller.recognition.pipeline import Networks
from controller.recognition.preprocess import Image, Window

TOLERANCE = 1e-5  # greatest difference from a golden answer: processors round differently
A_FEW = 8  # golden questions to each network, where all were asked before


class Recognizer(Networks):
    """The networks of a bundle, proved with its golden vectors before they are used.

    Attributes:
        engine: Name and version of what runs them, for recordings.
    """

    def __init__(self, bundle: Bundle, engine: str = "", *, proved: bool = False) -> None:
        """Load the networks and ask them the golden questions.

        Args:
            bundle: What was read.
            engine: One of `engines.NAMES`; "" is the standard one.
            proved: These bytes have answered all golden questions before; then a few of them show
                whether this machine still computes as it did.

        Raises:
            BundleError: A network does not load, or answers differently than when it was made.
        """
        golden, prove = bundle.golden, _prove_again if proved else _prove
        engine = engine or engines.standard()
        try:
            self.engine = engines.version(engine)
        except EngineError as error:
            raise BundleError(str(error)) from None
        asked, classes = (bundle.window, bundle.rows, bundle.columns), len(bundle.labels)
        self._gesture = _network("gesture", bundle.gesture_onnx, asked, classes, engine)
        prove("gesture", self._gesture, golden.windows, golden.probabilities)
        self._location: Network | None = None
        if bundle.locates:
            self._location = _network("location", bundle.location_onnx, asked[1:], 2, engine)
            prove("location", self._location, golden.images, golden.touches)
        self._people: Network | None = None
        if bundle.tells:
            outputs = 1 + len(bundle.users.names)
            self._people = _network("user", bundle.user_onnx, asked, outputs, engine)
            prove("user", self._people, golden.windows, golden.people)
        heads: dict[str, Network] = {}
        for user, model in bundle.heads.items():
            heads[user] = _network(f"gesture-{user}", model, asked, classes, engine)
            prove(f"gesture-{user}", heads[user], golden.windows, golden.heads[user])
        self._heads: Mapping[str, Network] = heads

    def probabilities(self, window: Window, user: str = "") -> NDArray[np.float32]:
        """Return the probability of each label, (classes,), for a window of z images.

        Args:
            window: The latest images.
            user: Whose own network to ask, where there is one.
        """
        network = self._heads.get(user, self._gesture)
        return _shares(network(window[None])[0])

    def people(self, window: Window) -> NDArray[np.float32] | None:
        """Return how probably each of the people touches, (1 + users,), anybody else first.

        None where the bundle cannot tell.
        """
        if self._people is None:
            return None
        return _shares(self._people(window[None])[0])

    def touch(self, image: Image) -> tuple[float, float] | None:
        """Return where a z image is touched, (x, y) in grid units; meaningless where it is not.

        None where the bundle locates nothing.
        """
        if self._location is None:
            return None
        x, y = self._location(image[None])[0].tolist()
        return (x, y) if math.isfinite(x + y) else None


def _shares(answer: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return an answer as it is, or "null" for certain if it has a number that is not finite.

    A network from a stranger may answer so to some windows, although its golden ones are right.
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


def _prove_again(
    name: str, network: Network, questions: NDArray[np.float32], answers: NDArray[np.float32]
) -> None:
    """Ask a network a few of its golden questions, from first to last; else as `_prove`."""
    step = max(1, len(questions) // A_FEW)
    _prove(name, network, questions[::step], answers[::step])


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
                "copy the bundle again, or train it anew on this version"
            )
