"""Bounded reader of ONNX files: the network as a chain of operators, before any engine runs it.

An ONNX file is a protocol buffer, and the format allows far more than a network needs: references
to other files, functions, loops, arrays of any size. Here it is read field by field, and only the
fields and operators listed below are accepted: a short chain of known operators whose weights are
in the file. `onnx_shapes` computes its cost. Weights may be stored with 16 bits, each with a Cast
to float32; what is read has float32 only.

Sources: onnx.proto3 (version 1.17 of ONNX) for the fields, and the protocol buffers' encoding
for the bytes.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

MAX_NODES: Final = 100
MAX_ARRAYS: Final = 200
MAX_RANK: Final = 6
MAX_TEXT: Final = 200  # bytes of a name
MAX_NUMBERS: Final = 24  # in a list: the pads of a convolution over three axes are six
OPSETS: Final = range(13, 24)  # in these the operators below have one meaning
IR_VERSIONS: Final = range(7, 14)
_DOMAINS: Final = ("", "ai.onnx")  # of ONNX's own operators

# Each operator and its allowed attributes: integers, or the lists below.
OPERATORS: Final[dict[str, str]] = {
    "Add": "",
    "AveragePool": "kernel_shape strides pads count_include_pad",
    "Cast": "to",
    "Conv": "strides pads",
    "Flatten": "axis",
    "GRU": "hidden_size linear_before_reset",
    "Gather": "axis",
    "Gemm": "transB",
    "GlobalAveragePool": "",
    "MatMul": "",
    "MaxPool": "kernel_shape strides pads",
    "Mul": "",
    "ReduceMean": "axes keepdims",
    "ReduceSum": "keepdims",
    "Relu": "",
    "Reshape": "",
    "Sigmoid": "",
    "Softmax": "axis",
    "Squeeze": "",
    "Sub": "",
    "Tanh": "",
    "Transpose": "perm",
    "Unsqueeze": "",
}
LIST_ATTRIBUTES: Final = ("axes", "kernel_shape", "pads", "perm", "strides")
LAST_STATE: Final = "last"  # own attribute of a GRU: only its state after the last step is used

Tensor = NDArray[Any]  # float32 or int64, of any shape
_FLOAT32: Final = 1  # TensorProto.DataType
_TYPES: Final[dict[int, np.dtype[Any]]] = {  # FLOAT, INT64, FLOAT16
    _FLOAT32: np.dtype("<f4"),
    7: np.dtype("<i8"),
    10: np.dtype("<f2"),
}


class GraphError(ValueError):
    """The file is no supported network; the message has no subject."""


@dataclass(frozen=True, slots=True)
class Node:
    """One operator of the graph."""

    op: str  # one of `OPERATORS`
    # names of its input arrays: outputs of earlier nodes, weights, or the graph's input
    inputs: tuple[str, ...]
    output: str  # name of its output array
    attributes: dict[str, Any]  # values of its attributes


@dataclass(frozen=True, slots=True)
class Graph:
    """A network: one array in, one out."""

    nodes: tuple[Node, ...]  # in the order in which they run
    weights: dict[str, Tensor]  # arrays by name, float32 or int64
    input: str  # name of the input array
    shape: tuple[int, ...]  # shape of the input, the batch's axis as 1
    output: str  # name of the output array


def read(data: bytes) -> Graph:
    """Return the network in an ONNX file; GraphError if it is no plain network."""
    model = _read(data, _MODEL)
    _check_version("has the IR version", model.number(1), IR_VERSIONS)
    imports = model.messages(8, _OPSET)
    if len(imports) != 1 or imports[0].text(1) not in _DOMAINS:
        raise GraphError("imports other operators than ONNX's own; export it without them")
    _check_version("uses operator set", imports[0].number(2), OPSETS)
    graphs = model.messages(7, _GRAPH)
    if len(graphs) != 1:
        raise GraphError("has no graph, or more than one")
    return _graph(graphs[0])


def _check_version(what: str, version: int, known: range) -> None:
    if version not in known:
        raise GraphError(
            f"{what} {version}; {known[0]} to {known[-1]} are understood: export it for one of them"
        )


# --- the messages of onnx.proto3: the known fields and their wire types ---

_VARINT, _BYTES = 0, 2  # the wire types of protocol buffers that a network needs
_MAX_FIELDS: Final = MAX_NODES + MAX_ARRAYS + 100


@dataclass(frozen=True, slots=True)
class _Form:
    """A message: the wire type of each known field, and the fields that may be repeated."""

    name: str
    wires: dict[int, int]
    many: frozenset[int]


def _form(name: str, *, numbers: str = "", data: str = "", many: str = "") -> _Form:
    """Return a form from the numbers of its fields, by content."""
    wires = dict.fromkeys(map(int, numbers.split()), _VARINT)
    wires |= dict.fromkeys(map(int, data.split()), _BYTES)
    return _Form(name, wires, frozenset(map(int, many.split())))


_MODEL = _form("a model", numbers="1 5", data="2 3 4 6 7 8", many="8")
_OPSET = _form("an operator set", numbers="2", data="1")
_GRAPH = _form("a graph", data="1 2 5 10 11 12 13", many="1 5 11 12 13")
_NODE = _form("an operator", data="1 2 3 4 5 6 7", many="1 2 5")
_ATTRIBUTE = _form("a setting", numbers="3 8 20", data="1 13", many="8")
_TENSOR = _form("an array", numbers="1 2", data="8 9 12", many="1")
_VALUE = _form("an input", data="1 2 3")
_TYPE = _form("a type", data="1 6")
_TENSOR_TYPE = _form("a type", numbers="1", data="2")
_SHAPE = _form("a shape", data="1", many="1")
_DIMENSION = _form("an axis", numbers="1", data="2 3")
_INT, _INTS = 2, 7  # AttributeProto.AttributeType


@dataclass(frozen=True, slots=True)
class _Message:
    """The fields of one message, by number, in their order."""

    fields: dict[int, list[Any]]

    def data(self, field: int) -> memoryview:
        """Return bytes; none if the field is missing."""
        return next(iter(self.fields.get(field, [])), memoryview(b""))

    def numbers(self, field: int) -> tuple[int, ...]:
        """Return signed numbers of 64 bits."""
        return tuple(v - (1 << 64) if v >= 1 << 63 else v for v in self.fields.get(field, []))

    def number(self, field: int) -> int:
        """Return a signed number; 0 if the field is missing."""
        return (*self.numbers(field), 0)[0]

    def texts(self, field: int) -> tuple[str, ...]:
        """Return names."""
        return tuple(_name(data) for data in self.fields.get(field, []))

    def text(self, field: int) -> str:
        """Return a name; "" if the field is missing."""
        return _name(self.data(field))

    def messages(self, field: int, form: _Form) -> "list[_Message]":
        """Return messages inside this one."""
        return [_read(data, form) for data in self.fields.get(field, [])]


def _read(data: bytes | memoryview, form: _Form) -> _Message:
    """Return a message of a form.

    A repeated field where one is expected is refused: readers differ in which one counts.
    """
    fields: dict[int, list[Any]] = {}
    for count, (number, wire, value) in enumerate(_fields(memoryview(data))):
        if count >= _MAX_FIELDS:
            raise GraphError(f"has {form.name} with more than {_MAX_FIELDS} fields")
        if number not in form.wires:
            raise GraphError(f"has {form.name} with field {number}, which no plain network needs")
        values = fields.setdefault(number, [])
        if values and number not in form.many:
            raise GraphError(f"is damaged: {form.name} has field {number} twice")
        if wire == form.wires[number]:
            values.append(value)
        elif wire == _BYTES and number in form.many:
            values.extend(_packed(value))
        else:
            raise GraphError("is damaged: a field has another wire type than the format")
        if form.wires[number] == _VARINT and len(values) > MAX_NUMBERS:
            raise GraphError(f"has a list of more than {MAX_NUMBERS} numbers")
    return _Message(fields)


def _fields(data: memoryview) -> Iterator[tuple[int, int, Any]]:
    """Yield (number, wire type, value) of each field; every length is checked first."""
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        wire = key & 7
        if wire not in (_VARINT, _BYTES):
            raise GraphError("is damaged, or no ONNX file of a plain network")
        value: Any
        value, at = _varint(data, at)
        if wire == _BYTES:
            size = value
            if size > len(data) - at:
                raise GraphError("is damaged: it ends too soon")
            value, at = data[at : at + size], at + size
        yield key >> 3, wire, value


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    """Return the number at an offset, at most 64 bits, and the offset of its end."""
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(data):
            raise GraphError("is damaged: it ends too soon")
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & 0xFFFFFFFFFFFFFFFF, at
    raise GraphError("is damaged: a number has no end")


def _packed(data: memoryview) -> list[int]:
    """Return the first numbers of a packed list, at most one more than the limit."""
    numbers: list[int] = []
    at = 0
    while at < len(data) and len(numbers) <= MAX_NUMBERS:
        value, at = _varint(data, at)
        numbers.append(value)
    return numbers


def _name(data: memoryview) -> str:
    if len(data) > MAX_TEXT:
        raise GraphError(f"has a name of {len(data)} bytes; {MAX_TEXT} are enough")
    try:
        return bytes(data).decode()
    except UnicodeDecodeError:
        raise GraphError("is damaged: a name is no text") from None


# --- the graph ---


def _graph(graph: _Message) -> Graph:
    if len(graph.fields.get(1, [])) > MAX_NODES or len(graph.fields.get(5, [])) > MAX_ARRAYS:
        raise GraphError(f"has more than {MAX_NODES} operators or {MAX_ARRAYS} arrays")
    weights: dict[str, Tensor] = {}
    for tensor in graph.messages(5, _TENSOR):
        name, array = _tensor(tensor)
        if not name or name in weights:
            raise GraphError(f"has two arrays named {name!r}, or one without a name")
        weights[name] = array
    inputs = [_value(value) for value in graph.messages(11, _VALUE)]
    outputs = [_value(value) for value in graph.messages(12, _VALUE)]
    free = [(name, shape) for name, shape in inputs if name not in weights]
    if len(free) != 1 or len(outputs) != 1:
        raise GraphError(f"takes {len(free)} arrays and gives {len(outputs)}; expected is one each")
    (name, shape), (output, _) = free[0], outputs[0]
    if len(shape) < 2 or not all(shape[1:]):
        raise GraphError(f"takes {name!r} of a shape that it leaves open; only the batch may be")
    nodes = tuple(_node(node) for node in graph.messages(1, _NODE))
    nodes, weights = _widened(nodes, weights)
    known = {*weights, name}
    for node in nodes:
        if missing := [word for word in node.inputs if word not in known]:
            raise GraphError(f"has {node.op} take {missing[0]!r}, which nothing gave before it")
        if node.output in known:
            raise GraphError(f"has two arrays named {node.output!r}")
        known.add(node.output)
    if output not in {node.output for node in nodes}:
        raise GraphError(f"gives {output!r}, which none of its operators makes")
    return Graph(nodes, weights, name, (1, *shape[1:]), output)


def _widened(
    nodes: tuple[Node, ...], weights: dict[str, Tensor]
) -> tuple[tuple[Node, ...], dict[str, Tensor]]:
    """Return operators and weights, those of 16 bits as the float32 that they are cast to."""
    casts = {node.inputs[0]: node for node in nodes if node.op == "Cast"}
    halves = {name for name, array in weights.items() if array.dtype == np.float16}
    plain = all(node.attributes == {"to": _FLOAT32} for node in casts.values())
    if set(casts) != halves or not plain or len(casts) != sum(node.op == "Cast" for node in nodes):
        raise GraphError("has weights of 16 bits that are not each cast to float32 once")
    if taken := {node.output for node in casts.values()} & set(weights):
        raise GraphError(f"has two arrays named {taken.pop()!r}")
    wide = {
        casts[name].output if name in halves else name:
            array.astype(np.float32) if name in halves else array
        for name, array in weights.items()
    }  # fmt: skip
    if len(wide) != len(weights):
        raise GraphError("has two arrays of one name")
    return tuple(node for node in nodes if node.op != "Cast"), wide


def _node(node: _Message) -> Node:
    op, domain = node.text(4), node.text(7)
    if op not in OPERATORS or domain not in _DOMAINS:
        raise GraphError(
            f"has the operator {domain + '.' if domain else ''}{op}; a device runs "
            f"{', '.join(OPERATORS)} only"
        )
    inputs, outputs = node.texts(1), node.texts(2)
    attributes: dict[str, Any] = {}
    if op == "GRU":
        attributes[LAST_STATE] = outputs[:1] == ("",)
        outputs = outputs[attributes[LAST_STATE] :]
    most = 4 if op == "GRU" else 3
    if len(outputs) != 1 or not 1 <= len(inputs) <= most or not all((*inputs, *outputs)):
        raise GraphError(f"has {op} with {len(inputs)} inputs and {len(outputs)} outputs")
    for entry in node.messages(5, _ATTRIBUTE):
        name, kind = entry.text(1), entry.number(20)
        if name not in OPERATORS[op].split() or kind != (
            _INTS if name in LIST_ATTRIBUTES else _INT
        ):
            raise GraphError(f"has {op} with the setting {name!r}, which is not understood")
        if name in attributes:
            raise GraphError(f"is damaged: {op} has the setting {name!r} twice")
        attributes[name] = entry.number(3) if kind == _INT else entry.numbers(8)
    return Node(op, inputs, outputs[0], attributes)


def _tensor(tensor: _Message) -> tuple[str, Tensor]:
    """Return name and values of an array, of any shape, that is stored in the file."""
    name, shape, raw = tensor.text(8), tensor.numbers(1), tensor.data(9)
    dtype = _TYPES.get(tensor.number(2))
    if dtype is None:
        raise GraphError(f"has the array {name!r} of another type than float32, float16 and int64")
    if len(shape) > MAX_RANK or any(size < 0 for size in shape):
        raise GraphError(f"has the array {name!r} of the shape {shape[:MAX_RANK]}")
    if math.prod(shape) * dtype.itemsize != len(raw):
        raise GraphError(f"has {len(raw)} bytes for the array {name!r} of the shape {shape}")
    array = np.frombuffer(raw, dtype=dtype).reshape(shape)
    if dtype.kind == "f" and not np.isfinite(array).all():
        raise GraphError(f"has the array {name!r} with values that are no numbers")
    return name, array


def _value(value: _Message) -> tuple[str, tuple[int, ...]]:
    """Return name and shape of an input or output; an open axis is 0."""
    name = value.text(1)
    tensor = _read(_read(value.data(2), _TYPE).data(1), _TENSOR_TYPE)
    if tensor.number(1) != 1:
        raise GraphError(f"takes or gives {name!r} of another type than float32")
    axes = _read(tensor.data(2), _SHAPE).messages(1, _DIMENSION)
    shape = tuple(axis.number(1) for axis in axes)
    if len(shape) > MAX_RANK or any(size < 0 for size in shape):
        raise GraphError(f"has {name!r} of the shape {shape[:MAX_RANK]}")
    return name, shape
