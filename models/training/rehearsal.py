"""Rehearsal samples of a bundle: some minutes of its training's recordings, for the device.

Stretches around events are taken from all recordings in turn, every gesture and every touch that
is none as often, so that a few minutes show as many hands as possible.
"""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller import files
from controller.adapt import rehearsal
from controller.adapt.rehearsal import Rehearsal
from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.recognition.preprocess import Preprocessor
from controller.recordings.recording import Recording
from models.data.ground_truth import classes_of

FRAMES: Final = 8000  # images of a bundle: 13 minutes, some 120 kB
IMAGES_HZ: Final = 10.0  # what a fast sensor gives is averaged
PROOF: Final = 80, 6  # images in golden windows, and fewest windows: the rest is rehearsed instead
STRETCH_S: Final = 2.8
LEAD_S: Final = 1.2  # before a touch begins: a window, and what is quiet before it
REST: Final = 1.5  # as many stretches without a gesture as these times those with one


def choose(
    bundle: Bundle, recordings: Iterable[Recording], frames: int = FRAMES, seed: int = 0
) -> Rehearsal:
    """Return about so many frames of labelled recordings to rehearse, some stretches of each."""
    rng = np.random.default_rng(seed)
    pace = max(1, round(bundle.rate_hz / IMAGES_HZ))
    window = -(-bundle.window // pace)
    length = max(window + 2, round(STRETCH_S * bundle.rate_hz / pace))
    lead = max(window, round(LEAD_S * bundle.rate_hz / pace))
    kinds: dict[int, list[tuple[NDArray[np.uint8], NDArray[np.int8], float]]] = {}
    for recording in recordings:
        images, label, known, touched, noise = _averaged(*_responses(bundle, recording), pace)
        for kind in range(len(bundle.labels)):
            ready = known & (label == kind) & (touched if kind == 0 else True)
            begins = np.flatnonzero(ready & ~np.roll(ready, 1))
            inside = begins[(begins >= lead) & (begins < len(label) - length + lead)]
            inside = inside[known[inside - lead]] if len(inside) else inside
            if not len(inside):
                continue
            for begin in rng.choice(inside, min(2, len(inside)), replace=False):
                cut = slice(int(begin) - lead, int(begin) - lead + length)
                kinds.setdefault(kind, []).append(
                    (rehearsal.to_bytes(images[cut]), label[cut].astype(np.int8), noise)
                )
    total = frames // length
    share = {kind: REST if kind == 0 else 1.0 for kind in kinds}
    chosen = []
    for kind, found in sorted(kinds.items()):
        wanted = round(total * share[kind] / sum(share.values()))
        order = rng.permutation(len(found))[:wanted]
        chosen += [found[i] for i in sorted(order)]
    if not chosen:
        raise ValueError("these recordings hold nothing that can be rehearsed; label them first")
    first = np.zeros((len(chosen), length), dtype=np.bool_)
    first[:, 0] = True
    return Rehearsal(
        np.concatenate([images for images, _, _ in chosen]),
        np.concatenate([label for _, label, _ in chosen]),
        first.ravel(),
        pace=pace,
        noise=np.array([noise for *_, noise in chosen if pace > 1], dtype=np.float32),
    )


def _averaged(
    images: NDArray[np.float32],
    label: NDArray[np.int64],
    known: NDArray[np.bool_],
    touched: NDArray[np.bool_],
    pace: int,
) -> tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_], float]:
    """Return the same of each `pace` frames together, and how much untouched frames scatter, z.

    Images are (n, rows, columns), all others (n,). A label that changes among them is -1.
    """
    count = len(images) // pace
    groups = images[: count * pace].reshape(count, pace, *images.shape[1:])
    labels, ready, felt = (
        one[: count * pace].reshape(count, pace) for one in (label, known, touched)
    )
    same = (labels == labels[:, :1]).all(axis=1)
    still = ready.all(axis=1) & ~felt.any(axis=1)
    scatter = float(groups[still].std(axis=1).mean()) if pace > 1 and still.any() else 0.0
    mean = np.asarray(groups.mean(axis=1, dtype=np.float32) if pace > 1 else images)
    label = np.where(same, labels[:, 0], -1)
    return mean, label, np.asarray(ready.all(axis=1)), np.asarray(felt.any(axis=1)), scatter


def write(out: Path, source: Path, chosen: Rehearsal) -> Bundle:
    """Write a bundle with something to rehearse; BundleError or OSError if it cannot be.

    Some golden windows are enough then, since nothing has to be learned from them.
    """
    import tomli_w

    loaded = bundles.read(source)
    parts = bundles.unpack(files.read_bytes(source, bundles.MAX_BYTES))
    content = {**bundles.content(parts), bundles.REHEARSAL: chosen.pack()}
    golden, (images, fewest) = loaded.golden, PROOF
    some = slice(max(fewest, images // loaded.window))
    content[bundles.GOLDEN] = replace(
        golden,
        windows=golden.windows[some],
        probabilities=golden.probabilities[some],
        people=golden.people[some],
        heads={name: outputs[some] for name, outputs in golden.heads.items()},
    ).pack()
    table = bundles.manifest(parts[bundles.MANIFEST])
    bundles.write(out, manifest=tomli_w.dumps(table).encode(), parts=content)
    return bundles.read(out)


def _responses(bundle: Bundle, recording: Recording) -> tuple[
    NDArray[np.float32], NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_]
]:  # fmt: skip
    """Return z images (n, rows, columns), classes, if rest is known, and if it is touched, (n,)."""
    stage = Preprocessor(bundle.preprocess, bundle.rows, bundle.columns)
    steps = [stage.step(frame) for frame in recording.frames]
    label = classes_of(recording, bundle.labels, "a recording")
    return (
        np.array([step.image for step in steps], dtype=np.float32),
        np.where(recording.excluded, -1, label),
        np.array([step.ready for step in steps]),
        np.array([not step.quiet for step in steps]),
    )
