"""Shape inference and cost limits of a network, without running it.

A graph that `onnx_reader` accepts could still exhaust the memory, as by a convolution with pads of
a million. So every shape is computed first, by ONNX's rules, and the sums are compared with limits
far above the networks of a capacitive skin.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from controller.bundles.inference.onnx_reader import MAX_RANK, Graph, GraphError, Node, Tensor

MAX_ELEMENTS: Final = 16 << 20  # numbers in all arrays between operators together: 64 MiB
MAX_MACS: Final = 2_000_000_000  # multiplications of one output: about a second on a small board

Shape = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Sizes:
    """The cost of one output."""

    shapes: dict[str, Shape]  # the shape of each array, by name, weights included
    elements: int  # numbers in the arrays between operators
    macs: int  # multiplications


def sizes(graph: Graph) -> Sizes:
    """Return the cost of a graph; GraphError if operators do not fit or exceed a limit."""
    shapes = {name: array.shape for name, array in graph.weights.items()}
    shapes[graph.input] = graph.shape
    elements, macs = math.prod(graph.shape), 0
    for node in graph.nodes:
        inputs = [shapes[name] for name in node.inputs]
        numbers = node.inputs[:1] if node.op == "Reshape" else node.inputs
        if any(name in graph.weights and graph.weights[name].dtype.kind != "f" for name in numbers):
            raise GraphError(f"has {node.op} of whole numbers; weights are float32")
        try:
            shape, cost = _RULES[node.op](node, inputs, graph.weights)
        except (ValueError, IndexError) as error:
            given = " and ".join(str(shape) for shape in inputs)
            raise GraphError(f"has {node.op} of {given}, which does not fit: {error}") from None
        if len(shape) > MAX_RANK or min(shape, default=1) < 1:
            raise GraphError(f"has {node.op} give an array of the shape {shape}")
        shapes[node.output] = shape
        elements += math.prod(shape)
        if node.op == "Conv":  # engines copy the input once for each position of the kernel
            elements += cost // shape[1]
        macs += cost
        if elements > MAX_ELEMENTS or macs > MAX_MACS:
            raise GraphError(
                f"needs more than {MAX_ELEMENTS} numbers or {MAX_MACS} multiplications for an "
                "answer; train a smaller network"
            )
    return Sizes(shapes, elements, macs)


_Weights = dict[str, Tensor]
_Rule = Callable[[Node, list[Shape], _Weights], tuple[Shape, int]]


def _slid(node: Node, kernel: Shape, shape: Shape) -> Shape:
    """Return the output sizes of a convolution along its axes; ValueError if it does not fit."""
    axes = len(kernel)
    strides = node.attributes.get("strides", (1,) * axes)
    pads = node.attributes.get("pads", (0,) * 2 * axes)
    if (len(strides), len(pads)) != (axes, 2 * axes):
        raise ValueError("strides or pads are not one for each axis")
    if min(strides + kernel) < 1 or min(pads) < 0:
        raise ValueError("strides and kernel must be above zero, pads not below")
    padded = map(sum, zip(shape, pads[:axes], pads[axes:], strict=True))
    along = zip(padded, kernel, strides, strict=True)
    return tuple((size - span) // stride + 1 for size, span, stride in along)


def _same(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    (shape,) = inputs
    if node.op == "Softmax" and node.attributes.get("axis", -1) not in (-1, len(shape) - 1):
        raise ValueError("only the last axis is supported")
    return shape, math.prod(shape)


def _broadcast(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    one, other = inputs
    rank = max(len(one), len(other))
    pairs = zip((1,) * (rank - len(one)) + one, (1,) * (rank - len(other)) + other, strict=True)
    shape = []
    for a, b in pairs:
        if a != b and 1 not in (a, b):
            raise ValueError(f"{a} against {b}")
        shape.append(max(a, b))
    return tuple(shape), math.prod(shape)


def _conv(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    data, kernel = inputs[0], inputs[1]
    if node.inputs[1] not in weights:
        raise ValueError("the kernel does not lie in the file")
    if len(kernel) != len(data) or not 3 <= len(data) <= 5 or data[1] != kernel[1]:
        raise ValueError(
            "as many axes and channels as the kernel, three to five axes, are supported"
        )
    if len(inputs) == 3 and inputs[2] != kernel[:1]:
        raise ValueError("the bias is not one for each map")
    shape = (data[0], kernel[0], *_slid(node, kernel[2:], data[2:]))
    return shape, math.prod(shape) * math.prod(kernel[1:])


def _gemm(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    (rows, inner), right = inputs[:2]
    depth, width = reversed(right) if node.attributes.get("transB", 0) else right
    if inner != depth:
        raise ValueError(f"{inner} against {depth}")
    if len(inputs) == 3 and inputs[2] not in ((width,), (1, width)):
        raise ValueError("the bias is not one for each column")
    return (rows, width), rows * inner * width


def _flatten(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    (shape,) = inputs
    if node.attributes.get("axis", 1) != 1:
        raise ValueError("only axis 1 is supported")
    return (shape[0], math.prod(shape[1:])), 0


def _reshape(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    shape = inputs[0]
    wanted = weights.get(node.inputs[1])
    if wanted is None or wanted.dtype.kind != "i" or wanted.ndim != 1 or len(wanted) > MAX_RANK:
        raise ValueError("the new shape is not a short list that lies in the file")
    new = [shape[i] if size == 0 else size for i, size in enumerate(wanted.tolist())]
    if new.count(-1) > 1 or min(new, default=1) < -1:
        raise ValueError(f"the new shape is {new}")
    if -1 in new:
        rest = math.prod(size for size in new if size != -1)
        new[new.index(-1)] = math.prod(shape) // rest
    if math.prod(new) != math.prod(shape):
        raise ValueError(f"the new shape is {new}")
    return tuple(new), 0


_RULES: Final[dict[str, _Rule]] = {
    "Add": _broadcast,
    "Conv": _conv,
    "Flatten": _flatten,
    "Gemm": _gemm,
    "Mul": _broadcast,
    "Relu": _same,
    "Reshape": _reshape,
    "Softmax": _same,
    "Sub": _broadcast,
    "Tanh": _same,
}
