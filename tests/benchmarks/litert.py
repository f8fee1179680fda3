"""A peer: LiteRT (TensorFlow Lite) on a network of ours, written in its own form.

LiteRT reads flat buffers, and nothing small converts ONNX to them, so the few operators of our
networks are written here, as its converter would: channels last, activations fused.
"""

import importlib
import importlib.util
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.bundles.inference import onnx_reader
from controller.bundles.inference.engines import Network
from controller.bundles.inference.networks import TOLERANCE

NAME: Final = "ai_edge_litert"
_TO_LAST: Final = (0, 2, 3, 4, 1)  # from (batch, channels, time, rows, columns)


def peer(bundle: Bundle) -> Network | str:
    """Return a bundle's gesture network in LiteRT, proved; text says why there is none."""
    if importlib.util.find_spec(NAME) is None:
        return "missing: LiteRT (the [bench] extra)"
    run, golden = network(bundle.gesture_onnx), bundle.golden
    for question, answer in zip(golden.windows, golden.probabilities, strict=True):
        if not np.abs(run(question[None])[0] - answer).max() <= TOLERANCE:
            return "missing: LiteRT answers differently"
    return run


def network(model: bytes) -> Network:
    """Return an ONNX file's network in LiteRT, one thread.

    Raises:
        ValueError: It has an operator that is not written here.
    """
    read = onnx_reader.read(model)
    content = _Writer(read).content()
    interpreter = importlib.import_module(f"{NAME}.interpreter").Interpreter(
        model_content=content, num_threads=1
    )
    interpreter.allocate_tensors()
    (entry,), (exit_,) = interpreter.get_input_details(), interpreter.get_output_details()
    given, made = entry["index"], exit_["index"]

    def run(batch: NDArray[np.float32]) -> NDArray[np.float32]:
        interpreter.set_tensor(given, batch)
        interpreter.invoke()
        answer: NDArray[np.float32] = interpreter.get_tensor(made)
        return answer

    return run


class _Writer:
    """Writes one graph, node by node."""

    def __init__(self, read: onnx_reader.Graph) -> None:
        self._read = read
        self._schema: Any = importlib.import_module(f"{NAME}.schema_py_generated")
        self._model = self._schema.ModelT()
        self._model.version = 3
        self._model.buffers = [self._schema.BufferT()]
        self._model.operatorCodes = []
        self._graph = self._schema.SubGraphT()
        self._graph.tensors, self._graph.operators = [], []
        self._model.subgraphs = [self._graph]
        self._shapes: list[tuple[int, ...]] = []

    def content(self) -> bytes:
        """Return the flat buffer."""
        at = self._tensor(self._read.shape)
        self._graph.inputs = [at]
        nodes = list(self._read.nodes)
        while nodes:
            node = nodes.pop(0)
            relu = bool(nodes) and nodes[0].op == "Relu"
            if relu and node.op in ("Conv", "Gemm"):
                nodes.pop(0)
            at = self._write(node, at, relu=relu)
        self._graph.outputs = [at]
        builder = importlib.import_module("flatbuffers").Builder()
        builder.Finish(self._model.Pack(builder), b"TFL3")
        return bytes(builder.Output())

    def _write(self, node: onnx_reader.Node, at: int, *, relu: bool) -> int:
        """Add what a node does to tensor `at`, and return the tensor that it makes."""
        weights = [self._read.weights[name] for name in node.inputs if name in self._read.weights]
        match node.op:
            case "Reshape":  # the one channel is last here
                return self._reshape(at, (*self._shapes[at], 1))
            case "Sub" | "Mul":
                kind = node.op.upper()
                value = self._constant(weights[0].astype(np.float32).reshape(1))
                return self._operator(kind, [at, value], self._shapes[at], f"{node.op}Options")
            case "Conv":
                return self._conv(node, at, *weights, relu=relu)
            case "Flatten":
                return self._reshape(at, (1, int(np.prod(self._shapes[at]))))
            case "Gemm":
                return self._dense(at, *weights, relu=relu)
            case "Softmax":
                return self._operator("SOFTMAX", [at], self._shapes[at], "SoftmaxOptions", beta=1.0)
        raise ValueError(f"{node.op} is not written for LiteRT")

    def _conv(self, node: onnx_reader.Node, at: int, kernel: Any, bias: Any, *, relu: bool) -> int:
        """Add a 3D convolution; padding that LiteRT has no word for goes before it."""
        pads: Any = node.attributes.get("pads", (0,) * 6)
        strides: Any = node.attributes.get("strides", (1, 1, 1))
        sizes, window = self._shapes[at][1:4], kernel.shape[2:]
        around = [(pads[i], pads[i + 3]) for i in range(3)]
        same = [_same(*each) for each in zip(sizes, window, strides, strict=True)]
        if around != same and any(map(any, around)):
            margins = np.array([(0, 0), *around, (0, 0)], dtype=np.int32)
            sizes = tuple(n + sum(pair) for n, pair in zip(sizes, around, strict=True))
            shape = (1, *sizes, self._shapes[at][4])
            at = self._operator("PAD", [at, self._constant(margins)], shape, "PadOptions")
            around = [(0, 0)] * 3
        out = [
            (n + sum(pair) - w) // s + 1
            for n, pair, w, s in zip(sizes, around, window, strides, strict=True)
        ]
        # Channels last: (time, rows, columns, in, out).
        inputs = [at, self._constant(kernel.transpose(2, 3, 4, 1, 0)), self._constant(bias)]
        padding = self._schema.Padding
        return self._operator(
            "CONV_3D", inputs, (1, *out, len(kernel)), "Conv3DOptions",
            padding=padding.SAME if any(map(any, around)) else padding.VALID,
            strideD=strides[0], strideH=strides[1], strideW=strides[2],
            dilationDFactor=1, dilationHFactor=1, dilationWFactor=1,
            fusedActivationFunction=int(relu),
        )  # fmt: skip

    def _dense(self, at: int, kernel: Any, bias: Any, *, relu: bool) -> int:
        """Add a dense layer; behind a convolution its columns are put in our order."""
        before = self._graph.operators[-1] if self._graph.operators else None
        if before is not None and len(self._shapes[before.inputs[0]]) == 5:
            _, time, rows, columns, channels = self._shapes[before.inputs[0]]
            split = kernel.reshape(-1, channels, time, rows, columns)
            kernel = split.transpose(_TO_LAST).reshape(len(kernel), -1)
        inputs = [at, self._constant(kernel), self._constant(bias)]
        return self._operator(
            "FULLY_CONNECTED", inputs, (1, len(kernel)), "FullyConnectedOptions",
            fusedActivationFunction=int(relu),
        )  # fmt: skip

    def _reshape(self, at: int, shape: tuple[int, ...]) -> int:
        to = self._constant(np.array(shape, dtype=np.int32))
        return self._operator("RESHAPE", [at, to], shape, "ReshapeOptions", newShape=list(shape))

    def _operator(
        self, kind: str, inputs: list[int], shape: tuple[int, ...], options: str, **values: Any
    ) -> int:
        """Add an operator, and return the tensor that it makes."""
        code = self._schema.OperatorCodeT()
        code.builtinCode = getattr(self._schema.BuiltinOperator, kind)
        code.deprecatedBuiltinCode, code.version = min(code.builtinCode, 127), 1
        self._model.operatorCodes.append(code)
        operator = self._schema.OperatorT()
        operator.opcodeIndex = len(self._model.operatorCodes) - 1
        operator.builtinOptionsType = getattr(self._schema.BuiltinOptions, options)
        operator.builtinOptions = getattr(self._schema, f"{options}T")()
        for name, value in values.items():
            setattr(operator.builtinOptions, name, value)
        operator.inputs, operator.outputs = inputs, [self._tensor(shape)]
        self._graph.operators.append(operator)
        made: int = operator.outputs[0]
        return made

    def _constant(self, array: NDArray[Any]) -> int:
        return self._tensor(array.shape, array)

    def _tensor(self, shape: tuple[int, ...], array: NDArray[Any] | None = None) -> int:
        """Add a tensor, with its values if they are known, and return its number."""
        tensor = self._schema.TensorT()
        tensor.shape, tensor.buffer = list(shape), 0
        tensor.type = self._schema.TensorType.FLOAT32
        if array is not None:
            if array.dtype == np.int32:
                tensor.type = self._schema.TensorType.INT32
            buffer = self._schema.BufferT()
            buffer.data = np.frombuffer(np.ascontiguousarray(array).tobytes(), dtype=np.uint8)
            self._model.buffers.append(buffer)
            tensor.buffer = len(self._model.buffers) - 1
        self._graph.tensors.append(tensor)
        self._shapes.append(tuple(shape))
        return len(self._shapes) - 1


def _same(size: int, window: int, stride: int) -> tuple[int, int]:
    """Return the padding before and behind that LiteRT calls SAME."""
    total = max((-(-size // stride) - 1) * stride + window - size, 0)
    return total // 2, total - total // 2
