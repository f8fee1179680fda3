"""Export of trained networks into a bundle: ONNX graphs, a head, golden vectors, manifest.

A graph is made by walking the layers, so the file holds exactly what the device runs, and nothing
of the program that trained it. PyTorch and ONNX Runtime are compared before anything is written.
"""

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomli_w
import torch
from numpy.typing import NDArray
from onnx import NodeProto, TensorProto, helper, numpy_helper
from torch import Tensor, nn

from controller.adapt.lessons import Rehearsal, to_bytes
from controller.bundles import bundle, container
from controller.bundles.bundle import Golden
from controller.bundles.head import Head
from controller.bundles.inference import onnxruntime_engine
from controller.recognition.touch_input import TouchInput
from controller.shared import files, npz
from controller.shared.aliases import Index
from models.data.examples import Examples
from models.data.load import Data
from models.data.splits import Split
from models.data.touch_images import Touches
from models.training.networks import GAIN, GridPosition, Network, Scale

TOLERANCE: Final = 1e-5  # greatest difference between PyTorch and ONNX Runtime
MOST: Final = 6e4  # greatest weight that 16 bits hold, about
TINY: Final = 1e-12  # smaller weights are set to 0: subnormal ones make inference 2.6 x slower
OPSET: Final = 17
IR_VERSION: Final = 8
COMPARED: Final = 2000  # examples on which PyTorch and ONNX Runtime are compared
GOLDEN: Final = 4  # golden vectors of each network in a bundle

Values = NDArray[np.float32]  # (n, ...)
Operator = tuple[str, dict[str, Values | NDArray[np.int64]], dict[str, Any]]
WINDOWS: Final = 2500  # of a bundle, about: some 90 kB
TOUCHED: Final = 0.45  # share of them that show a gesture
EACH: Final = 6  # windows of a touch
NEAR_S: Final = 1.0  # of a touch: windows of rest that count as next to it
_AT_ONCE: Final = 256  # windows that are embedded together


class ExportError(ValueError):
    """The exported networks do not answer like the trained ones."""


@dataclass(frozen=True, slots=True)
class ExportedNetwork:
    """One network as a bundle holds it."""

    parts: dict[str, bytes]  # of the bundle
    inputs: Values  # golden inputs, (n, ...)
    outputs: Values  # the network's outputs for them, (n, width)


def compared_windows(data: Data, split: Split, seed: int) -> Values:
    """Return recorded windows (n, window, rows, columns) for the comparison of the engines."""
    held = split.windows.check if len(split.windows.check) else split.windows.train
    ends = data.examples.ends[held]
    rng = np.random.default_rng((seed, 4))
    return data.examples.windows(rng.choice(ends, min(COMPARED, len(ends)), replace=False))


def compared_images(found: Touches, seed: int) -> Values:
    """Return recorded images (n, rows, columns) for the comparison of the engines."""
    rng = np.random.default_rng((seed, 5))
    return found.images[rng.permutation(len(found.images))[:COMPARED]]


def export_gestures(net: Network, windows: Values) -> ExportedNetwork:
    """Return CNN-3D as an embedding network and a head.

    The network is folded; its weights are rounded to 16 bits. Its last two dense layers are the
    head. Windows are (n, window, rows, columns). ExportError if the engines differ by more than
    `TOLERANCE`.
    """
    flush(net)
    layers = list(net.named_children())
    dense = [(at, layer) for at, (_, layer) in enumerate(layers) if isinstance(layer, nn.Linear)]
    (first, hidden), (_, out) = dense[-2:]
    head = Head(_array(hidden.weight), _array(hidden.bias), _array(out.weight), _array(out.bias))
    embedding = Network(OrderedDict(layers[:first]))
    model = onnx_file(embedding, windows.shape[1:], "windows", "embedding", head.hidden.shape[1])
    with torch.no_grad():
        outputs = _array(torch.softmax(net(torch.from_numpy(windows)), dim=1))
    _compare(head.probabilities(run(model, windows)), outputs)
    parts = {container.EMBEDDING: model, container.HEAD: npz.pack(head.arrays())}
    return ExportedNetwork(parts, windows[:GOLDEN], outputs[:GOLDEN])


def export_users(net: Network, windows: Values) -> ExportedNetwork:
    """Return the user network for a bundle; ExportError if the engines differ."""
    layers = OrderedDict(net.named_children(), softmax=nn.Softmax(dim=1))
    return _export(Network(layers), windows, container.USER)


def export_location(net: Network, images: Values, settings: TouchInput) -> ExportedNetwork:
    """Return CNN-2D for images of touches (n, rows, columns); ExportError if the engines differ.

    Golden vectors are whole images and places on the grid.
    """
    inputs, corners = settings.of(images)
    made = _export(net, inputs, container.LOCATION)
    return replace(made, inputs=images[:GOLDEN], outputs=made.outputs + corners[:GOLDEN])


def networks_of(path: Path) -> tuple[ExportedNetwork, ExportedNetwork]:
    """Return the gesture and the location network of another bundle, unchanged."""
    data = files.read_bytes(path, container.MAX_BYTES)
    golden, parts = bundle.parse(data).golden, container.unpack(data)
    own = (container.EMBEDDING, container.HEAD, container.TAUGHT, container.REHEARSAL)
    gesture = {name: parts[name] for name in own if name in parts}
    location = {container.LOCATION: parts[container.LOCATION]}
    return (
        ExportedNetwork(gesture, golden.windows, golden.probabilities),
        ExportedNetwork(location, golden.images, golden.touches),
    )


def no_location(rows: int, columns: int) -> ExportedNetwork:
    """Return the location network of a bundle that lacks one."""
    images = np.empty((0, rows, columns), dtype=np.float32)
    return ExportedNetwork({container.LOCATION: b""}, images, np.empty((0, 2), dtype=np.float32))


def rehearsal(model: bytes, examples: Examples, ends: Index, classes: int, seed: int) -> bytes:
    """Return embeddings of windows of a bundle's training, for lessons on the device.

    As many touches of each gesture are taken, some windows of each, and windows of rest: half of
    them next to these touches, where what begins a gesture is still none, the others at random.
    Windows end at frames `ends`.
    """
    chosen, touch = choose(examples, ends, classes, np.random.default_rng((seed, 6)))
    network = onnxruntime_engine.network(model)
    cuts = np.array_split(chosen, -(-len(chosen) // _AT_ONCE))
    embedding = np.concatenate([network(examples.windows(cut)) for cut in cuts])
    firmest = [_firmest(examples, chosen, touch, kind) for kind in range(classes)]
    return Rehearsal(embedding, touch, to_bytes(np.array(firmest))).pack()


def choose(
    examples: Examples, ends: Index, classes: int, rng: np.random.Generator
) -> tuple[Index, NDArray[np.int32]]:
    """Return last frames of some windows, and the number of each one's touch, -1 without, (n,)."""
    ends = np.sort(ends[examples.label[ends] < classes])
    label = examples.label[ends]
    first = np.flatnonzero(examples.begins(ends, gap=1))
    runs = np.split(ends, first[1:])
    kinds = label[first]
    share = round(TOUCHED * WINDOWS / EACH / max(1, len(set(kinds[kinds > 0].tolist()))))
    touches = [
        runs[number][np.linspace(0, len(runs[number]) - 1, EACH).round().astype(int)]
        for kind in range(1, classes)
        for number in rng.permutation(np.flatnonzero(kinds == kind))[:share]
    ]
    touches = [np.unique(touch) for touch in touches]
    shown = np.concatenate([np.empty(0, dtype=np.int64), *touches])
    rest, most = ends[label == 0], round(len(shown) * (1.0 - TOUCHED) / TOUCHED)
    after = np.append(np.sort(shown), np.iinfo(np.int64).max)
    at = np.searchsorted(after, rest)
    gap = np.minimum(after[at] - rest, rest - np.append(0, np.sort(shown))[at])
    near = rng.permutation(rest[gap <= NEAR_S * examples.rate_hz])[: most // 2]
    other = rng.permutation(np.setdiff1d(rest, near))[: most - len(near)]
    number = np.repeat(np.arange(len(touches)), [len(touch) for touch in touches])
    none = np.full(len(near) + len(other), -1)
    return np.concatenate([shown, near, other]), np.concatenate([number, none]).astype(np.int32)


def _firmest(
    examples: Examples, ends: Index, touch: NDArray[np.int32], kind: int
) -> NDArray[np.float32]:
    """Return the mean image of a gesture's touches at their firmest, z, (rows, columns)."""
    own = (examples.label[ends] == kind) & (touch >= 0)
    images, number = examples.images[ends[own]], touch[own]
    if not kind or not own.any():
        return np.ones(examples.images.shape[1:], dtype=np.float32)
    force = np.abs(images - 1.0).mean(axis=(1, 2))
    order = np.lexsort((force, number))
    last = np.append(np.flatnonzero(np.diff(number[order])), len(order) - 1)
    return np.asarray(images[order[last]].mean(axis=0), dtype=np.float32)


def write_bundle(
    path: Path, manifest: dict[str, Any], gesture: ExportedNetwork, location: ExportedNetwork
) -> None:
    """Write a bundle; BundleError if it would be refused when it is read."""
    golden = Golden(gesture.inputs, gesture.outputs, location.inputs, location.outputs)
    parts = {**gesture.parts, **location.parts, container.GOLDEN: golden.pack()}
    bundle.write(path, manifest=tomli_w.dumps(manifest).encode(), parts=parts)


def flush(net: nn.Module) -> None:
    """Set weights that are all but zero to zero, and round matrices to 16 bits, in place."""
    with torch.no_grad():
        for parameter in net.parameters():
            parameter[parameter.abs() < TINY] = 0.0
            if parameter.ndim > 1 and float(parameter.abs().max()) < MOST:
                parameter.copy_(parameter.half().float())


def onnx_file(net: Network, shape: tuple[int, ...], source: str, result: str, width: int) -> bytes:
    """Return a folded network of so many outputs as an ONNX file, for inputs of a shape.

    Matrices whose values 16 bits hold exactly are stored with 16 bits. ExportError if it has a
    layer that cannot be exported.
    """
    nodes: list[NodeProto] = []
    casts: list[NodeProto] = []
    weights: list[TensorProto] = []
    x = source
    for name, layer in net.named_children():
        for kind, constants, attributes in _operators(layer, shape):
            inputs = [f"{name}.{constant}" for constant in constants]
            output = f"{kind.lower()}{len(nodes)}"
            nodes.append(helper.make_node(kind, [x, *inputs], [output], **attributes))
            x = output
            for key, array in zip(inputs, constants.values(), strict=True):
                with np.errstate(over="ignore"):
                    half = array.astype(np.float16)
                if array.ndim < 2 or not np.array_equal(half.astype(np.float32), array):
                    weights.append(numpy_helper.from_array(array, key))
                    continue
                weights.append(numpy_helper.from_array(half, f"{key}.half"))
                casts.append(helper.make_node("Cast", [f"{key}.half"], [key], to=TensorProto.FLOAT))
    nodes[-1].output[0] = result
    given = helper.make_tensor_value_info(source, TensorProto.FLOAT, ["batch", *shape])
    made = helper.make_tensor_value_info(result, TensorProto.FLOAT, ["batch", width])
    graph = helper.make_graph([*casts, *nodes], result, [given], [made], weights)
    opset = helper.make_opsetid("", OPSET)
    model = helper.make_model(graph, opset_imports=[opset], ir_version=IR_VERSION)
    return bytes(model.SerializeToString())


def _operators(layer: nn.Module, shape: tuple[int, ...]) -> Iterator[Operator]:
    """Yield a layer's ONNX operators in a chain: kind, constants by name, attributes."""
    match layer:
        case Scale():
            yield "Reshape", {"shape": np.array((-1, 1, *shape), dtype=np.int64)}, {}
            yield "Sub", {"one": np.array(1.0, dtype=np.float32)}, {}
            yield "Mul", {"gain": np.array(GAIN, dtype=np.float32)}, {}
        case nn.Conv2d() | nn.Conv3d():
            padding = tuple(int(side) for side in layer.padding)  # begin and end alike
            strides = tuple(int(step) for step in layer.stride)
            yield "Conv", _weights(layer), {"pads": padding + padding, "strides": strides}
        case nn.Linear():
            yield "Gemm", _weights(layer), {"transB": 1}
        case GridPosition():
            yield "Tanh", {}, {}
            yield "Mul", {"reach": _array(layer.reach)}, {}
            yield "Add", {"centre": _array(layer.centre)}, {}
        case nn.ReLU():
            yield "Relu", {}, {}
        case nn.Flatten():
            yield "Flatten", {}, {"axis": 1}
        case nn.Softmax():
            yield "Softmax", {}, {"axis": 1}
        case _:
            raise ExportError(f"{type(layer).__name__} cannot be exported; add it to _operators")


def _weights(layer: nn.Conv2d | nn.Conv3d | nn.Linear) -> dict[str, Values | NDArray[np.int64]]:
    assert layer.bias is not None
    return {"weight": _array(layer.weight), "bias": _array(layer.bias)}


def _array(tensor: Tensor) -> Values:
    return np.ascontiguousarray(tensor.detach().numpy(), dtype=np.float32)


def _export(net: Network, inputs: Values, part: str) -> ExportedNetwork:
    """Return a network for inputs (n, window, rows, columns) or (n, rows, columns)."""
    flush(net)
    with torch.no_grad():
        outputs = _array(net(torch.from_numpy(inputs)))
    model = onnx_file(net, inputs.shape[1:], "inputs", "outputs", outputs.shape[1])
    _compare(run(model, inputs), outputs)
    return ExportedNetwork({part: model}, inputs[:GOLDEN], outputs[:GOLDEN])


def _compare(given: Values, outputs: Values) -> None:
    """Raise ExportError if outputs, (n, width), differ by more than `TOLERANCE`."""
    worst = float(np.abs(given - outputs).max())
    if not worst <= TOLERANCE:  # NaN is refused as well
        raise ExportError(
            f"PyTorch and ONNX Runtime differ by {worst:.1e}, more than {TOLERANCE:.0e}"
        )


def run(model: bytes, inputs: Values) -> Values:
    """Return the outputs (n, width) that ONNX Runtime computes from inputs (n, ...)."""
    return np.asarray(onnxruntime_engine.network(model)(inputs), dtype=np.float32)
