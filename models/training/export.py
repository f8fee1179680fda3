"""From trained networks to a bundle that proves itself: ONNX, golden vectors, card.

The ONNX graphs are written node by node, so that the file holds exactly what the device
runs, and nothing of the program that trained it. Before anything is written the two engines
are compared.
"""

import io
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
import tomli_w
import torch
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper
from torch import nn

from controller.bundles import bundle, users_table
from controller.bundles.bundle import Bundle
from controller.bundles.inference import onnxruntime_engine
from controller.recognition.debounce import DebounceSettings
from controller.recognition.preprocess import PreprocessSettings
from models.training.networks import GAIN, GestureNet, LocationNet

OPSET: Final = 17  # old enough for every ONNX Runtime that has wheels for Python 3.11
IR_VERSION: Final = 8
AGREE: Final = 1e-5  # greatest difference between PyTorch and ONNX Runtime
TINY: Final = 1e-12  # smaller weights are set to 0: subnormal ones make inference 2.6 x slower
GOLDEN: Final = 64  # questions kept in the bundle, of each kind

Weights = dict[str, NDArray[np.float32]]


class ExportError(ValueError):
    """The exported networks do not answer like the trained ones."""


@dataclass(frozen=True, slots=True)
class Part:
    """One network as a bundle holds it.

    Attributes:
        onnx: The network; empty where there is none.
        questions: Golden questions.
        answers: Its answers to them.
    """

    onnx: bytes
    questions: NDArray[np.float32]
    answers: NDArray[np.float32]


def gesture_part(net: GestureNet, windows: NDArray[np.float32]) -> tuple[Part, float]:
    """Return CNN-3D as a part, and the greatest difference between the two engines.

    Args:
        net: Trained; its smallest weights become 0.
        windows: Real windows for the comparison; the first `GOLDEN` become golden vectors.

    Raises:
        ExportError: The engines differ by more than `AGREE`.
    """
    flush(net)
    with torch.no_grad():
        answers = torch.softmax(net(torch.from_numpy(windows)), dim=1).numpy()
    onnx_file = gesture_model(net, windows.shape[1:])
    return _part(onnx_file, windows, answers)


def location_part(net: LocationNet, images: NDArray[np.float32]) -> tuple[Part, float]:
    """Return CNN-2D as a part, likewise; `images` are real images of touches."""
    flush(net)
    with torch.no_grad():
        answers = net(torch.from_numpy(images)).numpy()
    onnx_file = location_model(net, images.shape[1:])
    return _part(onnx_file, images, answers)


def parts_of(loaded: Bundle) -> tuple[Part, Part]:
    """Return the networks of another bundle, as they are: the gestures', the location's."""
    golden = loaded.golden
    return (
        Part(loaded.gesture_onnx, golden.windows, golden.probabilities),
        Part(loaded.location_onnx, golden.images, golden.touches),
    )


def no_location(rows: int, columns: int) -> Part:
    """Return the part of a bundle that locates nothing."""
    images = np.empty((0, rows, columns), dtype=np.float32)
    return Part(b"", images, np.empty((0, 2), dtype=np.float32))


def write_bundle(
    path: Path, manifest: dict[str, Any], gesture: Part, location: Part, people: Part | None = None
) -> None:
    """Write a bundle, complete or not at all.

    Args:
        path: Where to.
        manifest: What bundle.toml says; it has a table [users] where there are people.
        gesture: CNN-3D.
        location: CNN-2D.
        people: The user network, asked what the gesture network was asked.

    Raises:
        BundleError: It would be refused when it is read.
    """
    golden = {
        "windows": gesture.questions,
        "probabilities": gesture.answers,
        "images": location.questions,
        "touches": location.answers,
    }
    parts = {"gesture.onnx": gesture.onnx, "location.onnx": location.onnx}
    if people is not None:
        golden["people"], parts[users_table.NETWORK] = people.answers, people.onnx
    parts[bundle.GOLDEN] = _npz(golden)
    bundle.write(path, manifest=tomli_w.dumps(manifest).encode(), parts=parts)


def manifest(
    labels: tuple[str, ...],
    shape: tuple[int, int],
    pitch_mm: float,
    preprocess: PreprocessSettings,
    debounce: DebounceSettings,
    mapping: dict[str, Any],
    card: dict[str, Any],
) -> dict[str, Any]:
    """Return what bundle.toml says, as a table."""
    return {
        "format": bundle.FORMAT,
        "labels": list(labels),
        "rows": shape[0],
        "columns": shape[1],
        "pitch_mm": pitch_mm,
        "rate_hz": preprocess.rate_hz,
        "window": preprocess.window,
        "preprocess": asdict(preprocess),
        "debounce": asdict(debounce),
        "mapping": mapping,
        "card": card,
    }


def flush(net: nn.Module) -> None:
    """Set weights that are all but zero to zero, in place."""
    with torch.no_grad():
        for parameter in net.parameters():
            parameter[parameter.abs() < TINY] = 0.0


def gesture_model(net: GestureNet, shape: tuple[int, ...]) -> bytes:
    """Return CNN-3D as an ONNX file; `shape` is (window, rows, columns)."""
    graph = _Graph(net)
    x = graph.trunk("windows", shape)
    graph.node("Softmax", graph.dense(x, "out"), name="probabilities", axis=1)
    return graph.file("gesture", "windows", shape, "probabilities", net.out.out_features)


def location_model(net: LocationNet, shape: tuple[int, ...]) -> bytes:
    """Return CNN-2D as an ONNX file; `shape` is (rows, columns)."""
    graph = _Graph(net)
    x = graph.trunk("images", shape)
    x = graph.node("Tanh", graph.dense(x, "out"))
    x = graph.node("Mul", x, graph.constant("reach"))
    graph.node("Add", x, graph.constant("centre"), name="touches")
    return graph.file("location", "images", shape, "touches", 2)


class _Graph:
    """An ONNX graph under construction, over the weights of a network."""

    def __init__(self, net: nn.Module) -> None:
        state = {name: tensor.detach() for name, tensor in net.state_dict().items()}
        self._net = net
        self.weights: Weights = {
            name: np.ascontiguousarray(t.numpy(), dtype=np.float32) for name, t in state.items()
        }
        self._constants: dict[str, NDArray[Any]] = {}
        self._nodes: list[onnx.NodeProto] = []

    def constant(self, name: str, value: NDArray[Any] | None = None) -> str:
        """Name a weight of the network, or a value of its own, for use as an input."""
        self._constants[name] = self.weights[name] if value is None else value
        return name

    def node(self, kind: str, *inputs: str, name: str = "", **attributes: Any) -> str:
        """Add an operator and return the name of its output."""
        output = name or f"{kind.lower()}{len(self._nodes)}"
        self._nodes.append(helper.make_node(kind, inputs, [output], **attributes))
        return output

    def trunk(self, source: str, shape: tuple[int, ...]) -> str:
        """Add what both networks have in common: all up to the last dense layer."""
        x = self.normalise(source, (-1, 1, *shape))
        x = self.conv(self.conv(x, "conv1"), "conv2")
        x = self.node("Flatten", x, axis=1)
        for name in ("dense1", "dense2"):
            x = self.node("Relu", self.dense(x, name))
        return x

    def normalise(self, source: str, shape: tuple[int, ...]) -> str:
        """Add one channel, and scale: (z - 1) x GAIN."""
        x = self.node("Reshape", source, self.constant("shape", np.array(shape, dtype=np.int64)))
        x = self.node("Sub", x, self.constant("one", np.array(1.0, dtype=np.float32)))
        return self.node("Mul", x, self.constant("gain", np.array(GAIN, dtype=np.float32)))

    def conv(self, x: str, layer: str) -> str:
        """Add a convolution with its relu."""
        module = self._net.get_submodule(layer)
        assert isinstance(module, nn.Conv2d | nn.Conv3d)
        weight, bias = self.constant(f"{layer}.weight"), self.constant(f"{layer}.bias")
        padding = [int(p) for p in module.padding]  # symmetric: begin and end alike
        strides = [int(s) for s in module.stride]
        x = self.node("Conv", x, weight, bias, pads=padding + padding, strides=strides)
        return self.node("Relu", x)

    def dense(self, x: str, layer: str) -> str:
        """Add a dense layer."""
        weight, bias = self.constant(f"{layer}.weight"), self.constant(f"{layer}.bias")
        return self.node("Gemm", x, weight, bias, transB=1)

    def file(
        self, title: str, source: str, shape: tuple[int, ...], result: str, width: int
    ) -> bytes:
        """Return the checked ONNX file."""
        take = helper.make_tensor_value_info(source, TensorProto.FLOAT, ["batch", *shape])
        give = helper.make_tensor_value_info(result, TensorProto.FLOAT, ["batch", width])
        values = [numpy_helper.from_array(v, name) for name, v in self._constants.items()]
        graph = helper.make_graph(self._nodes, title, [take], [give], values)
        opset = helper.make_opsetid("", OPSET)
        model = helper.make_model(graph, opset_imports=[opset], producer_name="orbtouch")
        model.ir_version = IR_VERSION
        onnx.checker.check_model(model, full_check=True)
        return bytes(model.SerializeToString(deterministic=True))


def _part(
    model: bytes, questions: NDArray[np.float32], answers: NDArray[np.float32]
) -> tuple[Part, float]:
    """Compare the engines, and return the part with its first questions as golden ones."""
    worst = float(np.abs(_run(model, questions) - answers).max())
    if not worst <= AGREE:  # NaN is refused as well
        raise ExportError(f"PyTorch and ONNX Runtime differ by {worst:.1e}, more than {AGREE:.0e}")
    return Part(model, questions[:GOLDEN], answers[:GOLDEN]), worst


def _run(model: bytes, questions: NDArray[np.float32]) -> NDArray[np.float32]:
    session = onnxruntime_engine.session(model)
    name = session.get_inputs()[0].name
    return np.asarray(session.run(None, {name: questions})[0], dtype=np.float32)


def _npz(arrays: dict[str, NDArray[Any]]) -> bytes:
    """Return an uncompressed .npz without dates, the same bytes for the same arrays."""
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()
