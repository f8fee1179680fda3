"""Write a network as an ONNX file, field by field: the inverse of `onnx_reader`.

A device needs no `onnx` package to store an adapted network. Only the fields that `read` accepts
are written, and the same network always gives the same bytes. Matrices whose values 16 bits hold
exactly are stored with 16 bits.
"""

from typing import Final

import numpy as np

from controller.bundles.inference.onnx_reader import Attribute, Graph, Node, Tensor

OPSET: Final = 17  # as trained networks are exported (models/training/export.py)
IR_VERSION: Final = 8
PRODUCER: Final = "orbtouch"
_KINDS: Final = {"<f4": 1, "<i8": 7, "<f2": 10}  # TensorProto.DataType
_MOST: Final = 65504.0  # that 16 bits hold
_HALF: Final = ".half"  # ends the names of weights of 16 bits
_INT, _INTS = 2, 7  # AttributeProto.AttributeType
_VARINT, _BYTES = 0, 2  # the wire types of protocol buffers


def write(graph: Graph, title: str = "gesture", width: int | None = None) -> bytes:
    """Return the ONNX file of a network; `onnx_reader.read` returns the same network.

    The batch is left open; the output has `width` numbers, by default the rows of the last weights.
    """
    if width is None:
        last = [name for node in graph.nodes for name in node.inputs if name in graph.weights][-1]
        width = graph.weights[last].shape[0]
    stored = {name: _stored(array) for name, array in graph.weights.items()}
    halves = [name for name, array in stored.items() if array.dtype == np.float16]
    casts = [Node("Cast", (name + _HALF,), name, {"to": _KINDS["<f4"]}) for name in halves]
    parts = [_message(1, _node(node)) for node in (*casts, *graph.nodes)]
    parts.append(_text(2, title))
    for name, array in stored.items():
        parts.append(_message(5, _tensor(name + _HALF * (name in halves), array)))
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


def _tensor(name: str, array: Tensor) -> bytes:
    """Return an array of any shape as a TensorProto."""
    sizes = b"".join(_number(1, size) for size in array.shape)
    kind = _number(2, _KINDS[array.dtype.str])
    return sizes + kind + _text(8, name) + _message(9, array.tobytes())


def _stored(array: Tensor) -> Tensor:
    """Return an array of any shape as it is stored: a matrix with 16 bits if nothing is lost."""
    plain = np.asarray(array, dtype="<f4" if array.dtype.kind == "f" else "<i8", order="C")
    if plain.ndim < 2 or plain.dtype.kind != "f" or float(np.abs(plain).max(initial=0.0)) > _MOST:
        return plain
    half = plain.astype("<f2")
    return half if np.array_equal(half.astype("<f4"), plain) else plain


def _value(name: str, shape: tuple[int, ...]) -> bytes:
    """Return an input or output, float32, whose first axis is an open batch."""
    axes = _message(1, _text(2, "batch"))
    axes += b"".join(_message(1, _number(1, size)) for size in shape)
    kind = _message(1, _number(1, _KINDS["<f4"]) + _message(2, axes))
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
