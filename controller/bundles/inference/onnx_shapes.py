"""Shape inference and cost limits of a network, without running it.

A graph that `onnx_reader` accepts could still exhaust the memory, as by a convolution with pads of
a million. So every shape is computed first, by ONNX's rules, and the sums are compared with limits
far above the networks of a capacitive skin.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from controller.bundles.inference.onnx_reader import (
    LAST_STATE,
    MAX_RANK,
    Graph,
    GraphError,
    Node,
    Tensor,
)

MAX_ELEMENTS: Final = 16 << 20  # numbers in all arrays between operators together: 64 MiB
MAX_MACS: Final = 2_000_000_000  # multiplications of one output: about a second on a small board
STEP_MACS: Final = 4_000  # what a step of a GRU costs an engine, however small it is
_INTEGER_INPUTS: Final = ("Gather", "ReduceMean", "ReduceSum", "Reshape", "Squeeze", "Unsqueeze")

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
        numbers = node.inputs[:1] if node.op in _INTEGER_INPUTS else node.inputs
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
        elif node.op == "GRU":  # gates and states of all steps
            elements += 4 * math.prod(inputs[0][:2]) * shape[-1]
        elif node.op == "Softmax":  # transposed and back, unless over the last axis
            elements += 2 * math.prod(shape)
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
    if node.op == "Softmax":
        _axis(node.attributes.get("axis", -1), len(shape))
    return shape, math.prod(shape)


def _axis(axis: int, rank: int) -> int:
    """Return an axis from 0; ValueError if there is none of that number."""
    if not -rank <= axis < rank:
        raise ValueError(f"there is no axis {axis}")
    return axis % rank


def _listed(node: Node, weights: _Weights, rank: int) -> set[int]:
    """Return the axes in an attribute or a list in the file; ValueError if they are none."""
    found = node.attributes.get("axes")
    if found is None and len(node.inputs) == 2:
        array = weights.get(node.inputs[1])
        if array is not None and array.dtype.kind == "i" and array.size <= MAX_RANK:
            found = array.ravel().tolist()
    axes = {_axis(axis, rank) for axis in found or ()}
    if not axes or len(axes) != len(found or ()):
        raise ValueError("the axes are not a list of different ones that lies in the file")
    return axes


def _reduced(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    shape = inputs[0]
    axes = _listed(node, weights, len(shape))
    kept = [1 if axis in axes else size for axis, size in enumerate(shape)]
    if not node.attributes.get("keepdims", 1):
        kept = [size for axis, size in enumerate(shape) if axis not in axes]
    return tuple(kept), math.prod(shape)


def _squeeze(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    shape = inputs[0]
    axes = _listed(node, weights, len(shape))
    if any(shape[axis] != 1 for axis in axes):
        raise ValueError("only axes of one element can be left out")
    return tuple(size for axis, size in enumerate(shape) if axis not in axes), 0


def _unsqueeze(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    given = weights.get(node.inputs[1])
    rank = len(inputs[0]) + (0 if given is None else given.size)
    if rank > MAX_RANK:
        raise ValueError(f"more than {MAX_RANK} axes")
    axes, sizes = _listed(node, weights, rank), iter(inputs[0])
    return tuple(1 if axis in axes else next(sizes) for axis in range(rank)), 0


def _gather(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    shape, index = inputs[0], weights.get(node.inputs[1])
    if index is None or index.dtype.kind != "i" or index.ndim:
        raise ValueError("the index is not one number that lies in the file")
    axis = _axis(node.attributes.get("axis", 0), len(shape))
    _axis(int(index), shape[axis])
    return shape[:axis] + shape[axis + 1 :], math.prod(shape) // shape[axis]


def _transpose(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    (shape,) = inputs
    order = node.attributes.get("perm", tuple(range(len(shape)))[::-1])
    if sorted(order) != [*range(len(shape))]:
        raise ValueError(f"{order} is no order of the axes")
    return tuple(shape[axis] for axis in order), math.prod(shape)


def _matmul(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    one, other = inputs
    if min(len(one), len(other)) < 2 or one[-1] != other[-2]:
        raise ValueError(f"{one[-1]} columns against {other[-2:][0]} rows")
    outer, _ = _broadcast(node, [one[:-2], other[:-2]], weights)
    shape = (*outer, one[-2], other[-1])
    return shape, math.prod(shape) * one[-1]


def _pool(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    (shape,) = inputs
    if not 3 <= len(shape) <= 5:
        raise ValueError("three to five axes are supported")
    kernel = node.attributes.get("kernel_shape", ())
    if node.op == "GlobalAveragePool":
        kernel = shape[2:]
    elif len(kernel) != len(shape) - 2:
        raise ValueError("the kernel is not one number for each axis")
    elif max(node.attributes.get("pads", (0,))) >= min(kernel):
        raise ValueError("pads are as wide as the kernel")
    given = (*shape[:2], *_slid(node, kernel, shape[2:]))
    return given, math.prod(given) * math.prod(kernel)


def _gru(node: Node, inputs: list[Shape], weights: _Weights) -> tuple[Shape, int]:
    (steps, batch, width), units = inputs[0], node.attributes.get("hidden_size", 0)
    fits = [(1, 3 * units, width), (1, 3 * units, units), (1, 6 * units)]
    if units < 1 or len(inputs) < 3 or inputs[1:] != fits[: len(inputs) - 1]:
        raise ValueError(f"the weights are not those of {units} units in one direction")
    shape = (1, batch, units) if node.attributes[LAST_STATE] else (steps, 1, batch, units)
    return shape, steps * (batch * 3 * units * (width + units) + STEP_MACS)


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
    "AveragePool": _pool,
    "Conv": _conv,
    "Flatten": _flatten,
    "GRU": _gru,
    "Gather": _gather,
    "Gemm": _gemm,
    "GlobalAveragePool": _pool,
    "MatMul": _matmul,
    "MaxPool": _pool,
    "Mul": _broadcast,
    "ReduceMean": _reduced,
    "ReduceSum": _reduced,
    "Relu": _same,
    "Reshape": _reshape,
    "Sigmoid": _same,
    "Softmax": _same,
    "Squeeze": _squeeze,
    "Sub": _broadcast,
    "Tanh": _same,
    "Transpose": _transpose,
    "Unsqueeze": _unsqueeze,
}
