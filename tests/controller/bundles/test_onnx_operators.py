"""Operators of recurrent networks, attention and pooling: shapes as ONNX Runtime, cost bounded."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from controller.bundles.inference import onnx_reader, onnx_shapes, onnxruntime_engine
from controller.bundles.inference.onnx_reader import GraphError

onnx = pytest.importorskip("onnx")
helper, numpy_helper = onnx.helper, onnx.numpy_helper

Shape = tuple[int, ...]
Case = tuple[str, Shape, dict[str, np.ndarray], dict[str, Any]]  # operator, input, weights, rest


def whole(*numbers: int) -> np.ndarray:
    return np.array(numbers, dtype=np.int64)


def weights(draw: np.random.Generator, *shape: int) -> np.ndarray:
    return draw.normal(size=shape).astype(np.float32)


def gru(draw: np.random.Generator, linear: int) -> Case:
    steps, width, units = draw.integers(1, 9, 3).tolist()
    arrays = {
        "w": weights(draw, 1, 3 * units, width), "r": weights(draw, 1, 3 * units, units),
        "b": weights(draw, 1, 6 * units),
    }  # fmt: skip
    return "GRU", (1, steps, width), arrays, {"hidden_size": units, "linear_before_reset": linear}


def image(draw: np.random.Generator) -> Shape:
    return (1, *draw.integers(4, 9, 3).tolist())


def rows(draw: np.random.Generator) -> Shape:
    return (1, *draw.integers(2, 9, 2).tolist())


POOL = {"kernel_shape": [3, 2], "strides": [2, 1], "pads": [1, 0, 1, 1]}
CASES: dict[str, Callable[[np.random.Generator], Case]] = {
    "gru": lambda draw: gru(draw, 1),
    "gru of the first paper": lambda draw: gru(draw, 0),
    "average pool": lambda draw: ("AveragePool", image(draw), {}, POOL),
    "counted pads": lambda draw: ("AveragePool", image(draw), {}, {**POOL, "count_include_pad": 1}),
    "greatest": lambda draw: ("MaxPool", image(draw), {}, POOL),
    "mean of an image": lambda draw: ("GlobalAveragePool", image(draw), {}, {}),
    "mean": lambda draw: ("ReduceMean", image(draw), {}, {"axes": [1, -1], "keepdims": 0}),
    "sum": lambda draw: ("ReduceSum", rows(draw), {"a": whole(1)}, {"keepdims": 0}),
    "attention": lambda draw: ("Softmax", rows(draw), {}, {"axis": 1}),
    "order": lambda draw: ("Transpose", image(draw), {}, {"perm": [0, 3, 1, 2]}),
    "last step": lambda draw: ("Gather", rows(draw), {"i": np.array(-1)}, {"axis": 1}),
    "new axes": lambda draw: ("Unsqueeze", rows(draw), {"a": whole(0, -1)}, {}),
    "fewer axes": lambda draw: ("Squeeze", (1, 1, 7, 1), {"a": whole(1, -1)}, {}),
    "gate": lambda draw: ("Sigmoid", rows(draw), {}, {}),
    "product": lambda draw: (
        "MatMul", (1, 4, 3, 5), {"w": weights(draw, 4, 5, int(draw.integers(1, 9)))}, {},
    ),
}  # fmt: skip


def model(case: Case, outputs: tuple[str, ...] = ("y",)) -> bytes:
    """A network of one operator."""
    op, shape, arrays, attributes = case
    nodes = [helper.make_node(op, ["x", *arrays], list(outputs), **attributes)]
    if op == "GRU":  # whose first axis are the steps
        nodes.insert(0, helper.make_node("Transpose", ["x"], ["steps"], perm=[1, 0, 2]))
        nodes[1].input[0] = "steps"
    made = [numpy_helper.from_array(np.asarray(one), name) for name, one in arrays.items()]
    asked = helper.make_tensor_value_info("x", onnx.TensorProto.FLOAT, shape)
    given = helper.make_tensor_value_info("y", onnx.TensorProto.FLOAT, None)
    graph = helper.make_graph(nodes, "one", [asked], [given], made)
    opset = helper.make_opsetid("", 17)
    return bytes(helper.make_model(graph, opset_imports=[opset], ir_version=9).SerializeToString())


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", range(3))
def test_its_shape_is_that_which_onnx_runtime_gives(name: str, seed: int) -> None:
    draw = np.random.default_rng(seed)
    case = CASES[name](draw)
    data = model(case)
    sizes = onnx_shapes.sizes(onnx_reader.read(data))
    given = onnxruntime_engine.network(data)(weights(draw, *case[1]))
    assert sizes.shapes["y"] == given.shape
    assert sizes.elements >= given.size


def test_the_state_after_the_last_step_of_a_gru_is_an_output_too() -> None:
    case = gru(np.random.default_rng(1), 1)
    data = model(case, ("", "y"))
    last = onnxruntime_engine.network(data)(np.ones(case[1], np.float32))
    all_steps = onnxruntime_engine.network(model(case))(np.ones(case[1], np.float32))
    assert onnx_shapes.sizes(onnx_reader.read(data)).shapes["y"] == last.shape
    assert np.array_equal(last[0], all_steps[-1, 0])


def test_a_gru_costs_its_products_and_its_steps() -> None:
    """Of 10 steps with 4 inputs and 8 units: 10 times 3 gates of 8 units by 12 numbers."""
    arrays = {"w": np.zeros((1, 24, 4), np.float32), "r": np.zeros((1, 24, 8), np.float32)}
    read = onnx_reader.read(model(("GRU", (1, 10, 4), arrays, {"hidden_size": 8})))
    transposed = 10 * 4
    assert onnx_shapes.sizes(read).macs == 10 * (3 * 8 * 12 + onnx_shapes.STEP_MACS) + transposed


def chain(shape: Shape, *steps: tuple[str, dict[str, np.ndarray], dict[str, Any]]) -> bytes:
    """A network of several operators, one after the other."""
    nodes, made, last = [], [], "x"
    for number, (op, arrays, attributes) in enumerate(steps):
        names = [f"{name}{number}" for name in arrays]
        made += [numpy_helper.from_array(np.asarray(one), name)
                 for name, one in zip(names, arrays.values(), strict=True)]  # fmt: skip
        nodes.append(helper.make_node(op, [last, *names], [f"y{number}"], **attributes))
        last = f"y{number}"
    asked = helper.make_tensor_value_info("x", onnx.TensorProto.FLOAT, shape)
    given = helper.make_tensor_value_info(last, onnx.TensorProto.FLOAT, None)
    graph = helper.make_graph(nodes, "chain", [asked], [given], made)
    opset = helper.make_opsetid("", 17)
    return bytes(helper.make_model(graph, opset_imports=[opset], ir_version=9).SerializeToString())


ONE = {"w": np.zeros((1, 3, 1), np.float32), "r": np.zeros((1, 3, 1), np.float32)}
BOTH = {name: np.concatenate([array, array]) for name, array in ONE.items()}
MILLION: tuple[str, dict[str, np.ndarray], Any] = ("Reshape", {"s": whole(1_000_000, 1, 1)}, {})
HOSTILE: dict[str, tuple[bytes, str]] = {
    "a million steps of one unit": (
        chain((1, 1_000_000), MILLION, ("GRU", ONE, {"hidden_size": 1})), "more than",
    ),
    "an outer product": (
        chain((1, 9000, 1), ("MatMul", {"w": np.ones((1, 9000), np.float32)}, {})), "more than",
    ),
    "a product that repeats itself": (
        chain((1, 50, 1), ("MatMul", {"w": np.zeros((200_000, 1, 2), np.float32)}, {})),
        "more than",
    ),
    "pads beyond the kernel": (
        chain((1, 1, 5, 5), ("AveragePool", {}, {"kernel_shape": [3, 3], "pads": [9**9] * 4})),
        "as wide as the kernel",
    ),
    "a kernel of nothing": (
        chain((1, 1, 5, 5), ("AveragePool", {}, {"kernel_shape": [0, 0]})), "the kernel",
    ),
    "a kernel above the image": (
        chain((1, 1, 5, 5), ("MaxPool", {}, {"kernel_shape": [6, 6]})), "of the shape",
    ),
    "an axis that is not there": (
        chain((1, 4), ("ReduceSum", {"a": whole(5)}, {})), "there is no axis 5",
    ),
    "an axis twice": (chain((1, 4), ("ReduceSum", {"a": whole(1, -1)}, {})), "different ones"),
    "a list of a million axes": (
        chain((1, 4), ("ReduceSum", {"a": np.zeros(10**6, np.int64)}, {})), "different ones",
    ),
    "a rank above the limit": (
        chain((1, 4), ("Unsqueeze", {"a": whole(0, 1, 2, 3, 4)}, {})), "more than 6 axes",
    ),
    "an order with an axis twice": (
        chain((1, 4), ("Transpose", {}, {"perm": [0, 0]})), "no order of the axes",
    ),
    "an index beyond the end": (
        chain((1, 4), ("Gather", {"i": np.array(4)}, {"axis": 1})), "there is no axis 4",
    ),
    "both directions": (
        chain((1, 2, 3), ("GRU", BOTH, {"hidden_size": 1})), "in one direction",
    ),
    "units of nothing": (chain((1, 2, 3), ("GRU", ONE, {"hidden_size": 0})), "of 0 units"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_what_costs_too_much_or_does_not_fit_is_refused_before_it_runs(name: str) -> None:
    data, complaint = HOSTILE[name]
    with pytest.raises(GraphError, match=complaint):
        onnx_shapes.sizes(onnx_reader.read(data))


def test_a_network_for_one_input_answers_several_in_turn() -> None:
    data = chain((1, 4), ("Reshape", {"s": whole(1, 4)}, {}))
    batch = np.arange(12, dtype=np.float32).reshape(3, 4)
    assert np.array_equal(onnxruntime_engine.network(data)(batch), batch)
