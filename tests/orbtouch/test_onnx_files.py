"""Networks of other programs become bundles, or are refused with the operator that is lacking."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import orbtouch
from controller.bundles import bundle
from controller.bundles.inference import onnxruntime_engine
from controller.bundles.inference.networks import Recognizer
from orbtouch import Network

onnx = pytest.importorskip("onnx")
helper, numpy_helper = onnx.helper, onnx.numpy_helper

CLASSES = ("press", "null", "pinch")
FLOAT = onnx.TensorProto.FLOAT
Node = tuple[str, str, str, dict[str, Any]]  # operator, inputs, outputs, attributes


def model(nodes: Sequence[Node], batch: object = "n", **arrays: np.ndarray) -> bytes:
    """A network from windows x of 40 images of 5 by 5 taxels to y."""
    made = [helper.make_node(op, i.split(","), o.split(","), **rest) for op, i, o, rest in nodes]
    asked = helper.make_tensor_value_info("x", FLOAT, [batch, 40, 5, 5])
    given = helper.make_tensor_value_info("y", FLOAT, [batch, 3])
    weights = [numpy_helper.from_array(np.asarray(one), name) for name, one in arrays.items()]
    graph = helper.make_graph(made, "own", [asked], [given], weights)
    opset = helper.make_opsetid("", 17)
    return bytes(helper.make_model(graph, opset_imports=[opset], ir_version=9).SerializeToString())


def draws(*shape: int) -> np.ndarray:
    return np.random.default_rng(len(shape)).normal(size=shape).astype(np.float32) / 4


def gru(batch: object = "n") -> bytes:
    """As PyTorch exports `Linear(GRU(x.flatten(2))[0][:, -1])`: with arithmetic on shapes."""
    nodes: list[Node] = [
        ("Shape", "x", "s", {}),
        ("Slice", "s,zero,two,zero", "head", {}),
        ("Concat", "head,rest", "flat", {"axis": 0}),
        ("Reshape", "x,flat", "rows", {"allowzero": 0}),
        ("Concat", "one,one,eight", "state", {"axis": 0}),
        ("ConstantOfShape", "state", "h", {}),
        ("Transpose", "rows", "steps", {"perm": [1, 0, 2]}),
        ("GRU", "steps,w,r,b,,h", "all,end", {"hidden_size": 8, "linear_before_reset": 1}),
        ("Squeeze", "all,one", "states", {}),
        ("Transpose", "states", "batch", {"perm": [1, 0, 2]}),
        ("Gather", "batch,last", "final", {"axis": 1}),
        ("Gemm", "final,o,c", "logits", {"alpha": 1.0, "beta": 1.0, "transB": 1}),
        ("Softmax", "logits", "y", {"axis": 1}),
    ]
    whole = {name: np.array([value]) for name, value in
             {"zero": 0, "one": 1, "two": 2, "eight": 8, "rest": -1}.items()}  # fmt: skip
    arrays = {"w": draws(1, 24, 25), "r": draws(1, 24, 8), "b": draws(1, 48)}
    return model(nodes, batch, **whole, **arrays, last=np.array(-1), o=draws(3, 8), c=draws(3))


def dense(*last: Node) -> bytes:
    """Flatten and Gemm, then what is given."""
    nodes: list[Node] = [("Flatten", "x", "f", {}), ("Gemm", "f,w", "g", {"transB": 1}), *last]
    return model(nodes, w=draws(3, 1000))


@pytest.mark.parametrize("batch", ["n", 1])
def test_a_gru_becomes_a_bundle_that_answers_as_the_file(batch: object) -> None:
    made = Network.from_onnx(gru(batch), classes=CLASSES)
    assert made.classes == ("null", "press", "pinch")
    loaded = bundle.parse(made._data)
    window = 1.0 - np.abs(draws(1, 40, 5, 5))
    expected = onnxruntime_engine.network(gru())(window)[0]
    given = Recognizer(loaded).probabilities(window[0])
    assert given == pytest.approx(expected[[1, 0, 2]], abs=1e-5)
    assert loaded.golden.probabilities.shape == (4, 3)


def test_attention_over_the_images_of_a_window_becomes_a_bundle() -> None:
    nodes: list[Node] = [
        ("Reshape", "x,rows", "r", {}),
        ("MatMul", "r,e", "m", {}),
        ("Tanh", "m", "h", {}),
        ("MatMul", "h,a", "scores", {}),
        ("Softmax", "scores", "shares", {"axis": 1}),
        ("Mul", "shares,h", "parts", {}),
        ("ReduceSum", "parts,one", "sum", {"keepdims": 0}),
        ("Gemm", "sum,o", "g", {"transB": 1}),
        ("Softmax", "g", "y", {"axis": -1}),
    ]
    arrays = {"e": draws(25, 16), "a": draws(16, 1), "o": draws(3, 16)}
    made = model(nodes, rows=np.array([0, 40, 25]), one=np.array([1]), **arrays)
    assert Network.from_onnx(made, classes=CLASSES).classes == ("null", "press", "pinch")


def test_it_plays_and_is_evaluated_as_any_other_network() -> None:
    made = Network.from_onnx(gru(), classes=CLASSES)
    session = orbtouch.simulate(minutes=0.5, gestures=("press", "pinch"))
    shares = made.probabilities(session)
    assert shares.shape == (len(session), 3)
    assert shares.sum(axis=1) == pytest.approx(1.0, abs=1e-5)


def test_a_network_without_softmax_ends_in_logits() -> None:
    bare = Network.from_onnx(dense(("Identity", "g", "y", {})), classes=CLASSES)
    whole = Network.from_onnx(dense(("Softmax", "g", "y", {"axis": 1})), classes=CLASSES)
    session = orbtouch.simulate(minutes=0.5, gestures=("press", "pinch"))
    assert np.allclose(bare.probabilities(session), whole.probabilities(session), atol=1e-6)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        (dense(("Erf", "g", "y", {})), "has the operator Erf; a device runs Add, "),
        (dense(("Sigmoid", "g", "y", {})), "ends in Sigmoid; expected are Softmax or logits"),
        (gru(8), "takes several windows at once; export it for one or any number"),
        (b"no model", "no ONNX file: "),
        ("missing.onnx", "no ONNX file: .*No such file"),
    ],
)
def test_what_a_device_cannot_run_is_said_in_a_sentence(source: bytes | str, said: str) -> None:
    with pytest.raises(orbtouch.Error, match=said):
        Network.from_onnx(source, classes=CLASSES)


def test_classes_are_as_many_as_outputs_with_null() -> None:
    with pytest.raises(orbtouch.Error, match='"null" among them'):
        Network.from_onnx(gru(), classes=("press", "pinch", "hold"))
    with pytest.raises(orbtouch.Error, match="the bundle wants"):
        Network.from_onnx(gru(), classes=("press", "null"))
