"""NumPy inference engine: a forward pass, for boards and browsers without ONNX Runtime.

Every operator is a function of arrays whose first axis is the batch. The kernel positions of
convolutions and poolings are computed as index arrays once, when the network is opened.
"""

from collections.abc import Callable
from math import prod
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from controller.bundles.inference.engines import Network
from controller.bundles.inference.onnx_reader import Graph, Node
from controller.bundles.inference.onnx_shapes import Shape, Sliding, attribute, sizes

Batch = NDArray[np.float32]  # (batch, ...)
Indices = NDArray[np.intp]  # (channels, kernel positions, places)
Operator = Callable[..., Batch]  # from the arrays of a node's inputs to its output


def version() -> str:
    """Return name and version, for recordings."""
    return f"numpy {np.__version__}"


def network(model: bytes, graph: Graph) -> Network:
    """Return a network as a function from a batch, (n, ...), to a batch, (n, ...).

    Raises:
        GraphError: Its operators do not fit together.
    """
    shapes = sizes(graph).shapes
    steps = [(_OPERATORS[node.op](node, graph, shapes), node) for node in graph.nodes]

    def run(batch: Batch) -> Batch:
        values = {**graph.weights, graph.input: batch}
        for operator, node in steps:
            values[node.output] = operator(*(values[name] for name in node.inputs))
        return values[graph.output]

    return run


_Make = Callable[[Node, Graph, dict[str, Shape]], Operator]


def _function(operator: Operator) -> _Make:
    """Return the maker of an operator without attributes."""
    return lambda node, graph, shapes: operator


def _conv(node: Node, graph: Graph, shapes: dict[str, Shape]) -> Operator:
    """Return a convolution of (n, channels, ...): a gather of taps, then one matrix product."""
    weights = graph.weights[node.inputs[1]]
    groups = attribute(node, "group", 1)
    sliding = Sliding.of(node, weights.shape[2:])
    taps = _taps(shapes[node.inputs[0]][1:], sliding)
    places = taps.shape[-1]
    taps = taps.reshape(groups, -1, places)
    matrix = weights.reshape(groups, len(weights) // groups, -1)
    shape = shapes[node.output][1:]

    def conv(values: Batch, _: Batch, bias: Batch | None = None) -> Batch:
        maps = (matrix @ _gather(values, taps)).reshape(len(values), len(weights), places)
        if bias is not None:
            maps += bias[:, None]
        return maps.reshape(-1, *shape)

    return conv


def _pool(reduce: Callable[..., Batch]) -> _Make:
    """Return the maker of a pooling of (n, channels, ...) with a reduction over each kernel."""

    def make(node: Node, graph: Graph, shapes: dict[str, Shape]) -> Operator:
        given = shapes[node.inputs[0]]
        taps = _taps(given[1:], Sliding.of(node, attribute(node, "kernel_shape", ())))
        taps = taps.reshape(given[1], -1, taps.shape[-1])
        shape = shapes[node.output][1:]
        return lambda values: reduce(_gather(values, taps), axis=2).reshape(-1, *shape)

    return make


def _taps(given: Shape, sliding: Sliding) -> Indices:
    """Return the index into a flat input for each kernel position and output place.

    Args:
        given: Shape of the input, (channels, axes...).
        sliding: Geometry of the kernel.

    Returns:
        Indices, (channels * kernel positions, places); the input's size stands for padding.
    """
    size, axes = prod(given), tuple(range(1, len(given)))
    index = np.arange(size).reshape(given)
    pads = [(0, 0), *zip(sliding.before, sliding.after, strict=True)]
    index = np.pad(index, pads, constant_values=size)
    view = sliding_window_view(index, sliding.reach, axis=axes)
    steps = [slice(None, None, step) for step in (1, *sliding.strides, *sliding.dilations)]
    view = np.moveaxis(view[tuple(steps)], axes, range(-len(axes), 0))
    return view.reshape(given[0] * prod(sliding.kernel), -1)


def _gather(values: Batch, taps: Indices) -> Batch:
    """Return the values at some indices of each flat input, (n, *taps.shape); 0 for padding."""
    flat = np.zeros((len(values), values[0].size + 1), dtype=np.float32)
    flat[:, :-1] = values.reshape(len(values), -1)
    return flat.take(taps, axis=1)


def _dense(node: Node, graph: Graph, shapes: dict[str, Shape]) -> Operator:
    """Return a matrix product of (n, inputs), with a bias if there is one."""
    transposed = attribute(node, "transB", 0)

    def dense(values: Batch, matrix: Batch, bias: Batch | None = None) -> Batch:
        product = values @ (matrix.T if transposed else matrix)
        return product if bias is None else product + bias

    return dense


def _reshape(node: Node, graph: Graph, shapes: dict[str, Shape]) -> Operator:
    shape = shapes[node.output][1:]
    return lambda values, *_: values.reshape(-1, *shape)


def _transpose(node: Node, graph: Graph, shapes: dict[str, Shape]) -> Operator:
    order = attribute(node, "perm", tuple(reversed(range(len(shapes[node.output])))))
    return lambda values: values.transpose(order)


def _sigmoid(values: Batch) -> Batch:
    return np.asarray(1.0 / (1.0 + np.exp(-values)), dtype=np.float32)


def _softmax(values: Batch) -> Batch:
    powers = np.exp(values - values.max(axis=-1, keepdims=True))
    return np.asarray(powers / powers.sum(axis=-1, keepdims=True))


_OPERATORS: Final[dict[str, _Make]] = {
    "Add": _function(np.add),
    "AveragePool": _pool(np.mean),
    "Conv": _conv,
    "Div": _function(np.divide),
    "Flatten": _reshape,
    "Gemm": _dense,
    "Identity": _function(lambda values: values),
    "MatMul": _dense,
    "MaxPool": _pool(np.max),
    "Mul": _function(np.multiply),
    "Relu": _function(lambda values: np.maximum(values, np.float32(0.0))),
    "Reshape": _reshape,
    "Sigmoid": _function(_sigmoid),
    "Softmax": _function(_softmax),
    "Sub": _function(np.subtract),
    "Tanh": _function(np.tanh),
    "Transpose": _transpose,
}
