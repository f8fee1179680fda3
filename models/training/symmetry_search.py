"""Search for the symmetries of gestures that no vocabulary declares, by cross-validation.

Short trainings try one kind of symmetry after the other, for all gestures alike, and each person is
held out of one of them. A kind is kept if it lowers the loss, and classifies more windows, of all
people together, by more than chance.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

import torch
from torch.nn import functional

from controller.bundles.vocabulary import SELF, Vocabulary
from controller.shared.aliases import Index
from models.data.load import Data
from models.data.recipe import NetworkRecipe
from models.data.splits import Parts, choice_folds
from models.training.gesture_task import gesture_task
from models.training.loop import fit, spread

STEPS: Final = 120  # batches of each trial
BATCH: Final = 128  # windows
# Windows that a trial learns from, evenly spread. Of so few each comes by often, as all do in a
# full training; of many, none would be learned by heart in a short one, and no symmetry needed.
LEARNED: Final = 2_000
JUDGED: Final = 3_000  # windows that it is judged on, evenly spread
LESS: Final = 0.99  # highest loss of a kind that is kept, relative to the loss without it
# Least gain, share of windows. Less is chance: turns that gained .1 points in a trial cost three in
# the full training (docs/measurements.md, people on another sensor).
MORE: Final = 0.005
# entries of gestures.toml, in the order in which they are tried
KINDS: Final[Mapping[str, dict[str, Any]]] = {
    "shifts = true": {"shifts": True},
    'mirror = "self"': {"mirror": SELF},
    'rotations = "half"': {"rotations": "half"},
}

Judge = Callable[[Vocabulary], tuple[float, float]]  # loss, and share of right answers


def declared(
    data: Data, train: Index, recipe: NetworkRecipe, seed: int, device: torch.device
) -> tuple[Data, str]:
    """Return data with the symmetries that help, and the search's result.

    It learns from and judges training examples only, (n,), by positions in `ends`. Where symmetries
    are known, or there are too few people and sessions, the data are unchanged, the result is "".
    """
    # Nothing is known without a vocabulary, except of the orb's gestures.
    known = data.vocabulary.text or data.settings.normalise != "difference"
    folds = [] if known else choice_folds(data, train)
    if not folds:
        return data, ""
    vocabulary, words = search(_trial(data, folds, recipe, seed, device), data.vocabulary)
    return replace(data, vocabulary=vocabulary), words


def search(judge: Judge, vocabulary: Vocabulary) -> tuple[Vocabulary, str]:
    """Return the gestures with the symmetries by which a judge finds more windows right.

    These are added one by one; the text has them as lines of gestures.toml, with their gains.
    """
    (loss, right), kept = judge(vocabulary), list[str]()
    for kind, fields in KINDS.items():
        entries = tuple(replace(entry, **fields) for entry in vocabulary.entries)
        tried = replace(vocabulary, entries=entries)
        less, better = judge(tried)
        if less < LESS * loss and better >= right + MORE:
            kept.append(f"{kind} ({100.0 * (better - right):+.1f} points)")
            vocabulary, loss, right = tried, less, better
    return vocabulary, ", ".join(kept) or "no symmetry helps"


def _trial(
    data: Data,
    folds: list[tuple[Index, Index]],
    recipe: NetworkRecipe,
    seed: int,
    device: torch.device,
) -> Judge:
    """Return a judge: a short training in each fold, judged on what all of them hold out."""
    brief = replace(recipe, epochs=0, steps=STEPS, batch=BATCH, limits=(1, STEPS))

    def judge(vocabulary: Vocabulary) -> tuple[float, float]:
        answers = []
        for learned, held in folds:
            parts = Parts(spread(learned, LEARNED), held[:0], held[:0])
            tried = replace(data, vocabulary=vocabulary)
            task = gesture_task(tried, parts, brief, seed, device)
            fit(task, seed)
            answers.append(task.answers(data.examples.ends[spread(held, JUDGED)]))
        logits, label = map(torch.cat, zip(*answers, strict=True))
        right = float((logits.argmax(dim=1) == label).float().mean())
        return float(functional.cross_entropy(logits, label)), right

    return judge
