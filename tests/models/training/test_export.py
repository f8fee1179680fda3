"""Export and checkpoints: what is written answers, and comes back, as it was."""

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the [train] extra")

from models.training import checkpoint, export  # noqa: E402 - after the guard
from models.training.networks import GestureNet, LocationNet  # noqa: E402

pytestmark = pytest.mark.train


def test_subnormal_weights_are_flushed() -> None:
    net = LocationNet(5, 5)
    with torch.no_grad():
        net.dense1.weight[0] = 1e-39
    export.flush(net)
    assert not net.dense1.weight[0].any()


@pytest.mark.parametrize("shape", [(10, 5, 5), (7, 4, 6)])
@pytest.mark.parametrize("strides", [True, False])
def test_the_exported_networks_answer_like_the_trained_ones(
    shape: tuple[int, int, int], strides: bool
) -> None:
    torch.manual_seed(0)
    gesture = GestureNet(*shape, 5, strides=strides).eval()
    location = LocationNet(*shape[1:], strides=strides).eval()
    windows = 1.0 + 0.1 * torch.randn(20, *shape)
    with torch.no_grad():
        probabilities = torch.softmax(gesture(windows), dim=1).numpy()
        touches = location(windows[:, 0]).numpy()
    got = export._run(export.gesture_model(gesture, shape), windows.numpy())
    np.testing.assert_allclose(got, probabilities, atol=1e-6)
    got = export._run(export.location_model(location, shape[1:]), windows[:, 0].numpy())
    np.testing.assert_allclose(got, touches, atol=1e-5)


@pytest.mark.parametrize("window", range(2, 14))
def test_the_last_step_in_time_ends_at_the_newest_image(window: int) -> None:
    net = GestureNet(window, 5, 5, 5)
    steps = (window - net.conv1.kernel_size[0]) / 2
    assert steps.is_integer()
    assert ((steps + 1 - net.conv2.kernel_size[0]) / 2).is_integer()
    assert net(torch.ones(1, window, 5, 5)).shape == (1, 5)


def test_normalisation_is_worked_into_the_weights() -> None:
    torch.manual_seed(0)
    net = GestureNet(10, 5, 5, 5, normalised=True)
    windows = 1.0 + 0.1 * torch.randn(50, 10, 5, 5)
    for _ in range(20):
        net(windows)  # it gets to know what is usual
    with torch.no_grad():
        for name, parameter in net.norms.named_parameters():
            parameter.uniform_(*((0.5, 2.0) if name.endswith("weight") else (-0.5, 0.5)))
        plain = net.eval().folded().eval()
        assert not plain.norms
        torch.testing.assert_close(plain(windows), net(windows), rtol=1e-4, atol=1e-5)
        where = LocationNet(5, 5, normalised=True).eval()
        images = windows[:, 0]
        torch.testing.assert_close(where.folded()(images), where(images), rtol=1e-4, atol=1e-5)


def test_a_checkpoint_holds_what_was_put_into_it_and_a_damaged_one_is_a_sentence(
    tmp_path: Path,
) -> None:
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
