"""Augmentation: examples are varied as their gestures declare, and no further."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

torch = pytest.importorskip("torch", reason="needs the [train] extra")

from controller.bundles import vocabulary  # noqa: E402 - after the guard
from models.data.augment import PLAIN, Symmetry, vary_images, vary_windows  # noqa: E402
from models.data.recipe import UNTOUCHED, Augmentation  # noqa: E402

pytestmark = pytest.mark.train

CALM = replace(UNTOUCHED, turned=1.0, mirrored=0.5)
SHIPPED = vocabulary.shipped()
PAPER = Symmetry.of(SHIPPED, 5, 5)


def seeded(seed: int) -> Any:
    return torch.Generator().manual_seed(seed)


def test_a_mirrored_twist_is_the_opposite_twist_and_nothing_else_changes_its_name() -> None:
    mirroring = replace(UNTOUCHED, mirrored=0.5)
    windows = torch.ones(40, 10, 5, 5)
    windows[:, :, 2, 0] = 0.5  # on the left
    names = torch.arange(40) % 5
    varied, named = vary_windows(mirroring, windows, names, PAPER, seeded(0))
    mirrored = varied[:, 0, 2, 4] == 0.5
    assert 10 < int(mirrored.sum()) < 30
    torch.testing.assert_close(varied[~mirrored], windows[~mirrored])
    other = torch.tensor([0, 1, 2, 4, 3])
    assert named.tolist() == torch.where(mirrored, other[names], names).tolist()


def test_an_example_is_turned_only_as_its_own_gesture_declares() -> None:
    mine = vocabulary.parse(
        '[[gesture]]\nlabel = "press"\nrotations = "all"\nmirror = "self"\n'
        '[[gesture]]\nlabel = "swipe"\n'
        '[[gesture]]\nlabel = "rub"\nrotations = "half"\n',
        "mine",
        Path(),
    )
    symmetry = Symmetry.of(mine, 5, 5)
    assert Symmetry.of(SHIPPED, 4, 5).turns == ((0, 2),) * 5  # quarters need a square
    assert symmetry.turns == ((0,), (0, 1, 2, 3), (0,), (0, 2))
    assert symmetry.mirror == (-1, 1, -1, -1)
    windows = torch.ones(4, 10, 5, 5)
    windows[:, :, 0, 1] = 0.5
    places: list[set[tuple[int, int]]] = [set() for _ in range(4)]
    for seed in range(60):
        varied, names = vary_windows(CALM, windows, torch.arange(4), symmetry, seeded(seed))
        assert names.tolist() == [0, 1, 2, 3]
        for i in range(4):
            places[i].add(divmod(int(varied[i, 0].argmin()), 5))
    assert [len(seen) for seen in places] == [1, 8, 1, 2]
    assert (0, 1) in places[0] & places[2]
    assert symmetry.sentences(mine.labels) == [
        "turned by quarters: press",
        "turned by halves: rub",
        "mirrored: press",
    ]


def test_an_example_is_shifted_only_if_its_gesture_is_the_same_anywhere() -> None:
    mine = vocabulary.parse(
        '[[gesture]]\nlabel = "tap"\nshifts = true\n[[gesture]]\nlabel = "corner"\n', "mine", Path()
    )
    symmetry = Symmetry.of(mine, 4, 6)
    assert symmetry.shifts == (False, True, False)
    assert symmetry.sentences(mine.labels)[-1] == "shifted: tap"
    shifting = replace(UNTOUCHED, shifted=2)
    windows = torch.ones(3, 10, 4, 6)
    windows[:, :, 1, 1] = 0.5
    seen: list[set[tuple[int, int]]] = [set(), set(), set()]
    lost = 0
    for seed in range(200):
        varied, names = vary_windows(shifting, windows, torch.arange(3), symmetry, seeded(seed))
        assert names.tolist() == [0, 1, 2]
        for i in range(3):
            dent = {(row, column) for _, row, column in (varied[i] == 0.5).nonzero().tolist()}
            assert len(dent) <= 1  # for as long as the window lasts
            assert int((varied[i] != 1.0).sum()) == 10 * len(dent)
            lost += not len(dent)
            seen[i] |= dent
    assert seen[0] == seen[2] == {(1, 1)}
    # Two up or two to the left, and it is off the sensor.
    assert seen[1] == {(row, column) for row in range(4) for column in range(4)}
    assert 40 < lost < 110


def test_nothing_is_drawn_for_shifts_where_none_are_declared() -> None:
    windows = torch.rand(6, 10, 5, 5)
    one, other = seeded(3), seeded(3)
    varied, _ = vary_windows(replace(CALM, shifted=0), windows, torch.arange(6) % 5, PAPER, one)
    same, _ = vary_windows(replace(CALM, shifted=2), windows, torch.arange(6) % 5, PAPER, other)
    torch.testing.assert_close(varied, same)
    assert torch.equal(one.get_state(), other.get_state())


@pytest.mark.parametrize(("rows", "columns"), [(5, 5), (3, 5)])
def test_an_augmented_touch_stays_where_its_image_shows_it(rows: int, columns: int) -> None:
    # A dent in one taxel; after any symmetry the touch must name the taxel with the dent.
    press = Symmetry.of(SHIPPED, rows, columns).common([1])
    seen = set()
    for row, column in [(0, 0), (1, 3), (rows - 1, 2)]:
        images = torch.ones(1, rows, columns)
        images[0, row, column] = 0.5
        touches = torch.tensor([[float(column), rows - 1.0 - row]])
        for seed in range(24):
            varied, moved = vary_images(CALM, images, touches, press, seeded(seed))
            at = int(varied[0].argmin())
            assert moved[0].tolist() == [at % columns, rows - 1 - at // columns]
            seen.add(at)
    assert len(seen) > 6


def test_what_breaks_in_training_is_whole_taxels_and_whole_electrodes() -> None:
    broken = replace(UNTOUCHED, electrode=1.0)
    windows = torch.full((40, 10, 4, 6), 1.5)
    varied, _ = vary_windows(broken, windows, torch.zeros(40, dtype=torch.long), PLAIN, seeded(0))
    dead = varied == 1.0
    assert (dead == dead[:, :1]).all()  # for as long as the window lasts
    for one in dead[:, 0]:
        lines = [*one.all(dim=1).tolist(), *one.all(dim=0).tolist()]
        assert sum(lines) == 1
        assert int(one.sum()) in (4, 6)
    alone = replace(UNTOUCHED, dropout=1.0)
    varied, _ = vary_windows(alone, windows, torch.zeros(40, dtype=torch.long), PLAIN, seeded(0))
    assert 0.02 < float((varied == 1.0).float().mean()) < 0.12


def test_augmentation_is_of_no_use_where_it_is_not_asked_for() -> None:
    windows = torch.rand(6, 10, 5, 5)
    same, label = vary_windows(UNTOUCHED, windows, torch.arange(6) % 5, PAPER, seeded(0))
    torch.testing.assert_close(same, windows)
    assert label.tolist() == [0, 1, 2, 3, 4, 0]
    assert Augmentation() != UNTOUCHED
