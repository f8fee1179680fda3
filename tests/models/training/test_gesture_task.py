"""Examples that an epoch of CNN-3D draws, and the precision of computing with them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from controller.shared.aliases import Index

pytest.importorskip("torch", reason="needs the [train] extra")

import torch

from controller.bundles import vocabulary
from models.data.augment import Symmetry
from models.data.examples import Examples
from models.data.recipe import DEFAULT, PAPER, NetworkRecipe, Recipe
from models.data.splits import Parts
from models.results.training import Epoch
from models.training import loop
from models.training.gesture_task import GestureTask
from models.training.loop import fit
from models.training.networks import gesture_net

pytestmark = pytest.mark.train

WINDOW = 10
QUIET, PRESSED = 1000, 100  # frames; what is pressed lies between two quiet stretches
COUNT = 2 * QUIET + PRESSED
IDLE = 0.005


def task(recipe: NetworkRecipe, auxiliary: int = 0, answers: int = 0) -> GestureTask:
    """A task of one press in a long quiet, and of a twist that is no answer."""
    rng = np.random.default_rng(1)
    pressed = slice(QUIET, QUIET + PRESSED)
    images = (1.0 + 0.006 * rng.standard_normal((COUNT, 5, 5))).astype(np.float32)
    images[pressed] += 0.1
    label = np.zeros(COUNT, dtype=np.int64)
    label[pressed] = 1
    label[COUNT - auxiliary :] = 4
    ends = np.arange(WINDOW - 1, COUNT)
    idle = np.full(COUNT, IDLE, dtype=np.float32)
    nowhere = np.full((COUNT, 2), np.nan, dtype=np.float32)
    examples = Examples(images, label, nowhere, ends, np.zeros(COUNT, dtype=np.int32), idle, WINDOW)
    none = np.empty(0, dtype=np.int64)
    symmetry = Symmetry.of(vocabulary.shipped(), 5, 5)
    parts = Parts(np.arange(len(ends)), none, none)
    return GestureTask(examples, parts, 5, symmetry, recipe, torch.device("cpu"), answers)


def drawn(recipe: NetworkRecipe) -> tuple[int, int]:
    """How many windows of an epoch are pressed, and how many are quiet."""
    ends = np.concatenate(list(task(recipe).batches(np.random.default_rng(2))))
    assert len(np.unique(ends)) == len(ends)
    pressed = int(((ends >= QUIET) & (ends < QUIET + PRESSED)).sum())
    return pressed, len(ends) - pressed


def test_all_that_is_pressed_is_drawn_and_half_of_what_is_quiet() -> None:
    assert drawn(DEFAULT.gesture) == (PRESSED, round(0.5 * (2 * QUIET - (WINDOW - 1))))


def test_the_paper_s_recipe_draws_everything() -> None:
    recipe = replace(PAPER.gesture, strides=True)
    assert sum(drawn(recipe)) == COUNT - (WINDOW - 1)


@pytest.mark.parametrize(("course", "expected"), [(DEFAULT, "medium"), (PAPER, "highest")])
def test_products_are_coarse_in_training_as_the_recipe_says(course: Recipe, expected: str) -> None:
    taught = task(replace(course.gesture, epochs=1, strides=True))
    said = []
    loss, judge, taught.check = taught.loss, taught.judge, taught.ends["train"][:1]

    def learning(batch: Index, generator: torch.Generator) -> tuple[torch.Tensor, float]:
        said.append(("learns", torch.get_float32_matmul_precision()))
        return loss(batch, generator)

    def judging(examples: Index) -> tuple[float, float]:
        said.append(("is judged", torch.get_float32_matmul_precision()))
        return judge(examples)

    taught.loss, taught.judge = learning, judging  # type: ignore[method-assign]
    fit(taught, 0)
    assert set(said) == {("learns", expected), ("is judged", "highest")}


def test_what_is_held_out_neither_ends_a_training_nor_picks_an_epoch() -> None:
    recipe = replace(DEFAULT.gesture, epochs=6, channels=(2, 2), hidden=(4, 4))
    tasks = []
    for _ in range(2):
        torch.manual_seed(5)
        tasks.append(task(recipe))
    plain, judged = tasks
    judged.check = judged.ends["train"][:1]
    losses = iter([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])  # worse from epoch to epoch
    judged.judge = lambda examples: (next(losses), 0.0)  # type: ignore[method-assign]
    assert [epoch.number for epoch in fit(judged, 0)] == [1, 2, 3, 4, 5, 6]
    fit(plain, 0)
    for name, tensor in plain.net.state_dict().items():
        torch.testing.assert_close(judged.net.state_dict()[name], tensor)


def test_auxiliary_gestures_count_more_where_they_are_rare_and_change_no_other_s_weight() -> None:
    recipe = DEFAULT.gesture
    plain, beside = task(recipe)._weights, task(recipe, auxiliary=25, answers=4)._weights
    assert beside[:4].tolist() == plain[:4].tolist() == [1.0] * 4
    assert beside[4] == pytest.approx(2.0)  # a quarter as many, to the power of a half


def test_a_narrowed_network_tells_the_first_classes_apart_as_before() -> None:
    torch.manual_seed(3)
    net = gesture_net((WINDOW, 5, 5), 7, NetworkRecipe()).eval()
    windows = 1.0 + 0.1 * torch.randn(4, WINDOW, 5, 5)
    with torch.no_grad():
        torch.testing.assert_close(net.narrowed(3)(windows), net(windows)[:, :3])


def test_a_course_is_as_long_however_many_windows_there_are() -> None:
    recipe = replace(DEFAULT.gesture, steps=16, batch=10, limits=(8, 100))
    taught = task(recipe)
    assert len(taught.ends["train"]) > 16 * 10
    assert (taught.steps(), recipe.passes(taught.steps() * recipe.batch)) == (2, 8)
    assert task(replace(recipe, epochs=3)).steps() == 110  # all of them, if epochs are asked for


def test_a_course_may_have_whole_epochs_at_least() -> None:
    recipe = replace(DEFAULT.gesture, steps=16, batch=10, limits=(1, 100), whole=3)
    assert (task(recipe).steps(), recipe.passes(1100)) == (110, 3)  # all windows are drawn
    assert recipe.passes(20) == 8  # few windows come by more often, until `steps` are done


def test_weights_are_averaged_over_the_last_part_of_a_course_also_of_an_interrupted_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = replace(DEFAULT.gesture, epochs=4, batch=700, channels=(2, 2), hidden=(4, 4))
    recipe = replace(recipe, averaged=0.5, dropped=0.3)
    weights: list[torch.Tensor] = []
    average = loop._Run._average

    def watched(self: loop._Run, step: int) -> None:
        weights.append(self.net.state_dict()["out.weight"].clone())
        average(self, step)

    def stop(epoch: Epoch) -> None:
        if epoch.number == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(loop._Run, "_average", watched)
    tasks = []
    for _ in range(2):
        torch.manual_seed(5)
        tasks.append(task(recipe))
    whole, resumed = tasks
    fit(whole, 0)
    mean = torch.stack(weights[len(weights) // 2 :]).mean(dim=0)
    torch.testing.assert_close(whole.net.state_dict()["out.weight"], mean)
    with pytest.raises(KeyboardInterrupt):
        fit(resumed, 0, tmp_path / "kept.npz", stop)
    fit(resumed, 0, tmp_path / "kept.npz")
    torch.testing.assert_close(resumed.net.state_dict()["out.weight"], mean)
