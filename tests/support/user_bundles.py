"""Bundles that know people, for tests: the shipped one with small networks besides.

Who touches left of the middle is Ann, who touches right of it is Bob, as far as the user network
can tell: it weighs the taxels of a window, and nothing else. Ann's own rows of the head make
a pinch of all that she does.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from controller.adapt import lessons
from controller.adapt.examples import Example
from controller.adapt.own_frames import OwnFrames
from controller.bundles import bundle, container
from controller.bundles.head import Head
from controller.shared import npz
from tests.support import onnx_files

SHIPPED = bundle.default_path(10.0)
NAMES = ("ann", "bob")
TABLE = """
[users]
names = ["ann", "bob"]
gestures = ["press", "pinch", "twist_cw", "twist_ccw"]
temperature = 1.0
accept = 0.9
stay = 0.98
forget_s = 30.0

[users.mapping.bob]
pinch = "hold"
"""

Array = NDArray[np.float32]


def dense(weight: Array, bias: Array) -> bytes:
    """A network that weighs all taxels of a 10×5×5 window: softmax of a sum for each output."""
    arrays = {
        "flat": np.array([-1, 250]),
        "one": np.ones(1, np.float32),
        "gain": weight.astype(np.float32),
        "offset": bias.astype(np.float32),
    }
    transposed = onnx_files.text(1, "transB") + onnx_files.number(3, 1) + onnx_files.number(20, 2)
    return onnx_files.model(
        onnx_files.node("Reshape", "x flat", "long"),
        onnx_files.node("Sub", "long one", "felt"),
        onnx_files.node("Gemm", "felt gain offset", "sum", transposed),
        onnx_files.node("Softmax", "sum", "y"),
        *(onnx_files.stored(name, array) for name, array in arrays.items()),
        onnx_files.value(11, "x", 0, 10, 5, 5),
        onnx_files.value(12, "y", 0, len(bias)),
    )


def answers(weight: Array, bias: Array, windows: Array) -> Array:
    """What `dense` answers, by NumPy."""
    total = (windows.reshape(len(windows), -1) - 1.0) @ weight.T + bias
    power = np.exp(total - total.max(axis=1, keepdims=True))
    return np.asarray(power / power.sum(axis=1, keepdims=True), dtype=np.float32)


def left_or_right() -> tuple[Array, Array]:
    """Weights and bias of the user network; nobody enrolled touches where little is felt."""
    side = np.zeros((3, 10, 5, 5), dtype=np.float32)
    side[1, :, :, :2] = side[2, :, :, 3:] = -1.0  # a touch takes capacitance
    return side.reshape(3, 250), np.array([0.5, 0.0, 0.0], dtype=np.float32)


def pinches() -> Head:
    """Ann's rows of the head: whatever is embedded, a pinch is far more probable."""
    head = bundle.read(SHIPPED).head
    none, bias = np.zeros((1, head.hidden.shape[1]), np.float32), np.zeros(5, np.float32)
    bias[2] = 100.0
    return Head(none, np.zeros(1, np.float32), np.zeros((5, 1), np.float32), bias)


def manifest(table: str = TABLE) -> bytes:
    """The shipped manifest, with users."""
    text = container.unpack(SHIPPED.read_bytes())[container.MANIFEST].decode()
    return (text + table).encode()


def parts() -> dict[str, bytes]:
    """The shipped parts, and those of Ann and Bob."""
    own = container.content(container.unpack(SHIPPED.read_bytes()))
    golden = npz.unpack(own[container.GOLDEN], container.MAX_BYTES)
    who = left_or_right()
    golden["people"] = answers(*who, golden["windows"])
    example = Example("pinch", np.ones((3, 5, 5), np.float32), "ann", span=(0.0, 3.0))
    loaded = bundle.read(SHIPPED)
    none = OwnFrames.none(loaded.head.hidden.shape[1])
    taught = lessons.pack_taught([example], none, loaded.debounce, {"ann": pinches()})
    own |= {container.USER: dense(*who), container.TAUGHT: taught}
    return own | {container.GOLDEN: npz.pack(golden)}


def write(path: Path, table: str = TABLE) -> Path:
    """Write a bundle that knows Ann and Bob."""
    bundle.write(path, manifest=manifest(table), parts=parts())
    return path
