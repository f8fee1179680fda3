"""Training: what augmentation may do, what export must prove, and a bundle made from nothing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the [train] extra")

from controller import bundle  # noqa: E402 - after the guard
from controller.preprocess import PreprocessSettings  # noqa: E402
from controller.recognizer import Recognizer  # noqa: E402
from controller.simulator.session import LABELS, simulate  # noqa: E402
from models import export  # noqa: E402
from models.__main__ import main  # noqa: E402
from models.augment import Augmentation  # noqa: E402
from models.dataset import Source, prepare  # noqa: E402
from models.networks import GestureNet, LocationNet  # noqa: E402

pytestmark = pytest.mark.train

CALM = Augmentation(gain=0.0, offset=0.0, noise=0.0, dropout=0.0)


def test_a_mirrored_twist_is_the_opposite_twist_and_nothing_else_changes_its_name() -> None:
    windows = torch.ones(5, 10, 5, 5)
    windows[:, :, 2, 0] = 0.5  # on the left
    labels = torch.arange(5)
    seen = set()
    for seed in range(20):
        varied, names = CALM.windows(windows, labels, LABELS, torch.Generator().manual_seed(seed))
        seen.add(tuple(names.tolist()))
        assert float(varied.min()) == 0.5
        assert names.tolist() in ([0, 1, 2, 3, 4], [0, 1, 2, 4, 3])
    assert len(seen) == 2


def test_an_augmented_touch_stays_where_its_image_shows_it() -> None:
    # A dent in one taxel; after any symmetry the touch must name the taxel with the dent.
    for row, column in [(0, 0), (1, 3), (4, 2)]:
        images = torch.ones(1, 5, 5)
        images[0, row, column] = 0.5
        touches = torch.tensor([[float(column), 4.0 - row]])
        for seed in range(24):
            varied, moved = CALM.images(images, touches, torch.Generator().manual_seed(seed))
            at = int(varied[0].argmin())
            assert moved[0].tolist() == [at % 5, 4 - at // 5]


def test_a_half_turn_fits_a_grid_that_is_not_square() -> None:
    halves = replace(CALM, rotations="half")
    images = torch.ones(1, 3, 5)
    images[0, 2, 1] = 0.5
    seen = set()
    for seed in range(24):
        varied, moved = halves.images(
            images, torch.tensor([[1.0, 0.0]]), torch.Generator().manual_seed(seed)
        )
        at = int(varied[0].argmin())
        assert moved[0].tolist() == [at % 5, 2 - at // 5]
        seen.add(at)
    assert len(seen) == 4


def test_examples_are_varied_only_as_far_as_every_gesture_declares() -> None:
    assert Augmentation.declared(LABELS, 5, 5) == Augmentation()
    assert Augmentation.declared(LABELS, 4, 5).rotations == "half"
    one_way = Augmentation.declared(("null", "press", "twist_cw"), 5, 5)
    assert one_way.mirrors is None  # its mirror image is no gesture here
    unknown = Augmentation.declared(("null", "press", "wave"), 5, 5)
    assert (unknown.rotations, unknown.mirrors) == ("none", None)


def test_windows_never_span_two_sessions() -> None:
    sources = []
    for seed in range(2):
        session = simulate(seed, 0.5)
        sources.append(Source(session.frames, session.label, session.touch))
    examples = prepare(sources, PreprocessSettings())
    for end in examples.ends:
        assert len(set(examples.session[end - 9 : end + 1].tolist())) == 1


def test_subnormal_weights_are_flushed() -> None:
    net = LocationNet(5, 5)
    with torch.no_grad():
        net.dense1.weight[0] = 1e-39
    export.flush(net)
    assert not net.dense1.weight[0].any()


@pytest.mark.parametrize("shape", [(10, 5, 5), (7, 4, 6)])
def test_the_exported_networks_answer_like_the_trained_ones(shape: tuple[int, int, int]) -> None:
    torch.manual_seed(0)
    gesture, location = GestureNet(*shape, 5).eval(), LocationNet(*shape[1:]).eval()
    windows = 1.0 + 0.1 * torch.randn(20, *shape)
    with torch.no_grad():
        probabilities = torch.softmax(gesture(windows), dim=1).numpy()
        touches = location(windows[:, 0]).numpy()
    got = export._run(export.gesture_model(gesture, shape)[0], windows.numpy())
    np.testing.assert_allclose(got, probabilities, atol=1e-6)
    got = export._run(export.location_model(location, shape[1:])[0], windows[:, 0].numpy())
    np.testing.assert_allclose(got, touches, atol=1e-5)


def test_one_command_makes_a_bundle_that_the_device_accepts_and_again_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def make(name: str) -> Path:
        out = tmp_path / name
        small = ["--sessions", "4", "--minutes", "1.5", "--epochs", "2"]
        assert main(["train", *small, "--out", str(out)]) == 0
        return out

    first = make("first.orb")
    loaded = bundle.read(first)
    Recognizer(loaded)  # replays the golden vectors
    assert loaded.labels == LABELS
    assert loaded.card["command"].startswith("models train --sessions 4")
    assert make("second.orb").read_bytes() == first.read_bytes()
    assert main(["evaluate", str(first), "--sessions", "1", "--minutes", "1"]) == 0
    assert "event accuracy" in capsys.readouterr().out


def test_a_missing_folder_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", "--out", str(tmp_path / "absent" / "x.orb")]) == 2
    error = capsys.readouterr().err
    assert "is no directory" in error
    assert error.count("\n") == 1
