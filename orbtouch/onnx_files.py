"""Bundles from ONNX files: fold shapes and constants, take the Softmax off, and check the rest."""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomli_w

from controller import __version__
from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.bundles.bundle import Golden
from controller.bundles.head import Head, softmax
from controller.bundles.inference import onnxruntime_engine
from controller.bundles.inference.networks import Recognizer
from controller.bundles.inference.onnx_reader import OPERATORS
from controller.bundles.inference.onnxruntime_engine import EngineError
from controller.shared.errors import UserError
from controller.shared.npz import pack
from orbtouch import checks

# Operators on shapes and constants: those of a fixed input are computed once, here.
_SHAPES: Final = ("Shape", "Size", "Slice", "Concat", "Expand", "Range", "Where", "Equal", "Div")
_CONSTANTS: Final = ("Constant", "ConstantOfShape", "Identity", "Dropout", "BatchNormalization")
# Attributes that may be left out at these values: the reader of bundles does not know them.
_USUAL: Final[dict[str, Any]] = {
    **dict.fromkeys(("ceil_mode", "layout", "storage_order", "transA"), 0),
    **dict.fromkeys(("alpha", "beta", "group"), 1),
    "auto_pad": b"NOTSET",
    "direction": b"forward",
    "noop_with_empty_axes": 0,
}
# And at any value: they follow from the arrays, none of which is empty.
_IMPLIED: Final = {"Conv": ("kernel_shape",), "Reshape": ("allowzero",)}
_LOGITS: Final = ("Add", "Gemm", "MatMul")  # what a network without Softmax may end in


def bundle_of(source: Path | str | bytes, classes: Sequence[str], base: bytes) -> bytes:
    """Return a bundle with the gesture network of an ONNX file, and all else of a bundle `base`.

    Args:
        source: File, or its content.
        classes: Names of the outputs in their order; "null" is among them.
        base: Content of a bundle's file.

    Raises:
        UserError: The network cannot be used; the message says why.
    """
    onnx = checks.needed("onnx", "an ONNX file", "pip install onnx")
    lent, wanted, order = bundles.parse(base), [*classes], null_first(classes)
    try:
        model = onnx.load_from_string(source) if isinstance(source, bytes) else onnx.load(source)
    except Exception as error:  # of the library, which has no common class
        raise UserError(f"no ONNX file: {onnxruntime_engine.first_line(error)}") from None
    for node in model.graph.node:
        known = node.op_type in (*OPERATORS, *_SHAPES, *_CONSTANTS)
        if not known or node.domain not in ("", "ai.onnx"):
            raise UserError(
                f"the network has the operator {node.op_type}, which no device runs; train it with "
                f"others ({', '.join(OPERATORS)}), or play it on this machine: orbtouch.live"
            )
    shape = _take_one(model)
    if len(shape) != 3 or shape[1:] != (lent.rows, lent.columns):
        raise UserError(
            f"the network takes {shape}; expected is (window, {lent.rows}, {lent.columns})"
        )
    try:
        data = model.SerializeToString()
        plain, logits = _plain(onnx.load_from_string(onnxruntime_engine.folded(data)))
        onnxruntime_engine.checked(plain, shape, len(wanted))
        steps = np.linspace(0, lent.window - 1, shape[0]).round().astype(int)
        windows = np.ascontiguousarray(lent.golden.windows[:, steps])
        answers = onnxruntime_engine.network(data)(windows)
    except EngineError as error:
        raise UserError(f"the network {error}") from None
    answers = (softmax(answers) if logits else answers)[:, order]
    names = [wanted[place] for place in order]
    golden = Golden(windows, answers, lent.golden.images, lent.golden.touches)
    data = _assembled(base, names, _head(order), golden, plain)
    Recognizer(bundles.parse(data))  # which compares with the golden vectors
    return data


def renamed(base: bytes, classes: Sequence[str]) -> tuple[bytes, list[int]]:
    """Return a bundle for other classes, all equally probable, and their order with "null" first.

    All else is that of a bundle `base`. UserError: the classes cannot be used.
    """
    order, lent = null_first(classes), bundles.parse(base)
    count, width, old = len(order), lent.head.hidden.shape[1], lent.golden
    zero = np.zeros((count, width), np.float32)
    head = Head(zero[:1], zero[0, :1], zero[:, :1], zero[:, 0])
    shares = np.full((len(old.windows), count), 1.0 / count, np.float32)
    golden = Golden(old.windows, shares, old.images, old.touches)
    names = [classes[place] for place in order]
    return _assembled(base, names, head, golden, lent.embedding_onnx), order


def null_first(classes: Sequence[str]) -> list[int]:
    """Return the places of classes with "null" first; UserError if they cannot be used."""
    if isinstance(classes, str) or "null" not in classes or len(set(classes)) != len(classes):
        raise UserError('classes are different names, "null" among them, for no gesture')
    return sorted(range(len(classes)), key=lambda place: classes[place] != "null")


def _assembled(base: bytes, names: list[str], head: Head, golden: Golden, model: bytes) -> bytes:
    """Return the bundle of a head and an embedding network, with all else of a base."""
    parts = container.unpack(base)
    table = container.manifest(parts.pop(container.MANIFEST))
    for name in (container.SUMS, container.USER, container.REHEARSAL, container.TAUGHT):
        parts.pop(name, None)
    made = {container.EMBEDDING: model, container.HEAD: pack(head.arrays())}
    made = {**parts, **made, container.GOLDEN: golden.pack()}
    window = golden.windows.shape[1]
    table |= {"labels": names, "window": window}
    table.pop("users", None)
    table["preprocess"]["window"] = window
    table["mapping"] = {name: rule for name, rule in table["mapping"].items() if name in names}
    for part in ("debounce", "contact"):  # settings of gestures that are gone
        table[part] = {
            key: [one for one in value if one in names] if isinstance(value, list) else value
            for key, value in table.get(part, {}).items()
        }
    digest = hashlib.sha256(model).hexdigest()[:16]
    source = {"software": __version__, "command": "Network.from_onnx"}
    table["card"] = {**source, "data": f"ONNX file, SHA-256 {digest}"}
    return bundles.assembled(tomli_w.dumps(table).encode(), made)


def _take_one(model: Any) -> tuple[int, ...]:
    """Fix the batch at 1, in place; return the shape of one input, 0 where it is open."""
    known = {array.name for array in model.graph.initializer}
    free = [value for value in model.graph.input if value.name not in known]
    if len(free) != 1 or len(model.graph.output) != 1:
        raise UserError("the network has several inputs or outputs; expected is one each")
    axes = free[0].type.tensor_type.shape.dim
    if not axes or axes[0].dim_value > 1:
        raise UserError(
            "the network takes several windows at once; export it for one or any number"
        )
    axes[0].dim_value = 1
    model.graph.output[0].type.tensor_type.ClearField("shape")
    del model.graph.value_info[:]
    return tuple(int(axis.dim_value) for axis in axes[1:])


def _plain(model: Any) -> tuple[bytes, bool]:
    """Return a folded network without its Softmax, and whether it had none.

    Attributes at their usual values, unused outputs and initial states of zero are left out.
    """
    from onnx import helper, numpy_helper

    graph = model.graph
    arrays = {one.name: numpy_helper.to_array(one) for one in graph.initializer}
    nodes = list(graph.node)
    bare = nodes[-1].op_type != "Softmax"
    if bare and nodes[-1].op_type not in _LOGITS:
        raise UserError(f"the network ends in {nodes[-1].op_type}; expected are Softmax or logits")
    last = graph.output[0].name if bare else nodes.pop().input[0]
    used = {name for node in nodes for name in node.input} | {last}
    zeros = {"", *(name for name, array in arrays.items() if not array.any())}
    kept_nodes = []
    for node in nodes:
        given = {one.name: helper.get_attribute_value(one) for one in node.attribute}
        kept = {name: value for name, value in given.items() if _USUAL.get(name) != value}
        if set(kept.get("dilations", (1,))) == {1}:
            kept.pop("dilations", None)
        for name in _IMPLIED.get(node.op_type, ()):
            kept.pop(name, None)
        if words := [f"{name}={v.decode()}" for name, v in kept.items() if isinstance(v, bytes)]:
            raise UserError(f"the network has {node.op_type} of {words[0]}; leave that out")
        inputs, outputs = list(node.input), [one if one in used else "" for one in node.output]
        if node.op_type == "GRU" and not any(inputs[4:5]) and zeros.issuperset(inputs[5:]):
            inputs = inputs[:4]
        while outputs and not outputs[-1]:
            outputs.pop()
        kept_nodes.append(helper.make_node(node.op_type, inputs, outputs, **kept))
    named = {name for node in kept_nodes for name in node.input}
    stored = [
        numpy_helper.from_array(np.asarray(array, order="C"), name)
        for name, array in arrays.items()
        if name in named
    ]
    (asked,) = (value for value in graph.input if value.name not in arrays)
    axes = [axis.dim_value for axis in asked.type.tensor_type.shape.dim]
    entry = helper.make_tensor_value_info(asked.name, 1, axes)
    answer = helper.make_tensor_value_info(last, 1, None)
    whole = helper.make_graph(kept_nodes, "gestures", [entry], [answer], stored)
    (version,) = (one.version for one in model.opset_import if one.domain in ("", "ai.onnx"))
    opset = [helper.make_opsetid("", version)]
    made = helper.make_model(whole, opset_imports=opset, ir_version=model.ir_version)
    return bytes(made.SerializeToString()), bare


def _head(order: Sequence[int]) -> Head:
    """Return the head whose logits are those of the network, in another order of the classes."""
    size, one = len(order), np.eye(len(order), dtype=np.float32)
    hidden, out = np.concatenate([one, -one]), one[[*order]]
    zero = np.zeros(2 * size, np.float32)
    return Head(hidden, zero, np.concatenate([out, -out], axis=1), zero[:size])
