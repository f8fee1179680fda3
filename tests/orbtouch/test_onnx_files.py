"""Networks of other programs become bundles, or are refused with the operator that is lacking."""

import warnings
from collections.abc import Sequence
from pathlib import Path
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


def model(
    nodes: Sequence[Node], batch: object = "n", opset: Any = 17, **arrays: np.ndarray
) -> bytes:
    """A network from windows x of 40 images of 5 by 5 taxels to y."""
    made = [helper.make_node(op, i.split(","), o.split(","), **rest) for op, i, o, rest in nodes]
    asked = helper.make_tensor_value_info("x", FLOAT, [batch, 40, 5, 5])
    given = helper.make_tensor_value_info("y", FLOAT, [batch, 3])
    weights = [numpy_helper.from_array(np.asarray(one), name) for name, one in arrays.items()]
    graph = helper.make_graph(made, "own", [asked], [given], weights)
    known = [helper.make_opsetid("", opset)]
    return bytes(helper.make_model(graph, opset_imports=known, ir_version=9).SerializeToString())


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


def newer() -> bytes:
    """As PyTorch's newer exporter writes a GRU whose states are averaged: operator set 20."""
    turns = {"hidden_size": 8, "linear_before_reset": 1, "direction": "forward", "layout": 0}
    nodes: list[Node] = [
        ("Reshape", "x,flat", "rows", {"allowzero": 1}),
        ("Transpose", "rows", "steps", {"perm": [1, 0, 2]}),
        ("GRU", "steps,w,r,b,,h", "all,end", turns),
        ("Reshape", "all,states", "three", {"allowzero": 1}),
        ("ReduceMean", "three,first", "mean", {"keepdims": 0, "noop_with_empty_axes": 0}),
        ("Gemm", "mean,o,c", "y", {"alpha": 1.0, "beta": 1.0, "transA": 0, "transB": 1}),
    ]
    shapes = {"flat": np.array([1, 40, 25]), "states": np.array([40, 1, 8]), "first": np.array([0])}
    arrays = {"w": draws(1, 24, 25), "r": draws(1, 24, 8), "b": draws(1, 48), "o": draws(3, 8)}
    return model(nodes, 1, 20, **shapes, **arrays, c=draws(3), h=np.zeros((1, 1, 8), np.float32))


def dense(*last: Node) -> bytes:
    """Flatten and Gemm, then what is given."""
    nodes: list[Node] = [("Flatten", "x", "f", {}), ("Gemm", "f,w", "g", {"transB": 1}), *last]
    return model(nodes, w=draws(3, 1000))


def turning() -> bytes:
    """A GRU from the last image to the first, alone."""
    whole = onnx.load_from_string(newer())
    (direction,) = (one for one in whole.graph.node[2].attribute if one.name == "direction")
    direction.s = b"reverse"
    return bytes(whole.SerializeToString())


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


def test_a_network_of_pytorch_s_newer_exporter_becomes_a_bundle() -> None:
    made = Network.from_onnx(newer(), classes=CLASSES)
    window = 1.0 - np.abs(draws(1, 40, 5, 5))
    logits = onnxruntime_engine.network(newer())(window)[0]
    expected = np.exp(logits) / np.exp(logits).sum()
    given = Recognizer(bundle.parse(made._data)).probabilities(window[0])
    assert given == pytest.approx(expected[[1, 0, 2]], abs=1e-5)


@pytest.mark.train
@pytest.mark.parametrize("open_batch", [False, True])
def test_what_pytorch_s_newer_exporter_writes_is_taken(open_batch: bool, tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    pytest.importorskip("onnxscript")
    from torch import Tensor, nn

    class Gru(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.gru, self.last = nn.GRU(25, 8, batch_first=True), nn.Linear(8, 3)

        def forward(self, windows: Tensor) -> Tensor:
            logits: Tensor = self.last(self.gru(20 * (1 - windows.flatten(2)))[0][:, -1])
            return logits

    batch = ({0: torch.export.Dim("batch")},) if open_batch else None
    dense = nn.Sequential(nn.Flatten(), nn.Linear(1000, 8), nn.ReLU(), nn.Linear(8, 3))
    for number, network in enumerate((Gru(), dense)):
        file, windows = tmp_path / f"{number}.onnx", torch.ones(1 + open_batch, 40, 5, 5)
        with warnings.catch_warnings(action="ignore"):  # of the exporter's own parts
            torch.onnx.export(
                network.eval(), (windows,), file, dynamo=True, dynamic_shapes=batch, verbose=False
            )
        assert Network.from_onnx(file, classes=CLASSES).classes == ("null", "press", "pinch")


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
        (
            dense(("Erf", "g", "y", {})),
            "has the operator Erf, which no device runs; train it with",
        ),
        (dense(("Sigmoid", "g", "y", {})), "ends in Sigmoid; expected are Softmax or logits"),
        (turning(), "has GRU of direction=reverse; leave that out"),
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
