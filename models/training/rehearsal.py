"""Rehearsal samples of a bundle: some minutes of its training's recordings, for the device.

Stretches around events are taken from all recordings in turn, every gesture and every touch that
is none as often, so that a few minutes show as many hands as possible.
"""

from collections.abc import Iterable
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

FRAMES: Final = 8000  # of a bundle: 13 minutes at 10 Hz, some 120 kB
STRETCH_S: Final = 2.8
LEAD_S: Final = 1.2  # before a touch begins: a window, and what is quiet before it
REST: Final = 1.5  # as many stretches without a gesture as these times those with one


def choose(
    bundle: Bundle, recordings: Iterable[Recording], frames: int = FRAMES, seed: int = 0
) -> Rehearsal:
    """Return about so many frames of labelled recordings to rehearse, some stretches of each."""
    rng = np.random.default_rng(seed)
    length = max(bundle.window + 2, round(STRETCH_S * bundle.rate_hz))
    lead = max(bundle.window, round(LEAD_S * bundle.rate_hz))
    kinds: dict[int, list[tuple[NDArray[np.uint8], NDArray[np.int8]]]] = {}
    for recording in recordings:
        images, label, known, touched = _responses(bundle, recording)
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
                    (rehearsal.to_bytes(images[cut]), label[cut].astype(np.int8))
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
        np.concatenate([images for images, _ in chosen]),
        np.concatenate([label for _, label in chosen]),
        first.ravel(),
    )


def write(out: Path, source: Path, chosen: Rehearsal) -> Bundle:
    """Write a bundle with something to rehearse; BundleError or OSError if it cannot be."""
    import tomli_w

    parts = bundles.unpack(files.read_bytes(source, bundles.MAX_BYTES))
    content = {**bundles.content(parts), bundles.REHEARSAL: chosen.pack()}
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
