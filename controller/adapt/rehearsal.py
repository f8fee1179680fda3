"""Rehearsal data of a bundle against forgetting of its gestures: the part `rehearsal.npz`.

It holds some minutes of play from the recordings of the training, quantised to bytes, and all
later examples. Without the part, the golden windows are rehearsed.

    images         uint8 (frames, rows, columns), z = 1 + (byte - 128) / 200
    label          int8 (frames,), index of the class, -1 unclear
    first          bool (frames,), first frame of a segment
    taught         uint8 (frames, rows, columns), examples, one after the other
    taught_frames  int32 (examples,), number of frames of each
    taught_span    float32 (examples, 2), first and last frame of its touch
    taught_words   str (examples, 3): label, user, rotations
    taught_mirror  bool (examples,)
    base           int32 (networks, 2), units and classes when it was trained; see `networks`
    networks       str (networks,), parts of the bundle
"""

import itertools
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller import npz
from controller.adapt.examples import TURNS, Example, paced, vary_images
from controller.bundles.bundle import REHEARSAL, Bundle

PART: Final = REHEARSAL
STEPS_PER_Z: Final = 200.0
UNTOUCHED: Final = 128
MAX_BYTES: Final = 8 << 20
UNCLEAR: Final = -1

ImageBytes = NDArray[np.uint8]  # (frames, rows, columns)


class RehearsalError(ValueError):
    """The part cannot be used; the message has no subject."""


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """Rehearsal data."""

    images: ImageBytes  # (frames, rows, columns), as bytes
    label: NDArray[np.int8]  # class of each frame, -1 unclear, (frames,)
    first: NDArray[np.bool_]  # whether a segment begins, (frames,)
    taught: tuple[Example, ...] = ()  # examples since the training
    # units and classes of each extended network when it was trained, by part
    base: dict[str, tuple[int, int]] = field(default_factory=dict)

    def windows(
        self, window: int, copies: int, rng: np.random.Generator
    ) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """Return all windows whose class is known, and variations of them.

        The first of the `copies` is unchanged. Windows are (n, window, rows, columns); the second
        array is the number of each one's gesture, from 0, or -1 without one, (n,).
        """
        segments = [*np.flatnonzero(self.first).tolist(), len(self.first)]
        images, label = from_bytes(self.images), self.label
        windows: list[NDArray[np.float32]] = []
        touches: list[NDArray[np.int64]] = []
        count = 0
        for copy in range(copies):
            for first, end in itertools.pairwise(segments):
                seen, named = images[first:end], label[first:end]
                if copy and end - first > window:
                    seen, named = varied(seen, named, rng)
                last = np.arange(window - 1, len(seen))
                last = last[named[last] != UNCLEAR]
                kind = named[last].astype(np.int64)
                touched = kind > 0
                begins = touched & (np.diff(kind, prepend=0) != 0)
                windows.append(seen[last[:, None] + np.arange(1 - window, 1)])
                touches.append(np.where(touched, count + np.cumsum(begins) - 1, -1))
                count += int(begins.sum())
        return np.concatenate(windows), np.concatenate(touches)

    def pack(self) -> bytes:
        """Return the part."""
        examples = self.taught
        none = np.empty((0, *self.images.shape[1:]), dtype=np.uint8)
        arrays: dict[str, NDArray[Any]] = {
            "images": self.images,
            "label": self.label,
            "first": self.first,
            "taught": np.concatenate([none, *(to_bytes(one.images) for one in examples)]),
            "taught_frames": np.array([len(one.images) for one in examples], dtype=np.int32),
            "taught_span": np.array(
                [one.span or (0.0, 0.0) for one in examples], dtype=np.float32
            ).reshape(-1, 2),
            "taught_words": np.array(
                [(one.label, one.user, one.rotations) for one in examples], dtype="U40"
            ).reshape(-1, 3),
            "taught_mirror": np.array([one.mirrored for one in examples], dtype=np.bool_),
            "base": np.array(list(self.base.values()), dtype=np.int32).reshape(-1, 2),
            "networks": np.array(list(self.base), dtype="U60"),
        }
        return npz.pack(arrays)


def read(data: bytes, grid: tuple[int, int], classes: int) -> Rehearsal:
    """Return the data in a part, for `grid` = (rows, columns); RehearsalError if unfit."""
    try:
        a = npz.unpack(data, MAX_BYTES)
    except npz.NpzError as error:
        raise RehearsalError(f"has a rehearsal whose file {error}") from None
    if not _fits(a, grid, classes):
        raise RehearsalError("has a rehearsal of another sensor or version; install a newer bundle")
    words = [[str(word) for word in row] for row in a["taught_words"]]
    cuts = np.split(a["taught"], np.cumsum(a["taught_frames"]))[:-1]
    kept = tuple(
        Example(label, from_bytes(cut), user, rotations, bool(mirrored), (float(b), float(e)))
        for cut, (label, user, rotations), mirrored, (b, e) in zip(
            cuts, words, a["taught_mirror"], a["taught_span"], strict=True
        )
    )
    base = {
        str(name): (int(hidden), int(known))
        for name, (hidden, known) in zip(a["networks"], a["base"], strict=True)
    }
    return Rehearsal(a["images"], a["label"], a["first"], kept, base)


def _fits(a: npz.Arrays, grid: tuple[int, int], classes: int) -> bool:
    """Return whether arrays have the types, shapes and value ranges of rehearsal data."""
    try:
        frames, taught, examples = len(a["images"]), len(a["taught"]), len(a["taught_frames"])
        forms = {
            "images": ("u1", (frames, *grid)), "label": ("i1", (frames,)),
            "first": ("b1", (frames,)), "taught": ("u1", (taught, *grid)),
            "taught_frames": ("i4", (examples,)), "taught_span": ("f4", (examples, 2)),
            "taught_mirror": ("b1", (examples,)), "base": ("i4", (len(a["networks"]), 2)),
        }  # fmt: skip
        return (
            all(a[k].dtype == kind and a[k].shape == shape for k, (kind, shape) in forms.items())
            and a["taught_words"].shape == (examples, 3)
            and bool(((a["label"] >= UNCLEAR) & (a["label"] < classes)).all())
            and int(a["taught_frames"].sum()) == taught
            and bool((a["taught_frames"] > 0).all())
            and bool(np.isfinite(a["taught_span"]).all())
            and all(str(rotations) in TURNS for rotations in a["taught_words"][:, 2])
        )
    except (KeyError, TypeError):
        return False


def varied(
    images: NDArray[np.float32], label: NDArray[np.int8], rng: np.random.Generator
) -> tuple[NDArray[np.float32], NDArray[np.int8]]:
    """Return a variation of a segment: images, (n, rows, columns), and labels, (n,).

    The label between two frames of different classes is unclear.
    """
    seen, at = paced(images, rng)
    low = np.minimum(at.astype(np.intp), len(label) - 2)
    same = label[low] == label[low + 1]
    return vary_images(seen, rng), np.where(same, label[low], UNCLEAR).astype(np.int8)


def of_golden(bundle: Bundle) -> Rehearsal:
    """Return the golden windows of a bundle, each with the class that its network outputs."""
    windows, count = bundle.golden.windows, bundle.window
    label = np.full((len(windows), count), UNCLEAR, dtype=np.int8)
    label[:, -1] = bundle.golden.probabilities.argmax(axis=1)
    first = np.zeros((len(windows), count), dtype=np.bool_)
    first[:, 0] = True
    images = to_bytes(windows.reshape(-1, bundle.rows, bundle.columns))
    return Rehearsal(images, label.ravel(), first.ravel())


def to_bytes(images: NDArray[np.floating]) -> ImageBytes:
    """Return z, (n, rows, columns), as bytes like in telemetry: steps of 0.005, 0.36 to 1.635."""
    steps = np.rint((images.astype(np.float64) - 1.0) * STEPS_PER_Z) + UNTOUCHED
    return np.asarray(np.clip(steps, 0, 255), dtype=np.uint8)


def from_bytes(images: ImageBytes) -> NDArray[np.float32]:
    """Return the z of bytes, (n, rows, columns)."""
    return np.asarray(1.0 + (images.astype(np.float32) - UNTOUCHED) / STEPS_PER_Z, np.float32)
