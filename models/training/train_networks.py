"""Train the two networks on what was split, and say what each is worth."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from models.data import training_split
from models.data.augment import Symmetry
from models.data.load import Data
from models.data.recipe import Recipe
from models.data.touch_images import Touches
from models.data.training_split import Split
from models.evaluation import position_error, scores
from models.results.training import Epoch, GestureResult, LocationResult
from models.training import progress
from models.training.loop import Fitted, fit
from models.training.networks import GestureNet, LocationNet
from models.training.tasks import Gestures, Places

ON_SITE: Final = 0.25  # grid units from a taxel, the finger's aim being no better


@dataclass(frozen=True, slots=True)
class Work:
    """What both trainings have in common.

    Attributes:
        data: What there is to learn from.
        split: What of it is held out.
        recipe: How.
        seed: Of everything random.
        device: What computes.
        folder: Where checkpoints are kept; None: nowhere.
        answers: Classes that the gesture network answers in the end, the first ones; 0: all. The
            others are auxiliary: learned beside them, so that the embedding keeps more.
    """

    data: Data
    split: Split
    recipe: Recipe
    seed: int
    device: torch.device
    folder: Path | None
    answers: int = 0


def gestures(work: Work) -> tuple[GestureResult, GestureNet]:
    """Train CNN-3D; its probabilities are calibrated if the recipe says so."""
    data, labels = work.data, work.data.vocabulary.labels
    examples, classes = data.examples, work.answers or len(labels)
    symmetry = Symmetry.of(data.vocabulary, *examples.images.shape[1:])
    torch.manual_seed(work.seed)
    course = work.recipe.gesture
    lesson = Gestures(
        examples, work.split.windows, len(labels), symmetry, course, work.device, classes
    )
    fitted = _fit(work, "CNN-3D", lesson, _words_gesture)
    # From here on there are no auxiliary classes, nor their windows.
    ends = {part: every[examples.label[every] < classes] for part, every in lesson.ends.items()}
    logits, label = (one.cpu().numpy() for one in lesson.answers(ends["check"]))
    logits = logits[:, :classes]
    random = lesson.answers(ends["random"])[0][:, :classes]
    hot = scores.temperature(logits, label) if work.recipe.scaled else 1.0
    assert isinstance(lesson.net, GestureNet)
    net = lesson.net.cpu().folded().narrowed(classes)
    with torch.no_grad():
        net.out.weight.div_(hot)
        net.out.bias.div_(hot)
    named = logits.argmax(axis=1)
    events = scores.events(examples, ends["check"], scores.softmax(logits, hot))
    right = events.named == events.label
    result = GestureResult(
        fitted.epochs,
        fitted.best,
        fitted.stopped,
        scores.honest_share(
            examples,
            (ends["check"], named),
            (ends["random"], random.argmax(dim=1).cpu().numpy()),
            classes,
        ),
        float(right.mean()) if len(right) else float("nan"),
        _table(scores.confusion(named, label, classes)),
        _table(scores.confusion(events.named, events.label, classes)),
        scores.calibration(logits, label, hot),
        _weights(net),
    )
    return result, net.eval()


def places(work: Work, found: Touches) -> tuple[LocationResult, LocationNet]:
    """Train CNN-2D on images of touches."""
    data = work.data
    shape = data.examples.images.shape[1:]
    # Only located gestures have a place; turned and mirrored as the strictest of them allows.
    located = [data.vocabulary.labels.index(name) for name in data.vocabulary.located]
    whole = Symmetry.of(data.vocabulary, *shape)
    symmetry = Symmetry(
        (tuple(k for k in range(4) if all(k in whole.turns[i] for i in located)),),
        (0 if all(whole.mirror[i] == i for i in located) else -1,),
    )
    torch.manual_seed(work.seed)
    parts = training_split.touches(work.split, data, found, work.seed)
    if parts.words:
        print(parts.words, file=sys.stderr)
    lesson = Places(found, parts, symmetry, work.recipe.location, work.device)
    fitted = _fit(work, "CNN-2D", lesson, _words_place)
    assert isinstance(lesson.net, LocationNet)
    check, off = lesson.parts["check"], lesson.errors("check")
    session = data.examples.session[found.frame[check]]
    last = found.last[check]
    place, error = found.place[check][last], off[last]
    away = np.abs(place - np.rint(place)).max(axis=1, initial=0.0) > ON_SITE
    each = np.abs(error).mean(axis=1)
    scored = scores.honest_error(session, off, lesson.errors("random"))
    net = lesson.net.cpu().folded()
    result = LocationResult(
        fitted.epochs,
        fitted.best,
        fitted.stopped,
        scored,
        tuple(
            (float(p[0]), float(p[1]), float(e[0]), float(e[1]))
            for p, e in zip(place, error, strict=True)
        ),
        _mean(each[~away]),
        _mean(each[away]),
        _weights(net),
        parts.words,
        position_error.measure(found.blur[check], off.astype(np.float64)),
    )
    return result, net.eval()


def epochs(recipe: Recipe, gesture: int, location: int) -> Recipe:
    """Return a recipe of so many epochs; 0: as many as it says."""
    return replace(
        recipe,
        gesture=replace(recipe.gesture, epochs=gesture or recipe.gesture.epochs),
        location=replace(recipe.location, epochs=location or recipe.location.epochs),
    )


def _fit(work: Work, name: str, lesson: Gestures | Places, words: progress.Words) -> Fitted:
    """Train a network where it was interrupted, and show how it goes."""
    passes = lesson.course.passes(lesson.steps() * lesson.course.batch)
    show = progress.watch(name, passes, words, sys.stderr)
    keep = None if work.folder is None else work.folder / f"{name.lower()}.npz"
    fitted = fit(lesson, lesson.course, work.seed, keep, show)
    if fitted.stopped:
        end = "\n" if sys.stderr.isatty() else ""
        print(f"{end}{name}: {fitted.stopped}; epoch {fitted.best} is kept", file=sys.stderr)
    return fitted


def _words_gesture(epoch: Epoch) -> str:
    return (
        f"loss {epoch.loss:.3f}, unseen {epoch.check_loss:.3f}, "
        f"right {epoch.check:.1%} (windows at random {epoch.random:.1%})"
    )


def _words_place(epoch: Epoch) -> str:
    return (
        f"error {epoch.train:.3f}, unseen {epoch.check:.3f} grid units "
        f"(images at random {epoch.random:.3f})"
    )


def _table(matrix: NDArray[np.int64]) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(int(count) for count in row) for row in matrix)


def _weights(net: nn.Module) -> int:
    return sum(parameter.numel() for parameter in net.parameters())


def _mean(values: NDArray[np.floating]) -> float:
    return float(values.mean()) if len(values) else float("nan")
