"""Bounded reader of ONNX files: the network as a chain of operators, before any engine runs it.

An ONNX file is a protocol buffer, and the format allows far more than a network needs: pictures of
other files, functions, loops, arrays of any size. Here it is read field by field, and whatever is
not on the lists below is refused. What is left is a short chain of well-known operators whose
weights lie in the file; `controller/bundles/inference/onnx_shapes.py` says what it would cost to
run.

Sources: onnx.proto3 (version 1.17 of ONNX) for the fields, and the protocol buffers' encoding
for the bytes.
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

MAX_NODES: Final = 100
MAX_ARRAYS: Final = 200
MAX_RANK: Final = 6
MAX_TEXT: Final = 200  # bytes of a name
MAX_NUMBERS: Final = 24  # in an attribute: the pads of a convolution over three axes are six
OPSETS: Final = range(13, 24)  # in which our operators have one meaning
IR_VERSIONS: Final = range(7, 14)

# Each operator and the attributes that it may have: integers, or lists of them.
OPERATORS: Final[dict[str, frozenset[str]]] = {
    name: frozenset(attributes.split())
    for name, attributes in {
        "Add": "",
        "AveragePool": "kernel_shape strides",
        "Conv": "kernel_shape strides pads dilations group",
        "Div": "",
        "Flatten": "axis",
        "Gemm": "transA transB",
        "Identity": "",
        "MatMul": "",
        "MaxPool": "kernel_shape strides",
        "Mul": "",
        "Relu": "",
        "Reshape": "",
        "Sigmoid": "",
        "Softmax": "axis",
        "Sub": "",
        "Tanh": "",
        "Transpose": "perm",
    }.items()
}

Attribute = int | float | tuple[int, ...]
Array = NDArray[Any]
_TYPES: Final[dict[int, np.dtype[Any]]] = {
    1: np.dtype("<f4"),
    7: np.dtype("<i8"),
}  # TensorProto.DataType: FLOAT, INT64


class GraphError(ValueError):
    """The file is no network that a device runs; the message says why, without a subject."""


@dataclass(frozen=True, slots=True)
class Node:
    """One operator of the graph.

    Attributes:
        op: Its name, one of `OPERATORS`.
        inputs: Names of what it takes, of earlier nodes, weights, or the graph's input.
        output: The name of what it gives.
        attributes: Its settings.
    """

    op: str
    inputs: tuple[str, ...]
    output: str
    attributes: dict[str, Attribute]


@dataclass(frozen=True, slots=True)
class Graph:
    """A network: one array in, one out.

    Attributes:
        nodes: In the order in which they run.
        weights: Arrays by name, float32 or int64.
        input: Name of what the network is asked.
        shape: Shape of that, the batch's axis as 1.
        output: Name of its answer.
    """

    nodes: tuple[Node, ...]
    weights: dict[str, Array]
    input: str
    shape: tuple[int, ...]
    output: str


def read(data: bytes) -> Graph:
    """Return the network in an ONNX file.

    Raises:
        GraphError: It is damaged, or has anything that a plain network does not need.
    """
    model = _message(data, _MODEL)
    if _int(model, 1) not in IR_VERSIONS:
        raise GraphError(
            f"has the IR version {_int(model, 1)}; {IR_VERSIONS[0]} to {IR_VERSIONS[-1]} are "
            "understood: export it for one of them"
        )
    imports = [_message(entry, _OPSET) for entry in model.get(8, [])]
    if len(imports) != 1 or _text(imports[0], 1) not in ("", "ai.onnx"):
        raise GraphError("imports other operators than ONNX's own; export it without them")
    if _int(imports[0], 2) not in OPSETS:
        raise GraphError(
            f"uses operator set {_int(imports[0], 2)}; {OPSETS[0]} to {OPSETS[-1]} are "
            "understood: export it for one of them"
        )
    if len(model.get(7, [])) != 1:
        raise GraphError("has no graph, or more than one")
    return _graph(_message(model[7][0], _GRAPH))


# --- the messages of onnx.proto3: the fields that we know, and how each is written ---

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5  # the wire types of protocol buffers


@dataclass(frozen=True, slots=True)
class _Form:
    """A message: the wire type of each field, and which may come more than once."""

    name: str
    wires: dict[int, int]
    many: frozenset[int] = frozenset()


def _form(name: str, *, number: str = "", text: str = "", many: str = "", real: str = "") -> _Form:
    """Return a form; the words are field numbers by what they hold."""
    kinds = ((number, _VARINT), (text, _BYTES), (real, _FIXED32))
    wires = {int(field): wire for words, wire in kinds for field in words.split()}
    return _Form(name, wires, frozenset(int(field) for field in many.split()))


_MODEL = _form("a model", number="1 5", text="2 3 4 6 7 8", many="8")
_OPSET = _form("an operator set", text="1", number="2")
_GRAPH = _form("a graph", text="1 2 5 10 11 12 13", many="1 5 11 12 13")
_NODE = _form("an operator", text="1 2 3 4 5 6 7", many="1 2 5")
_ATTRIBUTE = _form("a setting", text="1 13", real="2", number="3 8 20", many="8")
_TENSOR = _form("an array", number="1 2", text="8 9 12", many="1")
_VALUE = _form("an input", text="1 2 3")
_TYPE = _form("a type", text="1 6")
_TENSOR_TYPE = _form("a type", number="1", text="2")
_SHAPE = _form("a shape", text="1", many="1")
_DIMENSION = _form("an axis", number="1", text="2 3")
_FLOAT, _INT, _INTS = 1, 2, 7  # AttributeProto.AttributeType
_MAX_FIELDS = MAX_NODES + MAX_ARRAYS + 100
Fields = dict[int, list[Any]]


def _message(data: bytes | memoryview, form: _Form) -> Fields:
    """Return the fields of one message, by number, in their order.

    What should be there once and comes twice is refused: readers differ in which one counts.
    """
    fields: Fields = {}
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
        elif wire == _BYTES and number in form.many and form.wires[number] == _VARINT:
            values.extend(_packed(value))
        else:
            raise GraphError("is damaged: a field is not written as the format says")
    return fields


def _fields(data: memoryview) -> Iterator[tuple[int, int, Any]]:
    """Yield (number, wire type, value) of each field; every length is checked first."""
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        number, wire = key >> 3, key & 7
        value: Any
        if wire == _VARINT:
            value, at = _varint(data, at)
        elif wire == _BYTES:
            size, at = _varint(data, at)
            if size > len(data) - at:
                raise GraphError("is damaged: it ends too soon")
            value, at = data[at : at + size], at + size
        elif wire in (_FIXED32, _FIXED64):
            size = 4 if wire == _FIXED32 else 8
            if size > len(data) - at:
                raise GraphError("is damaged: it ends too soon")
            value, at = bytes(data[at : at + size]), at + size
        else:
            raise GraphError("is damaged, or no ONNX file")
        yield number, wire, value


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    """Return the number that begins at a place, at most 64 bits, and where it ends."""
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
    """Return the numbers of a packed list."""
    numbers: list[int] = []
    at = 0
    while at < len(data):
        if len(numbers) >= MAX_NUMBERS:
            raise GraphError(f"has a list of more than {MAX_NUMBERS} numbers")
        value, at = _varint(data, at)
        numbers.append(value)
    return numbers


def _signed(value: int) -> int:
    """Return a 64-bit number as protocol buffers mean it."""
    return value - (1 << 64) if value >= 1 << 63 else value


def _int(fields: Fields, number: int) -> int:
    """Return a number; what is not there is 0."""
    values = fields.get(number, [])
    return _signed(values[0]) if values else 0


def _text(fields: Fields, number: int) -> str:
    values = fields.get(number, [])
    return _word(values[0]) if values else ""


def _word(data: memoryview) -> str:
    """Return a name."""
    if len(data) > MAX_TEXT:
        raise GraphError(f"has a name of {len(data)} bytes; {MAX_TEXT} are enough")
    try:
        return bytes(data).decode()
    except UnicodeDecodeError:
        raise GraphError("is damaged: a name is no text") from None


# --- the graph ---


def _graph(fields: Fields) -> Graph:
    if len(fields.get(1, [])) > MAX_NODES or len(fields.get(5, [])) > MAX_ARRAYS:
        raise GraphError(f"has more than {MAX_NODES} operators or {MAX_ARRAYS} arrays")
    weights: dict[str, Array] = {}
    for entry in fields.get(5, []):
        name, array = _tensor(entry)
        if not name or name in weights:
            raise GraphError(f"has two arrays named {name!r}, or one without a name")
        weights[name] = array
    inputs = [_value(entry) for entry in fields.get(11, [])]
    outputs = [_value(entry) for entry in fields.get(12, [])]
    asked = [(name, shape) for name, shape in inputs if name not in weights]
    if len(asked) != 1 or len(outputs) != 1:
        raise GraphError(
            f"takes {len(asked)} arrays and gives {len(outputs)}; expected is one each"
        )
    (name, shape), (output, _) = asked[0], outputs[0]
    if len(shape) < 2 or not all(shape[1:]):
        raise GraphError(f"takes {name!r} of a shape that it leaves open; only the batch may be")
    known = {*weights, name}
    nodes: list[Node] = []
    for entry in fields.get(1, []):
        node = _node(entry)
        if missing := [word for word in node.inputs if word not in known]:
            raise GraphError(f"has {node.op} take {missing[0]!r}, which nothing gave before it")
        if node.output in known:
            raise GraphError(f"has two arrays named {node.output!r}")
        known.add(node.output)
        nodes.append(node)
    if output not in {node.output for node in nodes}:
        raise GraphError(f"gives {output!r}, which none of its operators makes")
    return Graph(tuple(nodes), weights, name, (1, *shape[1:]), output)


def _node(data: memoryview) -> Node:
    fields = _message(data, _NODE)
    op, domain = _text(fields, 4), _text(fields, 7)
    if op not in OPERATORS or domain not in ("", "ai.onnx"):
        raise GraphError(
            f"has the operator {domain + '.' if domain else ''}{op}; a device runs "
            f"{', '.join(OPERATORS)} only"
        )
    inputs = tuple(_word(word) for word in fields.get(1, []))
    outputs = tuple(_word(word) for word in fields.get(2, []))
    if len(outputs) != 1 or not 1 <= len(inputs) <= 3 or not all((*inputs, *outputs)):
        raise GraphError(f"has {op} with {len(inputs)} inputs and {len(outputs)} outputs")
    attributes: dict[str, Attribute] = {}
    for entry in fields.get(5, []):
        name, value = _attribute(entry, op)
        if name in attributes:
            raise GraphError(f"is damaged: {op} has the setting {name!r} twice")
        attributes[name] = value
    return Node(op, inputs, outputs[0], attributes)


def _attribute(data: memoryview, op: str) -> tuple[str, Attribute]:
    fields = _message(data, _ATTRIBUTE)
    name, kind = _text(fields, 1), _int(fields, 20)
    if name not in OPERATORS[op]:
        raise GraphError(f"has {op} with the setting {name!r}, which is not understood")
    if kind == _INT:
        return name, _int(fields, 3)
    if kind == _INTS:
        values = fields.get(8, [])
        if len(values) > MAX_NUMBERS:
            raise GraphError(f"has a list of more than {MAX_NUMBERS} numbers")
        return name, tuple(_signed(value) for value in values)
    if kind == _FLOAT:
        number: float = struct.unpack("<f", (fields.get(2) or [bytes(4)])[0])[0]
        if math.isfinite(number):
            return name, number
    raise GraphError(f"has {op} with the setting {name!r} of a kind that is not understood")


def _tensor(data: memoryview) -> tuple[str, Array]:
    """Return name and values of an array that lies in the file, raw."""
    fields = _message(data, _TENSOR)
    name, shape = _text(fields, 8), tuple(_signed(size) for size in fields.get(1, []))
    dtype = _TYPES.get(_int(fields, 2))
    raw = fields.get(9, [b""])[0]
    if dtype is None:
        raise GraphError(f"has the array {name!r} of another type than float32 and int64")
    if len(shape) > MAX_RANK or any(size < 0 for size in shape):
        raise GraphError(f"has the array {name!r} of the shape {shape[:MAX_RANK]}")
    if math.prod(shape) * dtype.itemsize != len(raw):
        raise GraphError(f"has {len(raw)} bytes for the array {name!r} of the shape {shape}")
    array = np.frombuffer(raw, dtype=dtype).reshape(shape)
    if dtype.kind == "f" and not np.isfinite(array).all():
        raise GraphError(f"has the array {name!r} with values that are no numbers")
    return name, array


def _value(data: memoryview) -> tuple[str, tuple[int, ...]]:
    """Return name and shape of an input or output; an open axis is 0."""
    fields = _message(data, _VALUE)
    kind = _message((fields.get(2) or [b""])[0], _TYPE)
    tensor = _message((kind.get(1) or [b""])[0], _TENSOR_TYPE)
    if _int(tensor, 1) != 1:
        raise GraphError(f"takes or gives {_text(fields, 1)!r} of another type than float32")
    shape = _message((tensor.get(2) or [b""])[0], _SHAPE).get(1, [])
    if len(shape) > MAX_RANK:
        raise GraphError(f"has {_text(fields, 1)!r} of more than {MAX_RANK} axes")
    sizes = [_int(_message(axis, _DIMENSION), 1) for axis in shape]
    if any(size < 0 for size in sizes):
        raise GraphError(f"has {_text(fields, 1)!r} of a negative size")
    return _text(fields, 1), tuple(sizes)
