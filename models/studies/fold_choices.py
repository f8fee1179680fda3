"""Choices of a fold of a cross-validation, made on its own people: scale and symmetries."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.recognition.images.scale import FIRM
from models.data.augment import Symmetry
from models.data.examples import Examples
from models.data.load import Data
from models.data.recipe import NetworkRecipe
from models.data.splits import Fold
from models.studies import fold_statistics
from models.training import symmetry_search

FIRM_SHARE: Final = 0.75  # quantile of the strength of touched images: a firm touch


@dataclass(frozen=True, slots=True)
class Own:
    """Choices of a fold's own people."""

    data: Data  # of all people, to the fold's scale
    inner: Fold | None  # a fold of its own people; None if it has only one
    words: str = ""  # the symmetries found; "" if they are declared

    @property
    def symmetry(self) -> Symmetry:
        """The symmetries of the gestures."""
        return Symmetry.of(self.data.vocabulary, *self.data.examples.images.shape[1:])


def of(data: Data, fold: Fold, group: NDArray[np.int64]) -> Own:
    """Return data to a fold's scale, and a fold of its own people, by the groups of (frames,)."""
    examples, inner = data.examples, None
    if len(np.unique(group[examples.ends[fold.train]])) > 1:
        inner = fold_statistics.within(fold, examples.ends, examples.window, group)
    if data.settings.normalise == "difference":
        data = replace(data, examples=scaled(examples, examples.ends[fold.train]))
    return Own(data, inner)


def searched(own: Own, course: NetworkRecipe, seed: int, device: torch.device) -> Own:
    """Return the choices with the symmetries that help some of the fold's people, by trial."""
    assert own.inner is not None
    judge = symmetry_search.trial(own.data, own.inner.train, own.inner.test, course, seed, device)
    found = symmetry_search.search(judge, own.data.vocabulary)
    return replace(own, data=replace(own.data, vocabulary=found.vocabulary), words=found.words)


def scaled(examples: Examples, ends: NDArray[np.int64]) -> Examples:
    """Return examples in which a firm touch at some frames (n,) is as strong as on the orb."""
    ends = ends[examples.label[ends] > 0]
    strength = np.abs(examples.images[ends] - 1.0).mean(axis=(1, 2))
    session = examples.session[ends]
    firm = [np.quantile(strength[session == one], FIRM_SHARE) for one in np.unique(session)]
    usual = float(np.median(firm)) if firm else 0.0
    if not usual > 0.0:
        return examples
    signal = np.float32(FIRM / usual) * (examples.images - np.float32(1.0))
    return replace(examples, images=signal + np.float32(1.0))
