"""A writer of ONNX files, as small as the tests need; it writes wrong ones as well."""

import numpy as np


def varint(number: int) -> bytes:
    number &= (1 << 64) - 1
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*out, number])


def number(field: int, value: int) -> bytes:
    return varint(field << 3) + varint(value)


def text(field: int, data: bytes | str) -> bytes:
    data = data.encode() if isinstance(data, str) else data
    return varint(field << 3 | 2) + varint(len(data)) + data


def node(op: str, inputs: str, output: str, *settings: bytes, domain: str = "") -> bytes:
    words = b"".join(text(1, word) for word in inputs.split()) + text(2, output)
    return text(1, words + text(4, op) + b"".join(text(5, s) for s in settings) + text(7, domain))


def ints(name: str, *values: int) -> bytes:
    return text(1, name) + b"".join(number(8, value) for value in values) + number(20, 7)


def array(name: str, *shape: int, kind: int = 1, raw: bytes | None = None) -> bytes:
    data = bytes(4 * int(np.prod(shape))) if raw is None else raw
    sizes = b"".join(number(1, size) for size in shape)
    return text(5, sizes + number(2, kind) + text(8, name) + text(9, data))


def stored(name: str, values: np.ndarray) -> bytes:
    kinds = {"<f4": 1, "<i8": 7, "<f2": 10}
    return array(name, *values.shape, kind=kinds[values.dtype.str], raw=values.tobytes())


def value(field: int, name: str, *shape: int, kind: int = 1) -> bytes:
    axes = b"".join(text(1, number(1, size) if size else text(2, "batch")) for size in shape)
    return text(field, text(1, name) + text(2, text(1, number(1, kind) + text(2, axes))))


def model(*parts: bytes, opset: int = 17, ir: int = 8, extra: bytes = b"") -> bytes:
    return number(1, ir) + text(7, b"".join(parts)) + text(8, number(2, opset)) + extra
