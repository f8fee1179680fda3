"""Growth of a control step's cost with the grid, the window and the rate.

    python -m tests.benchmarks.scaling [--json]

Networks of the default shape at every size, made by the training machine's own exporter (the
[train] extra) with weights as they are at the start of training: the cost depends on sizes, and
none of these weights is tiny. Each row is the median control step, frame in, gesture out;
`first network` is the share of the gesture network.
"""

import dataclasses
import os
from typing import Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles import container, head
from controller.bundles.bundle import Bundle
from controller.bundles.deploy import selftest
from controller.bundles.golden import Golden
from controller.bundles.inference import onnx_reader, onnx_shapes
from controller.recognition.touch_input import TouchInput

from .results import Results, command_line

GRIDS: Final = (5, 10, 15, 20)
WINDOWS: Final = (10, 20, 40)
RATES: Final = (10.0, 20.0, 50.0, 100.0, 200.0)


def sized(shipped: Bundle, side: int, window: int, rate_hz: float) -> Bundle:
    """Return a bundle like the shipped one, for another grid, window and rate."""
    import torch

    from models.data.recipe import NetworkRecipe
    from models.training.export import export_gestures, export_location
    from models.training.networks import gesture_net, location_net

    torch.manual_seed(0)
    gesture = gesture_net((window, side, side), len(shipped.labels), NetworkRecipe())
    location = location_net((side, side), NetworkRecipe(channels=(16, 32)))
    one = np.ones((1, window, side, side), np.float32)
    exported = export_gestures(gesture.eval(), one)[0].parts
    nothing = Golden(
        np.empty((0, window, side, side), np.float32),
        np.empty((0, len(shipped.labels)), np.float32),
        np.empty((0, side, side), np.float32),
        np.empty((0, 2), np.float32),
    )
    return dataclasses.replace(
        shipped,
        rows=side,
        columns=side,
        rate_hz=rate_hz,
        window=window,
        preprocess=dataclasses.replace(shipped.preprocess, rate_hz=rate_hz, window=window),
        embedding_onnx=exported[container.EMBEDDING],
        head=head.read(exported[container.HEAD], container.MAX_BYTES),
        location_onnx=export_location(location.eval(), one[:, 0], TouchInput())[0].parts[
            container.LOCATION
        ],
        golden=nothing,
    )


def main() -> None:
    arguments, results = command_line(__doc__).parse_args(), Results("scaling")
    shipped = bundles.read(bundles.default_path())
    cases = [(side, 10, 10.0) for side in GRIDS]
    cases += [(5, window, 10.0) for window in WINDOWS[1:]]
    cases += [(5, round(rate_hz), rate_hz) for rate_hz in RATES[1:]]  # a second at any rate
    for side, window, rate_hz in cases:
        bundle = sized(shipped, side, window, rate_hz)
        macs = onnx_shapes.sizes(onnx_reader.read(bundle.embedding_onnx)).macs / 1e6
        best = selftest.measure(bundle).step_us
        name = f"step_us@{side}x{side},{window},{rate_hz:g}Hz"
        results.note(name, best, f"us, {macs:.2f} million MACs, {best * rate_hz / 1e4:.2f} %")
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
