"""Cross-validation of touch positions: each touch is located by models that never saw its person.

CNN-2D is trained by the default recipe, with fewer steps; part of the fold's own people stop it
early. Centroid, ridge regression and a dense network see the same images. Errors are distances.
"""

import time
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from controller.recordings.recording import software
from controller.shared.aliases import Index, Say
from controller.shared.errors import count
from models.data import load, splits, touch_images
from models.data.augment import PLAIN, Symmetry
from models.data.load import Data
from models.data.recipe import DEFAULT, NetworkRecipe
from models.data.splits import Parts
from models.data.touch_images import Touches
from models.evaluation import bootstrap
from models.formatting import duration
from models.reports import markdown
from models.reports.tables import Table
from models.results import storage
from models.results.evaluation import Figure
from models.studies.cross_validation import MOST_EPOCHS, PATIENCE, Request
from models.training.location_task import LocationTask
from models.training.loop import fit, prepare_torch
from models.training.request import PLACE_EPOCHS

NONE: Final = np.empty(0, dtype=np.int64)
FAINT: Final = 0.15  # share of an image's peak below which a taxel counts as untouched
PENALTY: Final = 1e-3  # of ridge regression, times the features' mean square
DENSE: Final = (64, 32)  # widths of the dense network
OURS: Final = "CNN-2D"

Places = NDArray[np.floating]  # (images, 2), grid units
Rows = NDArray[np.floating]  # (images, features)


@dataclass(frozen=True, slots=True)
class Model:
    """Errors of one model: distances from the true place, millimetres."""

    name: str  # name of the model
    mean: Figure  # over images, with its interval over people
    median: float  # over images
    ninety: float  # distance below which nine tenths of the images are
    by_person: tuple[float, ...]  # mean for each person


@dataclass(frozen=True, slots=True)
class LocationValidation:
    """All results, as the JSON file has them."""

    command: str  # command line
    software: str  # version of this program
    data: str  # the data set, a sentence
    how: tuple[str, ...]  # the recipe, sentences
    pitch_mm: float  # distance between adjacent taxels
    people: tuple[str, ...]  # their names
    models: tuple[Model, ...]  # errors; ours first
    cpu_minutes: float  # CPU time of everything, minutes


def cross(request: Request, say: Say) -> LocationValidation:
    """Train and judge every fold, and write the results; or raise ValueError, one sentence."""
    begun, clock = time.process_time(), time.monotonic()
    storage.target(request.out)
    device = prepare_torch(request.seed)
    recipe = replace(DEFAULT, repair=DEFAULT.repair and not request.given)
    data = load.read(
        request.paths, recipe, request.labels, say, window=request.window, every=request.all
    )
    found = touch_images.find(data.examples, recipe.averaged, request.seed)
    person = data.user[data.examples.session[found.frame]]
    people = np.unique(person)
    if not 2 <= request.folds <= len(people):
        known = count(len(people), "person has", "people have")
        raise ValueError(
            f"{known} touches whose place is known, too few for {request.folds} folds; record "
            "places with: controller teach --places, or ask for fewer folds"
        )
    course = replace(
        recipe.location, epochs=0, steps=PLACE_EPOCHS * request.steps, limits=(1, MOST_EPOCHS),
        patience=PATIENCE,
    )  # fmt: skip
    for note in data.notes:
        say(note)
    say(described := f"{len(found.images)} images of touches of {len(people)} people")
    answers = {name: np.empty_like(found.place) for name in (OURS, *PEERS)}
    for number, held in enumerate(np.array_split(people, request.folds), 1):
        test = np.isin(person, held)
        for name, places in _judge(request, data, found, course, device, person, test).items():
            answers[name][test] = places
        left = duration((time.monotonic() - clock) / number * (request.folds - number))
        errors = [f"{name} {_far(answers[name], found, data)[test].mean():.2f}" for name in answers]
        say(f"fold {number} of {request.folds}: {', '.join(errors)} mm; about {left} left")
    models = tuple(_model(name, _far(own, found, data), person) for name, own in answers.items())
    names = tuple(data.rows[int(one)].user or str(one) for one in people)
    how = tuple(replace(recipe, location=course).sentences(gesture=False, location=True))
    cpu = (time.process_time() - begun) / 60.0
    result = LocationValidation(
        request.command, software(), described, how, data.pitch_mm, names, models, cpu
    )
    storage.write_json(request.out, result)
    return result


def text(found: LocationValidation) -> str:
    """Return the card as Markdown."""
    scores = [
        [one.name, str(one.mean), f"{one.median:.2f}", f"{one.ninety:.2f}"] for one in found.models
    ]
    by_person = [
        [name, *(f"{model.by_person[i]:.2f}" for model in found.models)]
        for i, name in enumerate(found.people)
    ]
    names = [model.name for model in found.models]
    return "\n\n".join([
        f"{found.data}; taxels are {found.pitch_mm:g} mm apart. Distances from the true place, mm; "
        "intervals are 95 %, by resampling people.",
        markdown.table(Table(["", "mean", "median", "nine in ten below"], scores)),
        markdown.table(Table(["person", *names], by_person)),
        f"CPU time of all: {found.cpu_minutes:.1f} minutes.",
    ])  # fmt: skip


def _judge(
    request: Request, data: Data, found: Touches, course: NetworkRecipe, device: torch.device,
    person: Index, test: NDArray[np.bool_],
) -> dict[str, Places]:  # fmt: skip
    """Return each model's places of a fold's test images."""
    own, seed = np.unique(person[~test]), request.seed
    watched = splits.spread(own, max(1, round(splits.SHARE * len(own)))) if len(own) > 1 else NONE
    check = np.isin(person, watched)
    parts = Parts(np.flatnonzero(~test & ~check), np.flatnonzero(check), NONE)
    torch.manual_seed(seed)
    task = LocationTask(found, parts, _symmetry(data), course, device)
    fit(task, seed)
    index = np.flatnonzero(test)
    answers: dict[str, Places] = {OURS: task.errors(index) + found.place[index]}
    for name, (seen, learn) in PEERS.items():
        answers[name] = learn(
            seen(found.images[~test]), found.place[~test], seen(found.images[test])
        )
    return answers


def _symmetry(data: Data) -> Symmetry:
    """Return what is declared of all gestures with places."""
    located = [data.vocabulary.labels.index(name) for name in data.vocabulary.located]
    whole = Symmetry.of(data.vocabulary, *data.examples.images.shape[1:])
    return whole.common(located) if located else PLAIN


def _far(places: Places, found: Touches, data: Data) -> NDArray[np.float64]:
    """Return distances from the true places, millimetres, (images,)."""
    off = (places - found.place).astype(np.float64)
    return np.asarray(data.pitch_mm * np.hypot(off[:, 0], off[:, 1]))


def _model(name: str, far: NDArray[np.float64], person: Index) -> Model:
    """Return the errors of a model from distances and people, both (images,)."""
    by = [far[person == one] for one in np.unique(person)]
    return Model(
        name,
        bootstrap.mean(by),
        float(np.median(far)),
        float(np.quantile(far, 0.9)),
        tuple(float(own.mean()) for own in by),
    )


def _dense(rows: Rows, place: Places, seen: Rows) -> Places:
    """Return places by a dense network on rows (images, features)."""
    from sklearn.neural_network import MLPRegressor

    net: Any = MLPRegressor(
        hidden_layer_sizes=DENSE, max_iter=MOST_EPOCHS, early_stopping=True, random_state=0
    )
    scale = max(float(rows.std()), 1e-9)
    return np.asarray(net.fit(rows / scale, place).predict(seen / scale))


def _linear(rows: Rows, place: Places, seen: Rows) -> Places:
    """Return places by ridge regression on rows (images, features)."""
    middle, aim = rows.mean(axis=0), place.mean(axis=0)
    near = rows - middle
    product = near.T @ near
    product += PENALTY * max(float(np.trace(product)) / len(product), 1e-12) * np.eye(len(product))
    weights = np.linalg.solve(product, near.T @ (place - aim))
    return np.asarray((seen - middle) @ weights + aim)


def _flat(images: NDArray[np.float32]) -> Rows:
    """Return the signal of all taxels, (images, taxels)."""
    return images.reshape(len(images), -1) - 1.0


def _centroid(images: NDArray[np.float32]) -> Rows:
    """Return the centroids of images, grid units, (images, 2)."""
    signal = np.abs(images.astype(np.float64) - 1.0)
    signal[signal < FAINT * signal.max(axis=(1, 2), keepdims=True)] = 0.0
    total = np.maximum(signal.sum(axis=(1, 2)), 1e-9)
    row, column = np.mgrid[: images.shape[1], : images.shape[2]]
    parts = [(signal * way).sum(axis=(1, 2)) / total for way in (column, row)]
    return np.stack(parts, axis=1)


PEERS: Final = {  # what each sees of images, and how it learns places of it
    "ridge": (_flat, _linear), "dense network": (_flat, _dense), "centroid": (_centroid, _linear),
}  # fmt: skip
