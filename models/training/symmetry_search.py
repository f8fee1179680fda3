"""Search for the symmetries of gestures that no vocabulary declares, judged on people held out.

Short trainings try one kind of symmetry after the other, for all gestures alike. A kind is kept if
it lowers the loss, and classifies more windows, of people that the trainings did not see.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import torch
from torch.nn import functional

from controller.bundles.vocabulary import SELF, Vocabulary
from controller.shared.aliases import Index
from models.data.augment import Symmetry
from models.data.load import Data
from models.data.recipe import NetworkRecipe
from models.data.splits import Parts
from models.training.gesture_task import GestureTask
from models.training.loop import fit

STEPS: Final = 120  # batches of each trial
BATCH: Final = 128  # windows
# Windows that a trial learns from, evenly spread. Of so few each comes by often, as all do in a
# full training; of many, none would be learned by heart in a short one, and no symmetry needed.
LEARNED: Final = 2_000
JUDGED: Final = 3_000  # windows that it is judged on, evenly spread
LESS: Final = 0.99  # highest loss of a kind that is kept, relative to the loss without it
# entries of gestures.toml, in the order in which they are tried
KINDS: Final[Mapping[str, dict[str, Any]]] = {
    "shifts = true": {"shifts": True},
    'mirror = "self"': {"mirror": SELF},
    'rotations = "half"': {"rotations": "half"},
}

Judge = Callable[[Vocabulary], tuple[float, float]]  # loss, and share of right answers


@dataclass(frozen=True, slots=True)
class Proposal:
    """Symmetries found by a search."""

    vocabulary: Vocabulary  # the gestures, with the symmetries that help
    points: dict[str, float]  # gain of each kind that is kept, points of windows

    @property
    def words(self) -> str:
        """The kinds that are kept as lines of gestures.toml, with their gains."""
        kept = [f"{kind} ({gain:+.1f} points)" for kind, gain in self.points.items()]
        return ", ".join(kept) or "no symmetry helps"


def declared(
    data: Data, parts: Parts, recipe: NetworkRecipe, seed: int, device: torch.device
) -> tuple[Data, str]:
    """Return data with the symmetries that help on what is held out, and the search's result.

    Where they are known, or nothing is held out, the data are unchanged, and the result is "".
    """
    # Nothing is known without a vocabulary, except of the orb's gestures.
    known = data.vocabulary.text or data.settings.normalise != "difference"
    if known or not len(parts.check):
        return data, ""
    judge = trial(data, parts.train, parts.check, recipe, seed, device)
    found = search(judge, data.vocabulary)
    return replace(data, vocabulary=found.vocabulary), found.words


def search(judge: Judge, vocabulary: Vocabulary) -> Proposal:
    """Return the symmetries by which a judge finds more windows right, added one by one."""
    (loss, right), points = judge(vocabulary), {}
    for kind, fields in KINDS.items():
        entries = tuple(replace(entry, **fields) for entry in vocabulary.entries)
        tried = replace(vocabulary, entries=entries)
        less, better = judge(tried)
        if less < LESS * loss and better > right:
            points[kind] = 100.0 * (better - right)
            vocabulary, loss, right = tried, less, better
    return Proposal(vocabulary, points)


def trial(
    data: Data, train: Index, test: Index, recipe: NetworkRecipe, seed: int, device: torch.device
) -> Judge:
    """Return a judge: a short training on some windows, judged on others, by places in `ends`."""
    nothing, examples = np.empty(0, dtype=np.int64), data.examples
    parts = Parts(_spread(train, LEARNED), nothing, nothing)
    brief = replace(
        recipe,
        epochs=0,
        steps=STEPS,
        batch=BATCH,
        limits=(1, STEPS),
        keep_best=False,
        patience=0.0,
    )
    ends = examples.ends[_spread(test, JUDGED)]

    def judge(vocabulary: Vocabulary) -> tuple[float, float]:
        torch.manual_seed(seed)
        symmetry = Symmetry.of(vocabulary, *examples.images.shape[1:])
        task = GestureTask(examples, parts, len(vocabulary.labels), symmetry, brief, device)
        fit(task, seed)
        logits, label = task.answers(ends)
        right = float((logits.argmax(dim=1) == label).float().mean())
        return float(functional.cross_entropy(logits, label)), right

    return judge


def _spread(index: Index, most: int) -> Index:
    """Return at most so many entries of an index, evenly spread."""
    return index[:: max(1, -(-len(index) // most))]
