"""Engines: whichever runs a network, its answers are the same."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles import bundle
from controller.bundles.inference import engines, onnx_reader
from controller.bundles.inference.engines import EngineError, Network
from controller.bundles.inference.networks import Recognizer

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


@settings(deadline=None, max_examples=30)
@given(st.lists(st.integers(0, 20), min_size=1, max_size=40), st.integers(0, 99))
def test_an_answer_never_depends_on_what_was_asked_before(order: list[int], seed: int) -> None:
    """Whole windows, windows that slide, windows asked twice: each has one answer, to the bit."""
    windows = sliding(30, seed)
    memory = opened("numpy")
    for i in order:
        for window in windows[i : i + 3]:  # slides on for a while, then jumps
            assert np.array_equal(memory(window), opened("numpy")(window))


def test_an_answer_is_the_askers_own_and_does_not_change_later() -> None:
    network = opened("numpy")
    first, second = sliding(SHIPPED.window + 1, seed=2)
    kept = network(first)
    copy = kept.copy()
    network(second)
    assert np.array_equal(kept, copy)


def test_an_unknown_engine_is_named_with_those_that_exist() -> None:
    with pytest.raises(EngineError, match="no engine is named 'abacus'; there are onnxruntime"):
        opened("abacus")
