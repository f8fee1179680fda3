"""ONNX Runtime gives the golden answers, in the shapes that were worked out before."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles import bundle
from controller.bundles.container import BundleError
from controller.bundles.inference import onnx_reader, onnx_shapes, onnxruntime_engine
from controller.bundles.inference.networks import Recognizer
from tests.support import onnx_files

SHIPPED = bundle.read(bundle.default_path())


def test_the_golden_answers_are_given() -> None:
    recognizer = Recognizer(SHIPPED)
    golden = SHIPPED.golden
    probabilities = [recognizer.probabilities(window) for window in golden.windows]
    touches = [recognizer.touch(image) for image in golden.images]
    assert np.abs(np.array(probabilities) - golden.probabilities).max() <= 1e-5
    assert np.abs(np.array(touches) - golden.touches).max() <= 1e-5


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_shapes_of_every_convolution_are_those_of_onnx_runtime(data: st.DataObject) -> None:
    axes = data.draw(st.integers(1, 3))
    sizes = st.lists(st.integers(1, 3), min_size=axes, max_size=axes)
    kernel, strides = data.draw(sizes), data.draw(sizes)
    pads = data.draw(st.lists(st.integers(0, 2), min_size=2 * axes, max_size=2 * axes))
    rng = np.random.default_rng(0)
    weights = {
        "k": rng.normal(size=(3, 2, *kernel)).astype(np.float32),
        "b": rng.normal(size=3).astype(np.float32),
    }
    shape = (2, *(7,) * axes)

    def model(width: int) -> bytes:
        return onnx_files.model(
            onnx_files.node(
                "Conv", "x k b", "c", onnx_files.ints("strides", *strides),
                onnx_files.ints("pads", *pads),
            ),
            onnx_files.node("Flatten", "c", "y"),
            *(onnx_files.stored(name, values) for name, values in weights.items()),
            onnx_files.value(11, "x", 0, *shape),
            onnx_files.value(12, "y", 0, width),
        )  # fmt: skip

    width = onnx_shapes.sizes(onnx_reader.read(model(1))).shapes["y"][1]
    batch = rng.normal(size=(3, *shape)).astype(np.float32)
    assert onnxruntime_engine.network(model(width))(batch).shape == (3, width)


def test_without_onnx_runtime_a_sentence_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(BundleError, match="a bundle needs ONNX Runtime, which cannot be"):
        Recognizer(SHIPPED)
