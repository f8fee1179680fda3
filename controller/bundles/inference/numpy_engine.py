"""NumPy inference engine: a forward pass, for boards and browsers without ONNX Runtime.

Every operator is a function of arrays whose first axis is the batch. The kernel positions of
convolutions are computed as index arrays once, when the network is opened.
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
Indices = NDArray[np.intp]  # (channels * kernel positions, places)
Operator = Callable[..., Batch]  # from the arrays of a node's inputs to its output


def version() -> str:
    """Return name and version, for recordings."""
    return f"numpy {np.__version__}"


def network(model: bytes, graph: Graph) -> Network:
    """Return a network, (n, ...) to (n, ...); GraphError if its operators do not fit together."""
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
    taps = _taps(shapes[node.inputs[0]][1:], Sliding.of(node, weights.shape[2:]))
    matrix, shape = weights.reshape(len(weights), -1), shapes[node.output][1:]

    def conv(values: Batch, _: Batch, bias: Batch | None = None) -> Batch:
        maps = matrix @ _gather(values, taps)
        if bias is not None:
            maps += bias[:, None]
        return maps.reshape(-1, *shape)

    return conv


def _taps(given: Shape, sliding: Sliding) -> Indices:
    """Return which of a flat input, (channels, axes...), meets each kernel position at each place.

    Indices are (channels * kernel positions, places); the input's size stands for padding.
    """
    size, axes = prod(given), tuple(range(1, len(given)))
    pads = [(0, 0), *zip(sliding.before, sliding.after, strict=True)]
    index = np.pad(np.arange(size).reshape(given), pads, constant_values=size)
    view = sliding_window_view(index, sliding.kernel, axis=axes)
    view = view[tuple(slice(None, None, step) for step in (1, *sliding.strides))]
    view = np.moveaxis(view, axes, range(-len(axes), 0))
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


def _softmax(values: Batch) -> Batch:
    powers = np.exp(values - values.max(axis=-1, keepdims=True))
    return np.asarray(powers / powers.sum(axis=-1, keepdims=True))


_OPERATORS: Final[dict[str, _Make]] = {
    "Add": _function(np.add),
    "Conv": _conv,
    "Flatten": _reshape,
    "Gemm": _dense,
    "Mul": _function(np.multiply),
    "Relu": _function(lambda values: np.maximum(values, np.float32(0.0))),
    "Reshape": _reshape,
    "Softmax": _function(_softmax),
    "Sub": _function(np.subtract),
    "Tanh": _function(np.tanh),
}
