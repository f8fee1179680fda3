"""The walk through an ONNX file: what a device runs is read, all else is refused with a reason."""

import struct
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles import bundle
from controller.bundles.inference import onnx_reader, onnx_shapes, onnxruntime_engine
from controller.bundles.inference.onnx_reader import GraphError
from tests.support.onnx_files import array, ints, model, node, number, stored, text, value

SHIPPED = bundle.read(bundle.default_path())


ASKED = value(11, "x", 0, 4)
GIVEN = value(12, "y", 0, 4)


def chain(*parts: bytes) -> bytes:
    """A network from x to y: some operators, and one that does nothing at the end."""
    return model(*parts, node("Relu", "z", "y"), ASKED, GIVEN)


def test_the_shipped_networks_are_chains_of_well_known_operators() -> None:
    gesture = onnx_reader.read(SHIPPED.embedding_onnx)
    assert gesture.shape == (1, SHIPPED.window, SHIPPED.rows, SHIPPED.columns)
    assert gesture.nodes[-1].op == "Relu"
    assert {node.op for node in gesture.nodes} <= set(onnx_reader.OPERATORS)
    sizes = onnx_shapes.sizes(gesture)
    assert sizes.shapes[gesture.output] == (1, 96)


def test_shapes_and_multiplications_are_those_of_the_convolution_arithmetic() -> None:
    """5 by 5 padded by 1, a kernel of 3 by 3, stride 2: 3 by 3 places, 18 taps, 4 maps."""
    kernel = array("k", 4, 2, 3, 3)
    settings = (ints("pads", 1, 1, 1, 1), ints("strides", 2, 2))
    asked, given_ = value(11, "x", 0, 2, 5, 5), value(12, "y", 0, 4, 3, 3)
    read = onnx_reader.read(model(kernel, node("Conv", "x k", "y", *settings), asked, given_))
    sizes = onnx_shapes.sizes(read)
    assert sizes.shapes["y"] == (1, 4, 3, 3)
    assert sizes.macs == 4 * 9 * 18


BAD: dict[str, tuple[bytes, str]] = {
    "nothing": (b"", "IR version 0"),
    "text": (b"no model", "damaged|needs"),
    "an old format": (model(ir=3), "IR version 3"),
    "an unknown operator set": (model(opset=99), "operator set 99"),
    "foreign operators": (
        model(extra=text(8, text(1, "com.evil") + number(2, 1))),
        "imports other",
    ),
    "functions": (model(extra=text(25, b"")), "a model with field 25"),
    "training": (model(extra=text(20, b"")), "a model with field 20"),
    "two graphs": (model(extra=text(7, b"")), "field 7 twice"),
    "a loop": (chain(node("Loop", "x", "z")), "the operator Loop; a device runs"),
    "a custom domain": (chain(node("Relu", "x", "z", domain="com.evil")), "com.evil.Relu"),
    "a subgraph": (chain(node("Relu", "x", "z", text(1, "axis") + text(6, b""))), "field 6"),
    "a setting nobody knows": (chain(node("Relu", "x", "z", ints("secret", 1))), "'secret'"),
    "an array in another file": (
        chain(text(5, number(1, 4) + number(2, 1) + text(8, "w") + text(13, b"path"))),
        "an array with field 13",
    ),
    "an array that claims more than it has": (chain(array("w", 1 << 40, raw=b"")), "0 bytes for"),
    "an array of a negative size": (chain(array("w", -4, raw=b"")), "of the shape"),
    "an array of texts": (chain(array("w", 0, kind=8)), "another type"),
    "weights that are no numbers": (chain(array("w", 1, raw=b"\0\0\xc0\x7f")), "no numbers"),
    "two arrays of one name": (chain(array("w", 1), array("w", 1)), "two arrays"),
    "an operator before its input": (chain(node("Relu", "later", "z")), "'later'"),
    "an output twice": (chain(node("Relu", "x", "x")), "two arrays named 'x'"),
    "no output": (model(node("Relu", "x", "z"), ASKED, GIVEN), "'y', which none"),
    "two inputs": (
        model(node("Relu", "x", "y"), ASKED, value(11, "w", 0, 4), GIVEN),
        "takes 2 arrays",
    ),
    "an open shape": (model(node("Relu", "x", "y"), value(11, "x", 0, 0), GIVEN), "leaves open"),
    "a long name": (chain(node("Relu", "x", "z" * 300)), "name of 300 bytes"),
    "a name that is no text": (chain(text(1, text(4, b"\xff"))), "no text"),
    "too many operators": (chain(*(node("Relu", "x", f"z{i}") for i in range(101))), "than 100"),
    "a number without an end": (b"\xff" * 20, "no end"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_a_plain_network_does_not_need_is_refused(name: str) -> None:
    data, complaint = BAD[name]
    with pytest.raises(GraphError, match=complaint):
        onnx_reader.read(data)


IMAGE = value(11, "x", 0, 1, 5, 5)


def conv(size: int, *attributes: bytes) -> bytes:
    """A convolution with a square kernel."""
    return model(array("k", 1, 1, size, size), node("Conv", "x k", "y", *attributes), IMAGE, GIVEN)


def sizes(name: str, *numbers: int) -> bytes:
    return array(name, len(numbers), kind=7, raw=struct.pack(f"<{len(numbers)}q", *numbers))


COSTLY: dict[str, tuple[bytes, str]] = {
    "pads of a million": (conv(3, ints("pads", *[1_000_000] * 4)), "more than"),
    "a stride of nothing": (conv(3, ints("strides", 0, 0)), "above zero"),
    "a window larger than its input": (conv(9), "give an array of the shape"),
    "an outer product": (
        model(
            array("v", 8000, 4), node("Mul", "v x", "a"), sizes("s", 1, 32000),
            node("Reshape", "a s", "b"), sizes("t", 32000, 1), node("Reshape", "a t", "c"),
            node("Mul", "b c", "y"), ASKED, GIVEN,
        ),
        "more than",
    ),
    "matrices that do not fit": (
        model(array("w", 5, 2), node("Gemm", "x w", "y"), ASKED, GIVEN), "4 against 5",
    ),
    "a new shape that is computed": (
        model(node("Reshape", "x x", "y"), ASKED, GIVEN), "lies in the file",
    ),
    "whole numbers for weights": (
        model(array("w", 1, kind=7, raw=bytes(8)), node("Add", "x w", "y"), ASKED, GIVEN),
        "whole numbers",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", COSTLY)
def test_what_would_cost_too_much_is_refused_before_it_runs(name: str) -> None:
    data, complaint = COSTLY[name]
    with pytest.raises(GraphError, match=complaint):
        onnx_shapes.sizes(onnx_reader.read(data))


def halves(weights: np.ndarray) -> bytes:
    """A product with weights of 16 bits, cast to float32 as an export does."""
    cast = text(1, "to") + number(3, 1) + number(20, 2)
    transposed = text(1, "transB") + number(3, 1) + number(20, 2)
    return model(
        node("Cast", "w.half", "w", cast),
        node("Gemm", "x w", "y", transposed),
        stored("w.half", weights.astype(np.float16)),
        value(11, "x", 0, weights.shape[1]),
        value(12, "y", 0, len(weights)),
    )


def test_weights_of_sixteen_bits_are_read_and_run_as_float32() -> None:
    exact = np.random.default_rng(0).normal(size=(30, 40)).astype(np.float16).astype(np.float32)
    data, x = halves(exact), np.ones((3, 40), dtype=np.float32)
    np.testing.assert_array_equal(onnx_reader.read(data).weights["w"], exact)
    seen = onnxruntime_engine.checked(data, (40,), 30)(x)
    np.testing.assert_allclose(seen, x @ exact.T, rtol=1e-5)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (b"w.half", b"w.HALF"),  # of one of two places: what is cast is not there
        (b"Cast", b"Tanh"),  # 16 bits that are not cast
    ],
)
def test_sixteen_bits_are_cast_to_float32_or_refused(before: bytes, after: bytes) -> None:
    with pytest.raises(GraphError):
        onnx_reader.read(halves(np.ones((2, 3))).replace(before, after, 1))


@settings(deadline=None)
@given(
    st.lists(st.integers(-(2**63), 2**63 - 1), max_size=6),
    st.floats(width=32, allow_nan=False, allow_infinity=False),
)
def test_every_number_is_read_as_it_was_written(several: list[int], real: float) -> None:
    weights = np.array([[real]], dtype=np.float32)
    conv = node("Conv", "x w", "y", ints("pads", *several))
    read = onnx_reader.read(model(conv, stored("w", weights), ASKED, GIVEN))
    assert read.nodes[0].attributes == {"pads": tuple(several)}
    np.testing.assert_array_equal(read.weights["w"], weights)


@settings(deadline=None, max_examples=300)
@given(st.binary(max_size=300))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    with pytest.raises(GraphError):
        onnx_reader.read(data)


@settings(deadline=None, max_examples=150)
@given(st.floats(0, 1, exclude_max=True), st.integers(0, 8), st.booleans())
def test_a_damaged_network_is_refused_or_bounded(at: float, bit: int, at_the_end: bool) -> None:
    """A bit is flipped, or the file cut; weights are most of it, operators before or behind."""
    whole = bytearray(SHIPPED.embedding_onnx)
    place = int(at * 2000) + (len(whole) - 2000 if at_the_end else 0)
    if bit < 8:
        whole[place] ^= 1 << bit
    else:
        del whole[place:]
    with suppress(GraphError):
        sizes = onnx_shapes.sizes(onnx_reader.read(bytes(whole)))
        assert sizes.elements <= onnx_shapes.MAX_ELEMENTS
        assert sizes.macs <= onnx_shapes.MAX_MACS


def test_packed_numbers_are_read_up_to_one_more_than_the_limit() -> None:
    assert onnx_reader._packed(memoryview(b"\x01\xac\x02\x00")) == [1, 300, 0]
    many = memoryview(bytes(onnx_reader.MAX_NUMBERS + 5))
    assert len(onnx_reader._packed(many)) == onnx_reader.MAX_NUMBERS + 1


def small_network() -> bytes:
    """A network with a setting, a list, weights of 16 and 32 bits, and a new shape."""
    return model(
        array("k", 2, 1, 2, 2), node("Conv", "x k", "a", ints("pads", 0, 0, 1, 1)),
        node("Flatten", "a", "b", text(1, "axis") + number(3, 1) + number(20, 2)),
        array("h", 3, kind=10, raw=bytes(range(6))),
        node("Cast", "h", "w", text(1, "to") + number(3, 1) + number(20, 2)),
        node("Mul", "b w", "c"), array("s", 2, kind=7, raw=struct.pack("<2q", 1, -1)),
        node("Reshape", "c s", "y"), array("e", 0),
        value(11, "x", 0, 1, 2, 2), value(12, "y", 0, 3),
    )  # fmt: skip


def answer(data: bytes) -> str:
    """What is read, or why it is refused."""
    try:
        read = onnx_reader.read(data)
    except GraphError as error:
        return str(error)
    weights = [(name, one.dtype.str, one.tolist()) for name, one in read.weights.items()]
    return repr((read.nodes, weights, read.input, read.shape, read.output))


def test_each_damage_of_a_small_network_has_the_answer_that_it_had() -> None:
    """Every byte is changed in ten ways, and left out. Take a new digest from the failure."""
    whole, said = small_network(), sha256(answer(small_network()).encode())
    for at, byte in enumerate(whole):
        for other in (*(byte ^ 1 << bit for bit in range(8)), (byte + 1) % 256, (byte - 1) % 256):
            said.update(answer(whole[:at] + bytes([other]) + whole[at + 1 :]).encode())
        said.update(answer(whole[:at] + whole[at + 1 :]).encode())
    assert said.hexdigest()[:16] == "cfa050e4a88ab228"


def many(count: int) -> bytes:
    """Weights, an operator each."""
    return b"".join(array(f"w{i}", 1) for i in range(count))


LIMITS: dict[str, tuple[Callable[[int], bytes], int]] = {  # the most that is read
    "operators": (lambda n: chain(node("Relu", "x", "z"), *(
        node("Relu", "z", f"z{i}") for i in range(n - 2))), 100),
    "arrays": (lambda n: chain(node("Relu", "x", "z"), many(n)), 200),
    "axes": (lambda n: chain(node("Relu", "x", "z"), array("w", *[1] * n)), 6),
    "axes of the input": (
        lambda n: model(node("Relu", "x", "y"), value(11, "x", *[1] * n), GIVEN), 6),
    "bytes of a name": (lambda n: chain(node("Relu", "x", "z"), array("w" * n, 1)), 200),
    "numbers of a list": (lambda n: chain(node("Conv", "x x", "z", ints("pads", *[1] * n))), 24),
    "inputs of an operator": (lambda n: chain(node("Add", " ".join("x" * n), "z")), 3),
    "the version of the format": (lambda n: model(node("Relu", "x", "y"), ASKED, GIVEN, ir=n), 13),
    "the operator set": (lambda n: model(node("Relu", "x", "y"), ASKED, GIVEN, opset=n), 23),
    "the version before": (lambda n: model(node("Relu", "x", "y"), ASKED, GIVEN, ir=-n), -7),
    "the operator set before": (
        lambda n: model(node("Relu", "x", "y"), ASKED, GIVEN, opset=-n), -13),
    "fields of a graph": (
        lambda n: chain(node("Relu", "x", "z"), text(13, "") * (n - 4)), 400),
}  # fmt: skip


@pytest.mark.parametrize("what", LIMITS)
def test_a_limit_is_read_and_one_more_is_refused(what: str) -> None:
    made, most = LIMITS[what]
    onnx_reader.read(made(most))
    with pytest.raises(GraphError):
        onnx_reader.read(made(most + 1))
