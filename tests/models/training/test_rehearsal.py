"""Windows to rehearse are chosen from those of a training: every gesture, and rest beside it."""

from functools import cache

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the [train] extra")

from controller.adapt.lessons import UNTOUCHED
from controller.bundles import bundle, container
from controller.shared import npz
from models.data import examples
from models.data.examples import Examples, Source
from models.data.simulate import DataSet
from models.training import export

pytestmark = pytest.mark.train
SHIPPED = bundle.read(bundle.default_path(10.0))


@cache
def played() -> Examples:
    """Three minutes of play at 10 Hz."""
    sessions = [DataSet(seed=77, minutes=1.0).session(user, 0) for user in range(3)]
    return examples.prepare(map(Source.of, sessions), SHIPPED.preprocess)


def test_touches_of_all_gestures_are_chosen_and_rest_beside_them() -> None:
    data = played()
    ends, touch = export.choose(data, data.ends, 5, np.random.default_rng(0))
    assert len(ends) == len(touch) == len(np.unique(ends))
    assert np.isin(ends, data.ends).all()
    assert set(data.label[ends[touch >= 0]].tolist()) == {1, 2, 3, 4}
    assert (data.label[ends[touch < 0]] == 0).all()
    assert (touch >= 0).mean() == pytest.approx(export.TOUCHED, abs=0.01)
    for number in range(touch.max() + 1):
        own = ends[touch == number]
        assert 1 <= len(own) <= export.EACH
        assert len(set(data.label[own[0] : own[-1] + 1].tolist())) == 1  # one touch, unbroken


def test_auxiliary_classes_are_left_out() -> None:
    data = played()
    ends, _ = export.choose(data, data.ends, 3, np.random.default_rng(0))
    assert data.label[ends].max() == 2


def test_the_part_holds_embeddings_and_an_image_of_each_gesture() -> None:
    data, model = played(), SHIPPED.embedding_onnx
    part = export.rehearsal(model, data, data.ends, 5, 0)
    assert part == export.rehearsal(model, data, data.ends, 5, 0)
    arrays = npz.unpack(part, container.MAX_BYTES)
    assert arrays["embedding"].shape == (len(arrays["touch"]), 96)
    assert arrays["embedding"].max() == 255
    assert (arrays["firmest"][0] == UNTOUCHED).all()
    press = np.abs(arrays["firmest"][1].astype(int) - UNTOUCHED)
    assert press.max() > 10
