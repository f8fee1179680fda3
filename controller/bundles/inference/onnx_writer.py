"""Write a network as an ONNX file, field by field: the inverse of `onnx_reader`.

A device needs no `onnx` package to store an adapted network. Only the fields that `read` accepts
are written, and the same network always gives the same bytes.
"""

from typing import Final

import numpy as np

from controller.bundles.inference.onnx_reader import Array, Attribute, Graph, Node

OPSET: Final = 17  # as trained networks are exported (models/training/export.py)
IR_VERSION: Final = 8
PRODUCER: Final = "orbtouch"
_FLOAT32, _INT64 = 1, 7  # TensorProto.DataType
_INT, _INTS = 2, 7  # AttributeProto.AttributeType
_VARINT, _BYTES = 0, 2  # the wire types of protocol buffers


def write(graph: Graph, title: str = "gesture", width: int | None = None) -> bytes:
    """Return the ONNX file of a network; `onnx_reader.read` returns the same network.

    The batch is left open; the output has `width` numbers, by default the rows of the last weights.
    """
    if width is None:
        last = [name for node in graph.nodes for name in node.inputs if name in graph.weights][-1]
        width = graph.weights[last].shape[0]
    parts = [_message(1, _node(node)) for node in graph.nodes]
    parts.append(_text(2, title))
    parts += [_message(5, _tensor(name, array)) for name, array in graph.weights.items()]
    parts.append(_message(11, _value(graph.input, graph.shape[1:])))
    parts.append(_message(12, _value(graph.output, (width,))))
    imported = _number(2, OPSET)
    model = _number(1, IR_VERSION) + _text(2, PRODUCER)
    return model + _message(7, b"".join(parts)) + _message(8, imported)


def _node(node: Node) -> bytes:
    words = b"".join(_text(1, word) for word in node.inputs) + _text(2, node.output)
    settings = (_message(5, _attribute(*item)) for item in node.attributes.items())
    return words + _text(4, node.op) + b"".join(settings)


def _attribute(name: str, value: Attribute) -> bytes:
    if isinstance(value, tuple):
        numbers = b"".join(_number(8, number) for number in value)
        return _text(1, name) + numbers + _number(20, _INTS)
    return _text(1, name) + _number(3, value) + _number(20, _INT)


def _tensor(name: str, array: Array) -> bytes:
    """Return an array of any shape as a TensorProto."""
    kind = _FLOAT32 if array.dtype.kind == "f" else _INT64
    plain = np.ascontiguousarray(array, dtype="<f4" if kind == _FLOAT32 else "<i8")
    sizes = b"".join(_number(1, size) for size in array.shape)
    return sizes + _number(2, kind) + _text(8, name) + _message(9, plain.tobytes())


def _value(name: str, shape: tuple[int, ...]) -> bytes:
    """Return an input or output, float32, whose first axis is an open batch."""
    axes = _message(1, _text(2, "batch"))
    axes += b"".join(_message(1, _number(1, size)) for size in shape)
    kind = _message(1, _number(1, _FLOAT32) + _message(2, axes))
    return _text(1, name) + _message(2, kind)


def _key(field: int, wire: int) -> bytes:
    return _varint(field << 3 | wire)


def _number(field: int, value: int) -> bytes:
    return _key(field, _VARINT) + _varint(value & (1 << 64) - 1)


def _text(field: int, value: str) -> bytes:
    return _message(field, value.encode())


def _message(field: int, data: bytes) -> bytes:
    return _key(field, _BYTES) + _varint(len(data)) + data


def _varint(value: int) -> bytes:
    written = bytearray()
    while value > 0x7F:
        written.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*written, value])
