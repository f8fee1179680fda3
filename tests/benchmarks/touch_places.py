"""Position errors of unseen people's touches on a screen: CNN-2D, centroid, ridge, an MLP.

    python -m tests.benchmarks.touch_places [--people N] [--touches N] [--epochs N] [--json]

A simulated screen of 40×64 taxels, 2 mm apart. The model of a touch: a finger lies at a pitch (30
to 65 degrees) and a yaw. Flat, it leaves a long print whose tail lies towards the hand, and what
people aim at lies ahead of the print's middle, the further the flatter the finger is; that the
offset depends on these angles and on the person is from Holz and Baudisch (2010), the numbers are
ours. Width, usual pitch, yaw, strength and their spread are a person's own. Noise is 2 % of a firm
touch. People are split in three folds; errors are Euclidean, in mm, with 95 % intervals over
people.

`ours` is CNN-2D as `models train` trains it: on a crop around the touch, scaled to one strength.
`whole` is the same network on the whole screen, unscaled; `_crop` are the peers on our crop.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from sklearn.linear_model import Ridge
from sklearn.neural_network import MLPRegressor

from controller.recognition.touch_input import TouchInput
from models.data.augment import Symmetry
from models.data.recipe import DEFAULT, NetworkRecipe
from models.data.splits import Parts
from models.data.touch_images import Touches
from models.training.location_task import LocationTask
from models.training.loop import fit, prepare_torch

from .results import Results, command_line, row, say

ROWS, COLUMNS, PITCH_MM = 40, 64, 2.0
FOLDS: Final = 3
NOISE: Final = 0.002  # of z; a firm touch has 0.1
CHOSEN: Final = 0.15  # share of a fold's training people held out, whose error stops the training
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Screen:
    """Touches of several people: images (n, rows, columns), places (n, 2), person (n,)."""

    images: NDArray[np.float32]
    place: NDArray[np.float32]
    person: NDArray[np.int64]


def screen(people: int, touches: int, seed: int) -> Screen:
    """Simulate so many people with so many touches each."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[ROWS - 1 : -1 : -1, 0:COLUMNS].astype(np.float64)  # row 0 is the far side
    images, places = [], []
    for _ in range(people):
        usual, yaw0 = rng.uniform(np.radians(30), np.radians(65)), rng.normal(0.0, 0.35)
        width, strength = rng.uniform(3.0, 5.0) / PITCH_MM, rng.uniform(0.05, 0.12)
        for _ in range(touches):
            pitch = np.clip(rng.normal(usual, 0.12), 0.35, 1.3)
            yaw, firm = yaw0 + rng.normal(0.0, 0.15), strength * np.exp(rng.normal(0.0, 0.3))
            at = rng.uniform((4.0, 4.0), (COLUMNS - 5.0, ROWS - 5.0))
            along = (x - at[0]) * np.sin(yaw) + (y - at[1]) * np.cos(yaw)
            across = (x - at[0]) * np.cos(yaw) - (y - at[1]) * np.sin(yaw)
            ahead = 2.5 / PITCH_MM * np.cos(pitch)  # from the print's middle to what is aimed at
            length = width * (0.7 + 0.6 / np.tan(pitch))
            tail = np.where(along + ahead < 0.0, length * 1.5, length)
            felt = np.exp(-0.5 * (((along + ahead) / tail) ** 2 + (across / width) ** 2))
            noise = NOISE * rng.normal(size=felt.shape)
            images.append((1.0 - firm * felt + noise).astype(np.float32))
            places.append(at)
    return Screen(
        np.stack(images),
        np.array(places, dtype=np.float32),
        np.repeat(np.arange(people), touches),
    )


def centroid(images: NDArray[np.float32]) -> Floats:
    """Return the centroid of what is above the noise, (n, 2)."""
    weight = np.clip(1.0 - images - 4 * NOISE, 0.0, None).astype(np.float64)
    y, x = np.mgrid[ROWS - 1 : -1 : -1, 0:COLUMNS]
    total = weight.sum(axis=(1, 2)) + 1e-9
    return np.stack([(weight * x).sum((1, 2)) / total, (weight * y).sum((1, 2)) / total], axis=1)


def judged(data: Screen, fold: int, epochs: int, seed: int) -> dict[str, Floats]:
    """Return each method's errors, mm, on the touches of a fold's people, (n,)."""
    test = data.person % FOLDS == fold
    known = np.unique(data.person[~test])
    held = np.random.default_rng(seed).permutation(known)[: max(1, round(CHOSEN * len(known)))]
    check = np.isin(data.person, held)
    learn = ~test & ~check
    course = replace(DEFAULT.location, epochs=epochs)
    whole = replace(course, touch=TouchInput())
    found = {
        "centroid": centroid(data.images[test]) - _bias(data, learn | check),
        **_peers(data, learn, check, whole.touch, seed),
        **{
            f"{name}_crop": at
            for name, at in _peers(data, learn, check, course.touch, seed).items()
        },
        "ours": _cnn(data, learn, check, course, seed)[test],
        "whole": _cnn(data, learn, check, whole, seed)[test],
    }
    return {
        name: PITCH_MM * np.linalg.norm(at - data.place[test], axis=1) for name, at in found.items()
    }


def _peers(
    data: Screen, learn: NDArray[np.bool_], check: NDArray[np.bool_], touch: TouchInput, seed: int
) -> dict[str, Floats]:
    """Return places by ridge regression and an MLP, from an input, of all other people, (n, 2)."""
    inputs, corners = touch.of(data.images)
    flat, place = (1.0 - inputs).reshape(len(inputs), -1) * 10.0, data.place - corners
    scale, test = 1.0 / np.array(inputs.shape[:0:-1]), ~(learn | check)
    ridge = min(
        (Ridge(a).fit(flat[learn], place[learn]) for a in (1.0, 10.0, 100.0, 1000.0)),
        key=lambda one: float(np.square(one.predict(flat[check]) - place[check]).mean()),
    )
    mlp = MLPRegressor(
        hidden_layer_sizes=(64, 32), early_stopping=True, max_iter=200, random_state=seed
    )
    mlp.fit(flat[~test], place[~test] * scale)
    return {
        "ridge": ridge.predict(flat[test]) + corners[test],
        "mlp": mlp.predict(flat[test]) / scale + corners[test],
    }


def _bias(data: Screen, learn: NDArray[np.bool_]) -> Floats:
    """Return the centroid's mean offset on people who are known, (2,)."""
    return np.asarray((centroid(data.images[learn]) - data.place[learn]).mean(axis=0))


def _cnn(
    data: Screen, learn: NDArray[np.bool_], check: NDArray[np.bool_],
    recipe: NetworkRecipe, seed: int,
) -> Floats:  # fmt: skip
    number = np.arange(len(data.images))
    last = np.ones(len(number), dtype=np.bool_)
    touches = Touches(data.images, data.place, number, number, last, np.full(len(number), np.nan))
    parts = Parts(np.flatnonzero(learn), np.flatnonzero(check), np.flatnonzero(check))
    task = LocationTask(
        touches, parts, Symmetry(((0,), (0,)), (-1, -1)).common([1]),
        recipe, prepare_torch(seed),
    )  # fmt: skip
    fit(task, seed)
    errors = [task.errors(some) for some in np.array_split(number, 40)]
    return np.concatenate(errors).astype(np.float64) + data.place


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("--people", type=int, default=18, help="of the data set (default: 18)")
    parser.add_argument("--touches", type=int, default=100, help="of each (default: 100)")
    parser.add_argument("--epochs", type=int, default=40, help="of CNN-2D (default: 40)")
    options, results = parser.parse_args(), Results("touch_places")
    data = screen(options.people, options.touches, seed=2026)
    errors: dict[str, list[float]] = {}
    for fold in range(FOLDS):
        found = judged(data, fold, options.epochs, seed=fold)
        people = data.person[data.person % FOLDS == fold]
        for name, error in found.items():
            means = [float(error[people == person].mean()) for person in np.unique(people)]
            errors.setdefault(name, []).extend(means)
        say(f"fold {fold + 1}: " + ", ".join(f"{n} {e.mean():.2f} mm" for n, e in found.items()))
    rng = np.random.default_rng(0)
    for name, each in errors.items():
        draws = rng.choice(each, (2000, len(each))).mean(axis=1)
        low, high = np.quantile(draws, (0.025, 0.975))
        results.keep(
            row(f"{name}_error", float(np.mean(each)), "mm", low=float(low), high=float(high))
        )
    results.finish(options.json)


if __name__ == "__main__":
    main()
