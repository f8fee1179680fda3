"""Engines: whichever runs a network, its answers are the same."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles import bundle
from controller.bundles.inference import engines, onnx_reader, onnx_shapes, onnx_writer
from controller.bundles.inference.engines import Network
from controller.bundles.inference.networks import Recognizer
from controller.bundles.inference.onnx_reader import Attribute, Graph, Node

SHIPPED = bundle.read(bundle.default_path())
GRAPHS = {"gesture": SHIPPED.gesture_onnx, "location": SHIPPED.location_onnx}


def opened(engine: str, name: str = "gesture") -> Network:
    model = GRAPHS[name]
    return engines.open_network(engine, model, onnx_reader.read(model))


def sliding(frames: int, seed: int) -> list[np.ndarray[tuple[int, ...], np.dtype[np.float32]]]:
    """The windows of a stream: each lost the oldest image of the one before, and has a new one."""
    noise = np.random.default_rng(seed).normal(1.0, 0.1, (frames, SHIPPED.rows, SHIPPED.columns))
    stream = noise.astype(np.float32)
    return [stream[i : i + SHIPPED.window][None] for i in range(frames - SHIPPED.window + 1)]


@pytest.mark.parametrize("engine", engines.NAMES)
def test_every_engine_gives_the_golden_answers(engine: str) -> None:
    recognizer = Recognizer(SHIPPED, engine)
    golden = SHIPPED.golden
    probabilities = [recognizer.probabilities(window) for window in golden.windows]
    touches = [recognizer.touch(image) for image in golden.images]
    assert np.abs(np.array(probabilities) - golden.probabilities).max() <= 1e-5
    assert np.abs(np.array(touches) - golden.touches).max() <= 1e-5


def test_engines_agree_while_the_window_slides() -> None:
    standard, streaming = opened("onnxruntime"), opened("numpy")
    for window in sliding(60, seed=1):
        assert np.abs(standard(window) - streaming(window)).max() < 1e-5


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_engines_agree_on_every_convolution(data: st.DataObject) -> None:
    axes = data.draw(st.integers(1, 3))
    sizes = st.lists(st.integers(1, 3), min_size=axes, max_size=axes)
    kernel, strides = data.draw(sizes), data.draw(sizes)
    pads = data.draw(st.lists(st.integers(0, 2), min_size=2 * axes, max_size=2 * axes))
    rng = np.random.default_rng(0)
    weights = {
        "k": rng.normal(size=(3, 2, *kernel)).astype(np.float32),
        "b": rng.normal(size=3).astype(np.float32),
    }
    window: dict[str, Attribute] = {"strides": tuple(strides), "pads": tuple(pads)}
    nodes = Node("Conv", ("x", "k", "b"), "c", window), Node("Flatten", ("c",), "y", {})
    graph = Graph(nodes, weights, "x", (1, 2, *(7,) * axes), "y")
    width = onnx_shapes.sizes(graph).shapes["y"][1]
    model = onnx_writer.write(graph, width=width)
    batch = rng.normal(size=(3, *graph.shape[1:])).astype(np.float32)
    ours, theirs = (engines.open_network(name, model, graph)(batch) for name in engines.NAMES)
    np.testing.assert_allclose(ours, theirs, rtol=1e-4, atol=1e-4)


def test_an_answer_is_the_askers_own_and_does_not_change_later() -> None:
    network = opened("numpy")
    first, second = sliding(SHIPPED.window + 1, seed=2)
    kept = network(first)
    copy = kept.copy()
    network(second)
    assert np.array_equal(kept, copy)
