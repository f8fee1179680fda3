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
    origin         uint8 (bytes,), the manifest before the first lesson; absent without one
    origin_golden  int32 (1,), number of golden windows then
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller import npz
from controller.adapt.examples import TURNS, Example, between, paced, thinned, vary_images
from controller.bundles.bundle import REHEARSAL, Bundle

PART: Final = REHEARSAL
STEPS_PER_Z: Final = 200.0
UNTOUCHED: Final = 128
MAX_BYTES: Final = 8 << 20
UNCLEAR: Final = -1
_MOST_PACE: Final = 1000

ImageBytes = NDArray[np.uint8]  # (frames, rows, columns)


class RehearsalError(ValueError):
    """The part cannot be used; the message has no subject."""


@dataclass(frozen=True, slots=True)
class Origin:
    """A bundle before its first lesson."""

    manifest: bytes  # its bundle.toml
    golden: int  # number of its golden windows, which come first


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """Rehearsal data."""

    images: ImageBytes  # (frames, rows, columns), as bytes: each the mean of `pace` of the sensor's
    label: NDArray[np.int8]  # class of each frame, -1 unclear, (frames,)
    first: NDArray[np.bool_]  # whether a segment begins, (frames,)
    taught: tuple[Example, ...] = ()  # examples since the training
    # units and classes of each extended network when it was trained, by part
    base: dict[str, tuple[int, int]] = field(default_factory=dict)
    pace: int = 1  # frames of the sensor that an image is the mean of
    # standard deviation of these frames about it, z, (segments,); none if `pace` is 1
    noise: NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, dtype=np.float32))
    origin: Origin | None = None  # None: not taught, or by an older version

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
            for number, (first, end) in enumerate(itertools.pairwise(segments)):
                seen, named = images[first:end], label[first:end]
                if self.pace > 1:
                    seen, named = self._frames(seen, named, self.noise[number], rng)
                if copy and len(seen) > window:
                    seen, named = varied(seen, named, rng)
                last = thinned(np.arange(window - 1, len(seen)), window, copy, rng)
                last = last[named[last] != UNCLEAR]
                kind = named[last].astype(np.int64)
                touched = kind > 0
                begins = touched & (np.diff(kind, prepend=0) != 0)
                windows.append(seen[last[:, None] + np.arange(1 - window, 1)])
                touches.append(np.where(touched, count + np.cumsum(begins) - 1, -1))
                count += int(begins.sum())
        return np.concatenate(windows), np.concatenate(touches)

    def _frames(
        self,
        images: NDArray[np.float32],
        label: NDArray[np.int8],
        noise: np.float32,
        rng: np.random.Generator,
    ) -> tuple[NDArray[np.float32], NDArray[np.int8]]:
        """Return frames, (pace × n, rows, columns), as the sensor gave them, and their labels.

        They lie between the images, (n, rows, columns), and are as noisy as its were.
        """
        at = (np.arange(self.pace * len(images)) - (self.pace - 1) / 2) / self.pace
        seen = between(images, np.clip(at, 0.0, len(images) - 1.001))
        seen += noise * rng.standard_normal(seen.shape, dtype=np.float32)
        return seen, np.repeat(label, self.pace)

    def pack(self) -> bytes:
        """Return the part."""
        arrays: dict[str, NDArray[Any]] = {
            "images": self.images,
            "label": self.label,
            "first": self.first,
            **pack_examples(self.taught, self.images.shape[1:]),
            "base": np.array(list(self.base.values()), dtype=np.int32).reshape(-1, 2),
            "networks": np.array(list(self.base), dtype="U60"),
            "pace": np.array([self.pace], dtype=np.int32),
            "noise": self.noise,
        }
        if self.origin is not None:
            arrays["origin"] = np.frombuffer(self.origin.manifest, dtype=np.uint8)
            arrays["origin_golden"] = np.array([self.origin.golden], dtype=np.int32)
        return npz.pack(arrays)


def read(data: bytes, grid: tuple[int, int], classes: int) -> Rehearsal:
    """Return the data in a part, for `grid` = (rows, columns); RehearsalError if unfit."""
    try:
        a = npz.unpack(data, MAX_BYTES)
    except npz.NpzError as error:
        raise RehearsalError(f"has a rehearsal whose file {error}") from None
    if not _fits(a, grid, classes):
        raise RehearsalError("has a rehearsal of another sensor or version; install a newer bundle")
    kept = read_examples(a)
    base = {
        str(name): (int(hidden), int(known))
        for name, (hidden, known) in zip(a["networks"], a["base"], strict=True)
    }
    pace = int(a["pace"][0]) if "pace" in a else 1
    noise = a["noise"] if pace > 1 else np.zeros(0, dtype=np.float32)
    origin = None
    if "origin" in a:
        origin = Origin(a["origin"].tobytes(), int(a["origin_golden"][0]))
    return Rehearsal(a["images"], a["label"], a["first"], kept, base, pace, noise, origin)


def pack_examples(examples: Sequence[Example], grid: tuple[int, ...]) -> npz.Arrays:
    """Return the arrays of examples with their spans, for `grid` = (rows, columns)."""
    none = np.empty((0, *grid), dtype=np.uint8)
    spans = [one.span or (0.0, 0.0) for one in examples]
    words = [(one.label, one.user, one.rotations) for one in examples]
    return {
        "taught": np.concatenate([none, *(to_bytes(one.images) for one in examples)]),
        "taught_frames": np.array([len(one.images) for one in examples], dtype=np.int32),
        "taught_span": np.array(spans, dtype=np.float32).reshape(-1, 2),
        "taught_words": np.array(words, dtype="U40").reshape(-1, 3),
        "taught_mirror": np.array([one.mirrored for one in examples], dtype=np.bool_),
    }


def read_examples(a: npz.Arrays) -> tuple[Example, ...]:
    """Return the examples in arrays of `pack_examples`, which `examples_fit` accepts."""
    words = [[str(word) for word in row] for row in a["taught_words"]]
    cuts = np.split(a["taught"], np.cumsum(a["taught_frames"]))[:-1]
    return tuple(
        Example(label, from_bytes(cut), user, rotations, bool(mirrored), (float(b), float(e)))
        for cut, (label, user, rotations), mirrored, (b, e) in zip(
            cuts, words, a["taught_mirror"], a["taught_span"], strict=True
        )
    )


def examples_fit(a: npz.Arrays, grid: tuple[int, ...]) -> bool:
    """Return whether arrays are those of examples, for `grid` = (rows, columns)."""
    try:
        frames, count = len(a["taught"]), len(a["taught_frames"])
        forms = {
            "taught": ("u1", (frames, *grid)), "taught_frames": ("i4", (count,)),
            "taught_span": ("f4", (count, 2)), "taught_mirror": ("b1", (count,)),
        }  # fmt: skip
        return (
            all(a[k].dtype == kind and a[k].shape == shape for k, (kind, shape) in forms.items())
            and a["taught_words"].shape == (count, 3)
            and int(a["taught_frames"].sum()) == frames
            and bool((a["taught_frames"] > 0).all())
            and bool(np.isfinite(a["taught_span"]).all())
            and all(str(rotations) in TURNS for rotations in a["taught_words"][:, 2])
        )
    except (KeyError, TypeError):
        return False


def _fits(a: npz.Arrays, grid: tuple[int, int], classes: int) -> bool:
    """Return whether arrays have the types, shapes and value ranges of rehearsal data."""
    try:
        frames = len(a["images"])
        forms = {
            "images": ("u1", (frames, *grid)), "label": ("i1", (frames,)),
            "first": ("b1", (frames,)), "base": ("i4", (len(a["networks"]), 2)),
        }  # fmt: skip
        if "origin" in a:
            forms |= {"origin": ("u1", (len(a["origin"]),)), "origin_golden": ("i4", (1,))}
        return (
            all(a[k].dtype == kind and a[k].shape == shape for k, (kind, shape) in forms.items())
            and bool(((a["label"] >= UNCLEAR) & (a["label"] < classes)).all())
            and examples_fit(a, grid)
            and ("pace" not in a or _paced(a["pace"], a["noise"], int(a["first"].sum())))
        )
    except (KeyError, TypeError):
        return False


def _paced(pace: NDArray[Any], noise: NDArray[Any], segments: int) -> bool:
    """Return whether arrays have a pace, (1,), and the noise of each segment, if any is needed."""
    if pace.dtype != np.int32 or pace.shape != (1,) or not 1 <= pace[0] <= _MOST_PACE:
        return False
    wanted = (segments if pace[0] > 1 else 0,)
    sound = noise.dtype == np.float32 and noise.shape == wanted
    return sound and bool(((noise >= 0.0) & (noise < 1.0)).all())


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
