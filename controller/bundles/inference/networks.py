"""Networks of a bundle: window to embedding to probabilities, image to touch, window to user.

They are checked with the bundle's golden vectors before use.
"""

import math

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.bundles.container import BundleError
from controller.bundles.head import EVERYBODY, Head
from controller.bundles.inference import onnxruntime_engine
from controller.bundles.inference.onnxruntime_engine import EngineError, Network
from controller.recognition.images.frames import Image, Window
from controller.recognition.pipeline import Networks, Probabilities
from controller.recognition.touch_input import TouchInput

TOLERANCE = 1e-5  # greatest difference from a golden output: processors round differently

_GESTURE = "gesture "  # before a user's name

Batch = NDArray[np.float32]  # (n, ...), inputs or outputs of a network; (n,) of one output


class NoGestures(Networks):
    """Networks that recognise no gesture, for what does not depend on them."""

    def __init__(self, classes: int) -> None:
        """Prepare the answer."""
        self._null: Probabilities = np.eye(1, classes, dtype=np.float32)[0]

    def probabilities(self, window: Window, user: str = "") -> Probabilities:
        """Return "null" for certain, (classes,)."""
        return self._null


class Recognizer(Networks):
    """The networks of a bundle, checked with its golden vectors before they are used.

    Attributes:
        engine: Name and version of ONNX Runtime, for recordings.
    """

    def __init__(self, bundle: Bundle) -> None:
        """Load and check all networks; BundleError if one answers differently."""
        try:
            self.engine = onnxruntime_engine.version()
        except EngineError as error:
            raise BundleError(f"a bundle {error}") from None
        golden = bundle.golden
        grid = golden.windows.shape[1:]
        embedding = _embedding(bundle)
        trained = _chain(embedding, bundle.head)
        _check_golden("gesture", trained, golden.windows, golden.probabilities)
        self._networks = {
            _GESTURE + user: _chain(embedding, bundle.head_of(user))
            for user in (EVERYBODY, *bundle.taught)
        }
        if bundle.locates:
            shape = bundle.touch.shape(*golden.images.shape[1:])
            located = _located(_network("location", bundle.location_onnx, shape, 2), bundle.touch)
            _check_golden("location", located, golden.images, golden.touches)
            self._networks["location"] = located
        if bundle.identifies:
            outputs = golden.people.shape[1]
            people = _network("user", bundle.user_onnx, grid, outputs, "Softmax")
            _check_golden("user", people, golden.windows, golden.people)
            self._networks["user"] = people

    def probabilities(self, window: Window, user: str = EVERYBODY) -> NDArray[np.float32]:
        """Return each label's probability, (classes,), for a window of z images.

        A user who has rows of their own in the head is answered by those.
        """
        network = self._networks.get(_GESTURE + user, self._networks[_GESTURE])
        return _finite(network(window[None])[0])

    def people(self, window: Window) -> NDArray[np.float32] | None:
        """Return each user's probability, (1 + users,), strangers first, if it knows anybody."""
        network = self._networks.get("user")
        return None if network is None else _finite(network(window[None])[0])

    def touch(self, image: Image) -> tuple[float, float] | None:
        """Return where a z image is touched, (x, y) in grid units; None: it has no positions."""
        network = self._networks.get("location")
        if network is None:
            return None
        x, y = network(image[None])[0].tolist()
        return (x, y) if math.isfinite(x + y) else None


def gestures_of(bundle: Bundle) -> Network:
    """Return the network from windows to probabilities, for all users."""
    return _chain(_embedding(bundle), bundle.head_of(EVERYBODY))


def _embedding(bundle: Bundle) -> Network:
    """Return the network from windows to embeddings; BundleError if it cannot be used."""
    grid, width = bundle.golden.windows.shape[1:], bundle.head.hidden.shape[1]
    return _network("embedding", bundle.embedding_onnx, grid, width)


def _chain(embedding: Network, head: Head) -> Network:
    """Return the network of both; numbers too large become NaN without a warning."""

    def probabilities(windows: Batch) -> Batch:
        with np.errstate(over="ignore", invalid="ignore"):
            return head.probabilities(embedding(windows))

    return probabilities


def _finite(output: Batch) -> Batch:
    """Return an output, (n,); "null" for certain if a number is not finite, as may happen."""
    if np.isfinite(output).all():
        return output
    certain = np.zeros_like(output)
    certain[0] = 1.0
    return certain


def _located(network: Network, settings: TouchInput) -> Network:
    """Return the location network for whole touch images."""

    def places(images: Batch) -> Batch:
        inputs, corners = settings.of(images)
        return network(inputs) + corners

    return places


def _network(
    name: str, model: bytes, shape: tuple[int, ...], outputs: int, last: str = ""
) -> Network:
    """Return a network of so many outputs for inputs of a shape; BundleError if it is another."""
    try:
        return onnxruntime_engine.checked(model, shape, outputs, last)
    except EngineError as error:
        raise BundleError(f"the {name} network {error}") from None


def _check_golden(name: str, network: Network, inputs: Batch, outputs: Batch) -> None:
    """Compare a network's outputs with the golden ones, (n, ...), one at a time as in use."""
    for one, expected in zip(inputs, outputs, strict=True):
        try:
            given = network(one[None])
        except EngineError as error:
            raise BundleError(f"the {name} network {error}") from None
        fits = isinstance(given, np.ndarray) and given.shape == (1, *expected.shape)
        if not fits or not np.abs(given[0] - expected).max() <= TOLERANCE:  # refuses NaN, too
            raise BundleError(
                f"the {name} network answers differently than when it was made; "
                "copy the bundle again, or train it with this version"
            )
