"""NumPy as an engine: for boards without ONNX Runtime, and faster where a window only slides.

From frame to frame a window loses its oldest image and gains one. What a convolution made of the
others it need not make again, except at the window's ends, where its padding was. So the
convolutions at the beginning of a network remember their answers, slice by slice of time, and
compute what is new. A slice is always computed by the same multiplication of the same size,
whether it is new or all are: so what a network answers never depends on what it was asked before,
to the last bit.

Everything is laid out when the network is opened; an answer allocates next to nothing.
"""

from collections.abc import Callable, Sequence
from math import prod
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.inference.engines import Network
from controller.bundles.inference.onnx_reader import Graph, Node
from controller.bundles.inference.onnx_shapes import Shape, Sliding, ints, sizes

Values = NDArray[np.float32]
Indices = NDArray[np.intp]

_ZERO: Final = np.zeros((), dtype=np.float32)
_ELEMENTWISE: Final = {"Add": np.add, "Sub": np.subtract, "Mul": np.multiply, "Div": np.divide}


def version() -> str:
    """Return name and version, for recordings."""
    return f"numpy {np.__version__}"


def network(model: bytes, graph: Graph) -> Network:
    """Return a network as a function from a batch of one to a batch of one.

    Raises:
        GraphError: Its operators do not fit together.
    """
    shapes = sizes(graph).shapes
    head = _head(graph, shapes)
    if head is None:
        return _Plain(graph, shapes, graph.nodes, graph.input)
    graph = _in_time_order(graph, head)
    dense, made = _dense_layers(graph, head)
    last = graph.nodes[made - 1].output
    rest = _Plain(graph, shapes, graph.nodes[made:], last)

    def run(batch: Values) -> Values:
        values = head.run(batch)
        for layer in dense:
            values = layer(values)
        return rest(values[None, :-2])

    return run


# --- the beginning of a network that looks at a window: convolutions, slice by slice ---


class _Layer:
    """One convolution over time, and what it remembers.

    Attributes:
        period: Frames after which its slices have moved by one.
        relu: Whether what is negative becomes 0.
        size: Numbers in a slice.
        memory: For each frame of a period the slices as they are, flat, then a 0 and a 1.
        filled: For each of them the frame at which that was.
    """

    def __init__(
        self, weights: Values, period: int, taps: Indices, again: Indices, *, relu: bool
    ) -> None:
        """Lay it out.

        Args:
            weights: (maps, taps + 1); the last column is the bias.
            period: As the attribute.
            taps: Which numbers of the input each output sees, (slices, taps + 1, places).
            again: The slices that are computed for every frame; the others are remembered.
            relu: As the attribute.
        """
        self.period, self.relu = period, relu
        slices, _, places = taps.shape
        self.size = len(weights) * places
        self.memory = [_memory(slices * self.size) for _ in range(period)]
        self.filled = [-period] * period
        shape = (slices, len(weights), places)
        self._slices = [memory[:-2].reshape(shape) for memory in self.memory]
        self._all = _Work(weights, taps, np.arange(slices))
        self._new = _Work(weights, np.ascontiguousarray(taps[again]), again)

    def step(self, before: Values, frame: int) -> Values:
        """Return the slices of a frame, flat, from those of the layer before."""
        phase = frame % self.period
        memory, size = self.memory[phase], self.size
        if self.filled[phase] == frame - self.period:
            memory[: -size - 2] = memory[size:-2]
            self._new(before, self._slices[phase], relu=self.relu)
        else:
            self._all(before, self._slices[phase], relu=self.relu)
        self.filled[phase] = frame
        return memory

    def forget(self) -> None:
        """Take nothing for known."""
        self.filled = [-self.period] * self.period


class _Work:
    """One multiplication a slice, for some of the slices."""

    def __init__(self, weights: Values, taps: Indices, which: Indices) -> None:
        self._weights, self._taps = weights, taps
        self._seen = np.empty(taps.shape, dtype=np.float32)
        self._made = np.empty((len(taps), len(weights), taps.shape[2]), dtype=np.float32)
        self._runs = [(place, self._made[ours]) for place, ours in _runs(which.tolist())]

    def __call__(self, before: Values, slices: Values, *, relu: bool) -> None:
        """Compute the slices that are ours from the layer before."""
        before.take(self._taps, out=self._seen, mode="clip")
        np.matmul(self._weights, self._seen, out=self._made)
        for place, made in self._runs:
            if relu:
                np.maximum(made, _ZERO, out=slices[place])
            else:
                slices[place] = made


def _runs(which: Sequence[int]) -> list[tuple[slice, slice]]:
    """Return neighbours together: where they go, and which of ours they are."""
    runs: list[list[int]] = []
    for position in which:
        if runs and runs[-1][-1] == position - 1:
            runs[-1].append(position)
        else:
            runs.append([position])
    placed, at = [], 0
    for run in runs:
        placed.append((slice(run[0], run[-1] + 1), slice(at, at + len(run))))
        at += len(run)
    return placed


def _memory(size: int) -> Values:
    """Return zeros, then what a tap outside the grid sees, then what the bias is multiplied by."""
    memory = np.zeros(size + 2, dtype=np.float32)
    memory[-1] = 1.0
    return memory


class _Head:
    """The convolutions at the beginning of a network.

    Attributes:
        nodes: How many of the graph's operators it stands for, the flattening included.
        shape: What is flattened, (maps, slices, rows, columns).
    """

    def __init__(
        self, window: Shape, ready: "list[_Scalar]", layers: list[_Layer], nodes: int, shape: Shape
    ) -> None:
        self.nodes, self.shape = nodes, shape
        self._layers = layers
        self._first, *self._ready = ready or [(np.add, _ZERO)]
        self._window = b""
        self._image = prod(window[2:]) * 4  # bytes
        self._frame = 0
        self._input = _memory(prod(window))
        self._values = self._input[:-2].reshape(window)

    def run(self, batch: Values) -> Values:
        """Return the slices for a window, flat, then a 0 and a 1."""
        self._frame += 1
        window = batch.tobytes()
        if window[: -self._image] != self._window[self._image :]:
            for layer in self._layers:
                layer.forget()
        self._window = window
        values = self._values
        change, constant = self._first
        change(batch, constant, out=values)
        for change, constant in self._ready:
            change(values, constant, out=values)
        slices = self._input
        for layer in self._layers:
            slices = layer.step(slices, self._frame)
        return slices


_Scalar = tuple[Callable[..., Values], Values]


def _head(graph: Graph, shapes: dict[str, Shape]) -> _Head | None:
    """Return the head of a network of the common form; None for any other.

    The form: numbers added to and multiplied with the whole window, convolutions over time and
    place each with or without relu, and a flattening that dense layers follow.
    """
    if len(graph.shape) != 4 or graph.shape[0] != 1 or graph.shape[1] < 2:
        return None
    nodes = list(graph.nodes)
    ready: list[_Scalar] = []
    layers: list[_Layer] = []
    name, at, period = graph.input, 0, 1
    pure = (0, graph.shape[1] - 1)  # the slices that no padding has touched: first, last
    while at < len(nodes):
        node = nodes[at]
        if node.inputs[0] != name or _uses(graph, name) != 1:
            return None
        at, name, shape = at + 1, node.output, shapes[node.output]
        if node.op == "Reshape" and not layers and shape == (1, 1, *graph.shape[1:]):
            continue
        if node.op in _ELEMENTWISE and not layers and len(node.inputs) == 2:
            constant = graph.weights.get(node.inputs[1])
            if constant is None or constant.size != 1:
                return None
            ready.append((_ELEMENTWISE[node.op], constant.reshape(())))
        elif node.op == "Conv" and len(shape) == 5 and node.attributes.get("group", 1) == 1:
            relu = at < len(nodes) and nodes[at].op == "Relu" and nodes[at].inputs == (name,)
            if relu and _uses(graph, name) != 1:
                return None
            given = shapes[node.inputs[0]]
            layer, pure = _layer(graph, node, given, period, pure, relu=relu)
            period = layer.period
            layers.append(layer)
            if relu:
                at, name = at + 1, nodes[at].output
        elif node.op == "Flatten" and layers:
            follow = [n for n in nodes[at:] if name in n.inputs]
            dense = all(n.op == "Gemm" and n.inputs[1] in graph.weights for n in follow)
            if not follow or not dense or graph.output == name:
                return None
            return _Head(graph.shape, ready, layers, at, shapes[node.inputs[0]][1:])
        else:
            return None
    return None


def _uses(graph: Graph, name: str) -> int:
    return sum(node.inputs.count(name) for node in graph.nodes) + (name == graph.output)


def _layer(
    graph: Graph, node: Node, given: Shape, period: int, pure: tuple[int, int], *, relu: bool
) -> tuple[_Layer, tuple[int, int]]:
    """Return a convolution over time, and which of its slices no padding has touched."""
    weights = graph.weights[node.inputs[1]]
    sliding = Sliding.of(node, weights.shape[2:])
    out = sliding.out(given[2:])
    taps = _taps(given[1:], sliding, out, by_slice=True)
    taps = taps.reshape(taps.shape[0], out[0], -1).transpose(1, 0, 2)
    stride, pad, dilation = sliding.strides[0], sliding.before[0], sliding.dilations[0]
    reach = dilation * (sliding.kernel[0] - 1)
    inside = [
        q
        for q in range(out[0])
        if pure[0] <= q * stride - pad and q * stride - pad + reach <= pure[1]
    ]
    # One that no padding has touched, now and when it was one place later, is the same.
    known = set(inside) & {q - 1 for q in inside}
    again = np.array([q for q in range(out[0]) if q not in known], dtype=np.intp)
    matrix = _matrix(weights, graph, node)
    layer = _Layer(matrix, period * stride, np.ascontiguousarray(taps), again, relu=relu)
    return layer, (inside[0], inside[-1]) if inside else (0, -1)


def _matrix(weights: NDArray[np.float32], graph: Graph, node: Node) -> Values:
    """Return a convolution's weights, (maps, taps + 1), the bias last."""
    maps = len(weights)
    bias = graph.weights[node.inputs[2]] if len(node.inputs) == 3 else np.zeros(maps, np.float32)
    return np.ascontiguousarray(np.column_stack([weights.reshape(maps, -1), bias]), np.float32)


def _taps(given: Shape, sliding: Sliding, out: Shape, *, by_slice: bool) -> Indices:
    """Return which number of a flat input each output sees: (taps + 1, places).

    Args:
        given: The input's shape, (channels, axes...).
        sliding: How the kernel slides.
        out: The output's axes.
        by_slice: Whether the first axis, not the channel, is the slowest in memory.
    """
    channels, axes = given[0], given[1:]
    strides = [prod(axes[i + 1 :]) for i in range(len(axes))]
    plane = prod(axes)
    if by_slice:
        strides[0], plane = channels * prod(axes[1:]), prod(axes[1:])
    rank = len(axes)
    index: Indices = np.arange(channels).reshape(-1, *(1,) * (2 * rank)) * plane
    inside = np.ones((1,) * (2 * rank + 1), dtype=bool)
    for axis in range(rank):
        kernel = np.arange(sliding.kernel[axis]) * sliding.dilations[axis]
        start = np.arange(out[axis]) * sliding.strides[axis] - sliding.before[axis]
        shape = [1] * (2 * rank + 1)
        shape[1 + axis], shape[1 + rank + axis] = len(kernel), len(start)
        place = (kernel[:, None] + start[None, :]).reshape(shape)
        index = index + place * strides[axis]
        inside = inside & (place >= 0) & (place < axes[axis])
    size = prod(given)
    taps = np.where(inside, index, size).reshape(-1, prod(out))
    return np.vstack([taps, np.full((1, taps.shape[1]), size + 1)]).astype(np.intp)


def _in_time_order(graph: Graph, head: _Head) -> Graph:
    """Return the graph with the dense layers after the head in the order that the head gives."""
    name = graph.nodes[head.nodes - 1].output
    maps, slices, *places = head.shape
    weights = dict(graph.weights)
    for node in graph.nodes:
        if name in node.inputs:
            matrix = weights[node.inputs[1]]
            rows = matrix if node.attributes.get("transB") else matrix.T
            turned = rows.reshape(len(rows), maps, slices, *places).swapaxes(1, 2)
            turned = turned.reshape(len(rows), -1)
            weights[node.inputs[1]] = turned if node.attributes.get("transB") else turned.T
    return Graph(graph.nodes, weights, graph.input, graph.shape, graph.output)


class _Dense:
    """A dense layer; its bias is the weight of the 1 at the end of what it is given."""

    def __init__(self, weights: Values, bias: Values, *, relu: bool) -> None:
        empty = np.zeros((len(weights), 1), dtype=np.float32)
        self._weights = np.ascontiguousarray(np.hstack([weights, empty, bias.reshape(-1, 1)]))
        self._memory = _memory(len(weights))
        self._made = self._memory[:-2]
        self._relu = relu

    def __call__(self, values: Values) -> Values:
        """Return the answer, flat, then a 0 and a 1."""
        np.dot(self._weights, values, out=self._made)
        if self._relu:
            np.maximum(self._made, _ZERO, out=self._made)
        return self._memory


def _dense_layers(graph: Graph, head: _Head) -> tuple[list[_Dense], int]:
    """Return the dense layers that follow the head, one on the other, and where the rest begins."""
    at, layers = head.nodes, list[_Dense]()
    name = graph.nodes[at - 1].output
    while at < len(graph.nodes):
        node = graph.nodes[at]
        fits = node.op == "Gemm" and node.inputs[0] == name and _uses(graph, name) == 1
        if not fits or any(word not in graph.weights for word in node.inputs[1:]):
            break
        weights = graph.weights[node.inputs[1]]
        rows = weights if node.attributes.get("transB") else weights.T
        none = np.zeros(len(rows), dtype=np.float32)
        bias = graph.weights[node.inputs[2]] if len(node.inputs) == 3 else none
        at, name = at + 1, node.output
        after = graph.nodes[at] if at < len(graph.nodes) else None
        relu = after is not None and after.op == "Relu" and after.inputs == (name,)
        relu = relu and _uses(graph, name) == 1
        if relu:
            at, name = at + 1, graph.nodes[at].output
        layers.append(_Dense(rows, bias, relu=relu))
    return layers, at


# --- everything else: one operator after the other ---

_Step = Callable[[dict[str, Values]], None]


class _Plain:
    """Operators in their order, each into memory of its own."""

    def __init__(
        self, graph: Graph, shapes: dict[str, Shape], nodes: Sequence[Node], entry: str
    ) -> None:
        self._entry, self._exit = entry, graph.output
        self._values: dict[str, Values] = {
            name: np.ascontiguousarray(array)
            for name, array in graph.weights.items()
            if array.dtype.kind == "f"
        }
        self._steps = [_STEPS[node.op](node, graph, shapes) for node in nodes]

    def __call__(self, batch: Values) -> Values:
        """Return the answer to one question."""
        values = self._values
        values[self._entry] = batch
        for step in self._steps:
            step(values)
        return values[self._exit].copy()


def _conv(node: Node, graph: Graph, shapes: dict[str, Shape]) -> _Step:
    given, shape, name, output = shapes[node.inputs[0]], shapes[node.output], *_ends(node)
    weights = graph.weights.get(node.inputs[1])
    assert weights is not None
    groups = int(node.attributes.get("group", 1))  # type: ignore[arg-type]
    sliding = Sliding.of(node, weights.shape[2:])
    one = _taps((given[1] // groups, *given[2:]), sliding, shape[2:], by_slice=False)
    size = prod(given)
    part = size // groups
    taps = np.stack(
        [np.where(one < part, one + g * part, one + size - part) for g in range(groups)]
    )
    matrix = _matrix(weights, graph, node).reshape(groups, shape[1] // groups, -1)
    memory = _memory(size)
    seen = np.empty(taps.shape, dtype=np.float32)
    made = np.empty((groups, shape[1] // groups, taps.shape[2]), dtype=np.float32)

    def step(values: dict[str, Values]) -> None:
        memory[:-2] = values[name].ravel()
        np.take(memory, taps, out=seen, mode="clip")
        np.matmul(matrix, seen, out=made)
        values[output] = made.reshape(shape)

    return step


def _pool(node: Node, graph: Graph, shapes: dict[str, Shape]) -> _Step:
    given, shape, name, output = shapes[node.inputs[0]], shapes[node.output], *_ends(node)
    sliding = Sliding.of(node, ints(node, "kernel_shape", ()))
    one = _taps((1, *given[2:]), sliding, shape[2:], by_slice=False)[:-1]
    part = prod(given[2:])
    taps = np.stack([one + channel * part for channel in range(given[1])], axis=0)
    reduce = np.mean if node.op == "AveragePool" else np.max

    def step(values: dict[str, Values]) -> None:
        seen = values[name].ravel()[taps]
        values[output] = reduce(seen, axis=1).reshape(shape)

    return step


def _dense(node: Node, graph: Graph, shapes: dict[str, Shape]) -> _Step:
    name, output = _ends(node)
    made = np.empty(shapes[node.output], dtype=np.float32)
    other = node.inputs[1]
    weights = graph.weights.get(other)
    turned = bool(node.attributes.get("transB"))
    bias = graph.weights[node.inputs[2]].reshape(1, -1) if len(node.inputs) == 3 else None
    # A row at a time is how memory lies, and one row is asked for: a product with a vector.
    rows = None
    if weights is not None and shapes[name][0] == 1:
        rows = np.ascontiguousarray(weights if turned else weights.T)

    def step(values: dict[str, Values]) -> None:
        if rows is not None:
            np.dot(rows, values[name][0], out=made[0])
        else:
            matrix = values[other].T if turned else values[other]
            np.matmul(values[name], matrix, out=made)
        if bias is not None:
            np.add(made, bias, out=made)
        values[output] = made

    return step


def _elementwise(node: Node, graph: Graph, shapes: dict[str, Shape]) -> _Step:
    one, other = node.inputs
    output, made = node.output, np.empty(shapes[node.output], dtype=np.float32)
    change = _ELEMENTWISE[node.op]

    def step(values: dict[str, Values]) -> None:
        values[output] = change(values[one], values[other], out=made)

    return step


def _softmax(values: Values) -> Values:
    powers = np.exp(values - np.maximum.reduce(values, axis=-1, keepdims=True))
    powers /= np.add.reduce(powers, axis=-1, keepdims=True)
    return np.asarray(powers)


def _function(function: Callable[[Values], Values]) -> Callable[..., _Step]:
    """Return how an operator of one array is made into a step."""

    def make(node: Node, graph: Graph, shapes: dict[str, Shape]) -> _Step:
        name, output = _ends(node)

        def step(values: dict[str, Values]) -> None:
            values[output] = function(values[name])

        return step

    return make


def _reshape(node: Node, graph: Graph, shapes: dict[str, Shape]) -> _Step:
    name, output, shape = node.inputs[0], node.output, shapes[node.output]

    def step(values: dict[str, Values]) -> None:
        values[output] = values[name].reshape(shape)

    return step


def _transpose(node: Node, graph: Graph, shapes: dict[str, Shape]) -> _Step:
    rank = len(shapes[node.inputs[0]])
    order = ints(node, "perm", tuple(reversed(range(rank))))
    return _function(lambda values: np.ascontiguousarray(values.transpose(order)))(
        node, graph, shapes
    )


def _ends(node: Node) -> tuple[str, str]:
    return node.inputs[0], node.output


_STEPS: Final[dict[str, Callable[[Node, Graph, dict[str, Shape]], _Step]]] = {
    "Add": _elementwise,
    "AveragePool": _pool,
    "Conv": _conv,
    "Div": _elementwise,
    "Flatten": _reshape,
    "Gemm": _dense,
    "Identity": _function(lambda values: values),
    "MatMul": _dense,
    "MaxPool": _pool,
    "Mul": _elementwise,
    "Relu": _function(lambda values: np.maximum(values, np.float32(0.0))),
    "Reshape": _reshape,
    "Sigmoid": _function(lambda values: (1.0 / (1.0 + np.exp(-values))).astype(np.float32)),
    "Softmax": _function(_softmax),
    "Sub": _elementwise,
    "Tanh": _function(np.tanh),
    "Transpose": _transpose,
}
