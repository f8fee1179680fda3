"""From nothing to a proven bundle: simulate, train, compare, tune, write."""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from controller import bundle
from controller.debounce import DebounceSettings
from controller.preprocess import PreprocessSettings
from controller.simulator.orb import NOMINAL
from controller.simulator.presets import PRESETS
from controller.simulator.session import LABELS, Session, simulate
from models import evaluate, export
from models.augment import Augmentation
from models.dataset import Examples, Source, prepare
from models.evaluate import is_pointer
from models.train import Progress, Recipe, train_gesture, train_location

CHECK_SEEDS: Final = 10_000  # development sessions: early stop and thresholds
CHECK_SESSIONS: Final = 16

# The player's thirds: the lower third of the dome is down, the rest left and right.
MAPPING: Final[dict[str, Any]] = {
    "press": [
        {"command": "down", "below": 4.0 / 3.0},
        {"command": "left", "left_of": 2.0},
        {"command": "right"},
    ],
    "pinch": "drop",
    "twist_cw": "rotate_cw",
    "twist_ccw": "rotate_ccw",
}


def train_bundle(
    out: Path, sessions: int, minutes: float, epochs: int, seed: int, say: Progress
) -> None:
    """Make the bundle `out` from simulated sessions.

    Args:
        out: Where it goes; replaced when everything has succeeded.
        sessions: How many to train on, of every preset; a quarter of them a mouse's.
        minutes: Length of each.
        epochs: Of CNN-3D.
        seed: Of initial weights, order, augmentation and sessions.
        say: Takes lines of progress.
    """
    if not out.resolve().parent.is_dir():
        raise ValueError(f"{out.parent} is no directory; make it first, or choose another --out")
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    settings = PreprocessSettings()
    first = seed * 1_000_000
    say(f"simulating {sessions} + {CHECK_SESSIONS} sessions of {minutes:g} minutes")
    train = _examples(range(first, first + sessions), minutes, settings, say)
    held = [_simulate(first + CHECK_SEEDS + i, minutes) for i in range(CHECK_SESSIONS)]
    check = prepare((_source(session) for session in held), settings)
    rows, columns = train.images.shape[1:]
    recipe = _recipe(epochs, seed, rows, columns)
    say(f"training on {len(train.ends)} windows, {len(check.ends)} of unseen sessions beside them")
    gesture = train_gesture(train, check, LABELS, recipe, say)
    location = train_location(train, check, recipe, say)
    rng = np.random.default_rng(seed)
    windows = check.windows(rng.choice(check.ends, 2000, replace=False))
    presses = np.flatnonzero(np.isfinite(check.touch[:, 0]))
    images = check.images[rng.choice(presses, min(2000, len(presses)), replace=False)]
    made = {
        "software": _version(),
        "command": f"models train --sessions {sessions} --minutes {minutes:g} "
        f"--epochs {epochs} --seed {seed}",
        "data": f"{sessions} simulated sessions ({', '.join(PRESETS)}), {len(train.ends)} windows, "
        "split by session",
    }

    def write(path: Path, debounce: DebounceSettings) -> float:
        content = export.manifest(
            LABELS, (rows, columns), NOMINAL.pitch_mm, settings, debounce, MAPPING, made
        )
        return export.write_bundle(
            path, gesture, location, manifest=content, windows=windows, images=images
        )

    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / "draft.orb"
        worst = write(draft, DebounceSettings())
        say(f"PyTorch and ONNX Runtime agree within {worst:.1e}")
        streams = evaluate.run(bundle.read(draft), held, lambda _: None)
    debounce, score = evaluate.tune(streams)
    say(
        f"debouncer {debounce.smoothing:g} {debounce.on:g} {debounce.off:g}: "
        f"F1 {score.f1:.4f} on development sessions"
    )
    write(out, debounce)
    say(f"wrote {out}; judge it on unseen sessions with: models evaluate {out}")


def _recipe(epochs: int, seed: int, rows: int, columns: int) -> Recipe:
    """Return how to train; images of presses are few and small, so they may come by often."""
    plain = Recipe()
    symmetric = Augmentation.declared(LABELS, rows, columns)
    return Recipe(
        epochs=(epochs, 6 * epochs),
        seed=seed,
        augmentation=symmetric,
        location=replace(plain.location, rotations=symmetric.rotations, mirrors=symmetric.mirrors),
    )


def _examples(
    seeds: range, minutes: float, settings: PreprocessSettings, say: Progress
) -> Examples:
    def sources() -> Iterator[Source]:
        for number, seed in enumerate(seeds, 1):
            yield _source(_simulate(seed, minutes))
            if number % 10 == 0:
                say(f"simulated {number}/{len(seeds)}")

    return prepare(sources(), settings)


def _simulate(seed: int, minutes: float) -> Session:
    """Simulate a session: of four in a row three are a hand's; then the next preset's turn."""
    models = list(PRESETS.values())
    model = models[seed // 4 % len(models)]
    return simulate(seed, minutes, pointer=is_pointer(seed), model=model)


def _source(session: Session) -> Source:
    return Source(session.frames, session.label, session.touch)


def _version() -> str:
    try:
        return version("orbtouch")
    except PackageNotFoundError:
        return "a checkout"
