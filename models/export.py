"""From trained networks to a bundle that proves itself: ONNX, weights, golden vectors, card.

The ONNX graphs are written node by node, so that the file holds exactly what the device
runs, and nothing of the program that trained it. Before anything is written the two engines
are compared.
"""

import io
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
import onnxruntime
import tomli_w
import torch
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper
from torch import nn

from controller import bundle
from controller.debounce import DebounceSettings
from controller.preprocess import PreprocessSettings
from models.networks import GAIN, GestureNet, LocationNet

OPSET: Final = 17  # old enough for every ONNX Runtime that has wheels for Python 3.11
IR_VERSION: Final = 8
AGREE: Final = 1e-5  # greatest difference between PyTorch and ONNX Runtime
TINY: Final = 1e-12  # smaller weights are set to 0: subnormal ones make inference 2.6 x slower
GOLDEN: Final = 64  # questions kept in the bundle, of each kind

Weights = dict[str, NDArray[np.float32]]


class ExportError(ValueError):
    """The exported networks do not answer like the trained ones."""


def write_bundle(
    path: Path,
    gesture: GestureNet,
    location: LocationNet,
    *,
    manifest: dict[str, Any],
    windows: NDArray[np.float32],
    images: NDArray[np.float32],
) -> float:
    """Export, compare and write; return the greatest difference between the two engines.

    Args:
        path: Where the bundle goes.
        gesture: CNN-3D, trained.
        location: CNN-2D, trained.
        manifest: What bundle.toml says (`manifest`).
        windows: Real windows for the comparison; the first `GOLDEN` become golden vectors.
        images: Real press images, likewise.

    Raises:
        ExportError: The engines differ by more than `AGREE`.
    """
    flush(gesture)
    flush(location)
    with torch.no_grad():
        probabilities = torch.softmax(gesture(torch.from_numpy(windows)), dim=1).numpy()
        touches = location(torch.from_numpy(images)).numpy()
    gesture_onnx, gesture_weights = gesture_model(gesture, windows.shape[1:])
    location_onnx, location_weights = location_model(location, images.shape[1:])
    worst = max(
        float(np.abs(_run(gesture_onnx, windows) - probabilities).max()),
        float(np.abs(_run(location_onnx, images) - touches).max()),
    )
    if worst > AGREE:
        raise ExportError(f"PyTorch and ONNX Runtime differ by {worst:.1e}, more than {AGREE:.0e}")
    golden = {
        "windows": windows[:GOLDEN],
        "probabilities": probabilities[:GOLDEN],
        "images": images[:GOLDEN],
        "touches": touches[:GOLDEN],
    }
    bundle.write(
        path,
        manifest=tomli_w.dumps(manifest).encode(),
        parts={
            "gesture.onnx": gesture_onnx,
            "gesture.npz": _npz(gesture_weights),
            "location.onnx": location_onnx,
            "location.npz": _npz(location_weights),
            "golden.npz": _npz(golden),
        },
    )
    return worst


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


def gesture_model(net: GestureNet, shape: tuple[int, ...]) -> tuple[bytes, Weights]:
    """Return CNN-3D as an ONNX file, and its weights; `shape` is (window, rows, columns)."""
    graph = _Graph(net)
    x = graph.trunk("windows", shape)
    graph.node("Softmax", graph.dense(x, "out"), name="probabilities", axis=1)
    return graph.file("gesture", "windows", shape, "probabilities", net.out.out_features)


def location_model(net: LocationNet, shape: tuple[int, ...]) -> tuple[bytes, Weights]:
    """Return CNN-2D as an ONNX file, and its weights; `shape` is (rows, columns)."""
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
        self.weights: Weights = {name: t.numpy().astype(np.float32) for name, t in state.items()}
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
    ) -> tuple[bytes, Weights]:
        """Return the checked ONNX file."""
        take = helper.make_tensor_value_info(source, TensorProto.FLOAT, ["batch", *shape])
        give = helper.make_tensor_value_info(result, TensorProto.FLOAT, ["batch", width])
        values = [numpy_helper.from_array(v, name) for name, v in self._constants.items()]
        graph = helper.make_graph(self._nodes, title, [take], [give], values)
        opset = helper.make_opsetid("", OPSET)
        model = helper.make_model(graph, opset_imports=[opset], producer_name="orbtouch")
        model.ir_version = IR_VERSION
        onnx.checker.check_model(model, full_check=True)
        return model.SerializeToString(deterministic=True), self.weights


def _run(model: bytes, questions: NDArray[np.float32]) -> NDArray[np.float32]:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
    name = session.get_inputs()[0].name
    return np.asarray(session.run(None, {name: questions})[0], dtype=np.float32)


def _npz(arrays: dict[str, NDArray[Any]]) -> bytes:
    """Return an uncompressed .npz without dates, the same bytes for the same arrays."""
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()
