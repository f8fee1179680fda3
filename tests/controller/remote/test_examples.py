"""Pending examples: what counts as one, and how many a folder holds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from controller.remote.examples import FELT, MOST, ExampleError, ExampleStore, firmest, taken
from tests.controller.adapt.test_golden import images

FRAMES = images(((9.0, 14.0),), 5, 5)


def test_sixty_examples_are_kept_and_read_again_and_no_more(tmp_path: Path) -> None:
    store = ExampleStore(tmp_path, (5, 5), 10.0)
    for number in range(MOST):
        store.keep(taken(number, "poke", FRAMES, 10.0))
    with pytest.raises(ExampleError, match="60 examples are waiting"):
        store.keep(taken(MOST, "poke", FRAMES, 10.0))
    (tmp_path / f"example-{MOST}.npz").write_bytes((tmp_path / "example-0.npz").read_bytes())
    again = ExampleStore(tmp_path, (5, 5), 10.0)
    assert len(again.pending) == 60
    assert [one.number for one in store.of("poke")] == list(range(60))
    assert store.drop([3, 4, 99]) == 2
    assert len(list(tmp_path.iterdir())) == 59
    (tmp_path / "example-5.npz").unlink()  # by somebody else
    assert store.drop([5]) == 1


@pytest.mark.parametrize(
    ("frames", "sentence"),
    [
        (FRAMES[:2], "the orb was not ready yet"),
        (np.full((30, 5, 5), 1.0, dtype=np.float32), "nothing touched the orb"),
        (1.0 + (FRAMES - 1.0) * np.float32(0.99 * FELT / 0.33), "nothing touched the orb"),
    ],
)
def test_what_is_no_example_is_said(frames: np.ndarray, sentence: str) -> None:
    with pytest.raises(ExampleError, match=sentence):
        taken(1, "poke", frames, 10.0)


def test_three_images_of_null_are_an_example_as_a_whole() -> None:
    one = taken(1, "null", FRAMES[:3], 10.0)
    assert one.example.span == (0.0, 3.0)


def test_the_firmest_image_is_within_the_touch() -> None:
    found = taken(1, "poke", FRAMES, 10.0).example
    assert np.abs(firmest(found) - 1.0).mean() == np.abs(FRAMES - 1.0).mean(axis=(1, 2)).max()


def test_the_firmest_image_of_a_touch_of_no_length_is_that_where_it_begins() -> None:
    short = replace(taken(1, "poke", FRAMES, 10.0).example, span=(5.0, 5.0))
    assert (firmest(short) == short.images[5]).all()
