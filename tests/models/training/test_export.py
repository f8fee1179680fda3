"""Export and checkpoints: what is written answers, and comes back, as it was."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the [train] extra")

from controller.bundles import container, head  # noqa: E402 - after the guard
from controller.bundles.inference import onnx_reader  # noqa: E402
from controller.recognition.touch_input import TouchInput  # noqa: E402
from models.data.recipe import NetworkRecipe  # noqa: E402
from models.training import checkpoint, export  # noqa: E402
from models.training.networks import gesture_net, location_net  # noqa: E402

pytestmark = pytest.mark.train


def test_subnormal_weights_are_flushed() -> None:
    net: Any = location_net((5, 5), NetworkRecipe())
    with torch.no_grad():
        net.dense1.weight[0] = 1e-39
    export.flush(net)
    assert not net.dense1.weight[0].any()


@pytest.mark.parametrize("shape", [(10, 5, 5), (7, 4, 6)])
@pytest.mark.parametrize("strides", [True, False])
def test_exported_networks_answer_as_trained(shape: tuple[int, int, int], strides: bool) -> None:
    torch.manual_seed(0)
    recipe = NetworkRecipe(strides=strides)
    gesture, location = gesture_net(shape, 5, recipe).eval(), location_net(shape[1:], recipe).eval()
    for net in (gesture, location):
        export.flush(net)  # as an export does: weights of 16 bits
    windows = 1.0 + 0.1 * torch.randn(20, *shape)
    with torch.no_grad():
        probabilities = torch.softmax(gesture(windows), dim=1).numpy()
        touches = location(windows[:, 0]).numpy()
    exported = export.export_gestures(gesture, windows.numpy())
    own = head.read(exported.parts[container.HEAD])
    got = own.probabilities(export.run(exported.parts[container.EMBEDDING], windows.numpy()))
    np.testing.assert_allclose(got, probabilities, atol=1e-6)
    exported = export.export_location(location, windows[:, 0].numpy(), TouchInput())
    got = export.run(exported.parts[container.LOCATION], windows[:, 0].numpy())
    np.testing.assert_allclose(got, touches, atol=1e-5)


def test_the_onnx_package_and_our_reader_find_nothing_wrong() -> None:
    onnx = pytest.importorskip("onnx", reason="the onnx package checks exported files")
    net = gesture_net((10, 5, 5), 5, NetworkRecipe(hidden=(20, 10)))
    exported = export.export_gestures(net.eval(), np.ones((2, 10, 5, 5), np.float32))
    model = exported.parts[container.EMBEDDING]
    onnx.checker.check_model(onnx.load_from_string(model), full_check=True)
    assert onnx_reader.read(model).shape == (1, 10, 5, 5)
    own = head.read(exported.parts[container.HEAD])
    assert own.hidden.shape == (10, 20)


def test_a_checkpoint_holds_what_was_put_in_and_a_damaged_one_is_a_sentence(tmp_path: Path) -> None:
    arrays = {"net.weight": np.arange(6.0).reshape(2, 3)}
    words = {"epochs": [{"loss": float("nan")}], "rng": {"state": 2**100}}
    checkpoint.save(tmp_path / "a.npz", arrays, words)
    found = checkpoint.load(tmp_path / "a.npz")
    assert found is not None
    np.testing.assert_array_equal(found[0]["net.weight"], arrays["net.weight"])
    assert found[1]["rng"] == words["rng"]
    assert checkpoint.load(tmp_path / "b.npz") is None
    (tmp_path / "b.npz").write_bytes((tmp_path / "a.npz").read_bytes()[:-9])
    with pytest.raises(checkpoint.CheckpointError, match="is damaged; remove it"):
        checkpoint.load(tmp_path / "b.npz")
