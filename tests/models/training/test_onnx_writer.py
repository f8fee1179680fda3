"""ONNX files are written again as the same network that was read."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles import bundle
from controller.bundles.inference import onnx_reader, onnxruntime_engine
from controller.bundles.inference.onnx_reader import Graph, Node
from models.training import onnx_writer

SHIPPED = bundle.read(bundle.default_path())
NUMBERS = st.integers(-(2**63), 2**63 - 1)


def same(one: Graph, other: Graph) -> bool:
    return (
        (one.nodes, one.input, one.shape, one.output)
        == (other.nodes, other.input, other.shape, other.output)
        and one.weights.keys() == other.weights.keys()
        and all(np.array_equal(one.weights[n], other.weights[n]) for n in one.weights)
    )


@pytest.mark.parametrize("model", [SHIPPED.embedding_onnx, SHIPPED.location_onnx])
def test_the_shipped_networks_come_back_as_they_were(model: bytes) -> None:
    read = onnx_reader.read(model)
    assert same(onnx_reader.read(onnx_writer.write(read, width=2)), read)


@settings(deadline=None)
@given(st.lists(NUMBERS, max_size=6), NUMBERS, st.floats(width=32, allow_nan=False))
def test_every_number_is_read_as_it_was_written(several: list[int], one: int, real: float) -> None:
    node = Node("Conv", ("x", "w"), "y", {"pads": tuple(several), "strides": one})
    weights = np.array([[np.clip(real, -3e38, 3e38)]], dtype=np.float32)
    given_ = Graph((node,), {"w": weights}, "x", (1, 1), "y")
    assert same(onnx_reader.read(onnx_writer.write(given_)), given_)


def _gemm(weights: np.ndarray) -> Graph:
    node = Node("Gemm", ("x", "w"), "y", {"transB": 1})
    return Graph((node,), {"w": weights.astype(np.float32)}, "x", (1, weights.shape[1]), "y")


def test_weights_that_sixteen_bits_hold_are_stored_with_sixteen() -> None:
    exact = np.random.default_rng(0).normal(size=(30, 40)).astype(np.float16)
    short, long = (onnx_writer.write(_gemm(w)) for w in (exact, exact + np.float32(1e-4)))
    assert len(long) - len(short) == pytest.approx(2 * exact.size, abs=60)
    assert same(onnx_reader.read(short), _gemm(exact))
    x = np.ones((3, 40), dtype=np.float32)
    seen = onnxruntime_engine.network(short)(x)
    np.testing.assert_allclose(seen, x @ exact.astype(np.float32).T, rtol=1e-5)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (b"w.half", b"w.HALF"),  # of one of two places: what is cast is not there
        (b"Cast", b"Tanh"),  # 16 bits that are not cast
    ],
)
def test_sixteen_bits_are_cast_to_float32_or_refused(before: bytes, after: bytes) -> None:
    model = onnx_writer.write(_gemm(np.ones((2, 3))))
    with pytest.raises(onnx_reader.GraphError):
        onnx_reader.read(model.replace(before, after, 1))


def test_the_onnx_package_finds_nothing_wrong() -> None:
    onnx = pytest.importorskip("onnx", reason="the onnx package checks the file")
    for model, width in ((SHIPPED.embedding_onnx, None), (SHIPPED.location_onnx, 2)):
        onnx.checker.check_model(
            onnx.load_from_string(onnx_writer.write(onnx_reader.read(model), width=width)),
            full_check=True,
        )
