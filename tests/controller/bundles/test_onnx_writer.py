"""ONNX files are written again as the same network that was read."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles import bundle
from controller.bundles.inference import onnx_reader, onnx_writer
from controller.bundles.inference.onnx_reader import Graph, Node

SHIPPED = bundle.read(bundle.default_path())
NUMBERS = st.integers(-(2**63), 2**63 - 1)


def same(one: Graph, other: Graph) -> bool:
    return (
        (one.nodes, one.input, one.shape, one.output)
        == (other.nodes, other.input, other.shape, other.output)
        and one.weights.keys() == other.weights.keys()
        and all(np.array_equal(one.weights[n], other.weights[n]) for n in one.weights)
    )


@pytest.mark.parametrize("model", [SHIPPED.gesture_onnx, SHIPPED.location_onnx])
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


def test_the_onnx_package_finds_nothing_wrong() -> None:
    onnx = pytest.importorskip("onnx", reason="the onnx package checks the file")
    for model, width in ((SHIPPED.gesture_onnx, None), (SHIPPED.location_onnx, 2)):
        onnx.checker.check_model(
            onnx.load_from_string(onnx_writer.write(onnx_reader.read(model), width=width)),
            full_check=True,
        )
