"""Material of lessons: embeddings of a bundle's training, and the examples it was taught.

The part `rehearsal.npz` holds windows of the training's recordings, against forgetting:

    embedding  uint8 (windows, width), embeddings of windows over `scale`
    scale      float32 (width,)
    touch      int32 (windows,), number of the touch that a window shows, -1 without one
    firmest    uint8 (labels, rows, columns), image of each gesture at its firmest, as `to_bytes`

The part `taught.npz` holds, beside rows of the head (`controller.bundles.head`), the examples as
`pack` makes them, and the debouncer's settings before the first lesson as TOML: `debounce`. It may
hold windows of those who taught, outside of the examples:

    own_embedding  uint8 (windows, width), embeddings over `own_scale`
    own_scale      float32 (width,)
    own_touch      int32 (windows,), number of the labelled stretch that a window shows
    own_label      text (windows,), its label
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np
import tomli_w
from numpy.typing import NDArray

from controller.adapt.examples import TURNS, Example
from controller.adapt.own_frames import OwnFrames, quantised
from controller.bundles import container, head
from controller.bundles.container import BundleError
from controller.bundles.head import Head, Matrix
from controller.recognition.debounce import DebounceSettings
from controller.shared import config, npz
from controller.shared.aliases import Images
from controller.shared.config import ConfigError
from controller.shared.notices import notice

STEPS_PER_Z: Final = 200.0
UNTOUCHED: Final = 128
MAX_BYTES: Final = 8 << 20
_LEAST, _MOST = 0.36, 1.635  # z that bytes hold
_MOST_FLOAT16: Final = 6e4  # and 16 bits

ImageBytes = NDArray[np.uint8]  # (frames, rows, columns)


@dataclass(frozen=True, slots=True, eq=False)
class Rehearsal:
    """Windows of the training that lessons must not change."""

    embedding: Matrix  # (n, width)
    touch: NDArray[np.int32]  # number of the touch that each shows, -1 without one, (n,)
    firmest: ImageBytes  # image of each trained label at its firmest, (labels, rows, columns)

    def pack(self) -> bytes:
        """Return the part `rehearsal.npz`."""
        steps, scale = quantised(self.embedding)
        arrays: npz.Arrays = {
            "embedding": steps,
            "scale": scale,
            "touch": self.touch,
            "firmest": self.firmest,
        }
        return npz.pack(arrays)


@dataclass(frozen=True, slots=True, eq=False)
class Lessons:
    """A bundle's parts with what it learns from."""

    parts: Mapping[str, bytes]  # of its file
    table: dict[str, Any]  # its manifest
    head: Head  # as it was trained
    rehearsal: Rehearsal | None  # None: nothing can be taught
    examples: tuple[Example, ...]  # of all lessons
    own: OwnFrames  # of the same people
    debounce: DebounceSettings  # in force, without gestures that wait for taught ones

    @property
    def trained(self) -> tuple[str, ...]:
        """The labels that it was trained with."""
        return tuple(self.table["labels"][: len(self.head.out)])

    @property
    def taught(self) -> tuple[str, ...]:
        """The gestures that it was not trained with."""
        return tuple(self.table["labels"][len(self.head.out) :])

    @property
    def grid(self) -> tuple[int, int]:
        """Rows and columns of the sensor."""
        return self.table["rows"], self.table["columns"]


def read(data: bytes) -> Lessons:
    """Return the lessons of a file that `bundle.parse` accepts; BundleError if it is damaged."""
    try:
        parts = container.unpack(data)
        table = container.manifest(parts[container.MANIFEST])
        grid = table["rows"], table["columns"]
        own = head.read(parts[container.HEAD])
        part = parts.get(container.REHEARSAL)
        known = None if part is None else _rehearsal(part, own, grid)
        debounce = config.settings(DebounceSettings, table["debounce"])
        if container.TAUGHT not in parts:
            none = OwnFrames.none(own.hidden.shape[1])
            return Lessons(parts, table, own, known, (), none, debounce)
        arrays = npz.unpack(parts[container.TAUGHT], MAX_BYTES)
        if not fits(arrays, grid):
            raise BundleError("has examples of another sensor or version; install a newer bundle")
        before = config.settings(DebounceSettings, config.parse_toml(arrays["debounce"].tobytes()))
        # Thresholds may have been chosen anew since; each lesson finds anew which gesture waits.
        debounce = replace(
            debounce,
            patient=before.patient,
            awaited=before.awaited,
            patience_s=before.patience_s,
        )
        frames = _own(arrays, own.hidden.shape[1])
        return Lessons(parts, table, own, known, unpack(arrays), frames, debounce)
    except (npz.ZipError, BundleError, ConfigError, KeyError) as error:
        raise BundleError(notice("the_bundle", error)) from None


def pack_taught(
    examples: Sequence[Example],
    own: OwnFrames,
    debounce: DebounceSettings,
    rows: Mapping[str, Head],
) -> bytes:
    """Return the part `taught.npz`."""
    text = np.frombuffer(tomli_w.dumps(asdict(debounce)).encode(), dtype=np.uint8)
    packed = pack(examples, examples[0].images.shape[1:])
    return npz.pack({**packed, **own.arrays(), "debounce": text, **head.row_arrays(rows)})


def _own(a: npz.Arrays, width: int) -> OwnFrames:
    """Return the windows in a part; BundleError if they are not of the bundle's network."""
    if "own_touch" not in a:
        return OwnFrames.none(width)
    windows = len(a["own_touch"])
    forms = {
        "own_embedding": ("u1", (windows, width)),
        "own_scale": ("f4", (width,)),
        "own_touch": ("i4", (windows,)),
        "own_label": ("<U40", (windows,)),
    }
    if not _formed(a, forms):
        raise BundleError("has frames of another sensor or version; install a newer bundle")
    return OwnFrames(a["own_embedding"] * a["own_scale"], a["own_touch"], a["own_label"])


def _rehearsal(data: bytes, own: Head, grid: tuple[int, int]) -> Rehearsal:
    """Return the material in a part; BundleError if it is not of the bundle's head and sensor."""
    a = npz.unpack(data, MAX_BYTES)
    windows, classes, width = len(a["touch"]), len(own.out), own.hidden.shape[1]
    forms = {
        "embedding": ("u1", (windows, width)),
        "scale": ("f4", (width,)),
        "touch": ("i4", (windows,)),
        "firmest": ("u1", (classes, *grid)),
    }
    if not windows or not _formed(a, forms):
        raise BundleError("has a rehearsal of another sensor or version; install a newer bundle")
    return Rehearsal(a["embedding"] * a["scale"], a["touch"], a["firmest"])


def pack(examples: Sequence[Example], grid: tuple[int, ...]) -> npz.Arrays:
    """Return the arrays of examples with their spans, for `grid` = (rows, columns)."""
    images = np.concatenate([np.ones((0, *grid), np.float32), *(one.images for one in examples)])
    # Bytes hold what an orb shows; on other sensors z may be several.
    held = not len(images) or (images.min() > _LEAST and images.max() < _MOST)
    spans = [one.span or (0.0, 0.0) for one in examples]
    words = [(one.label, one.user, one.rotations) for one in examples]
    return {
        "taught": to_bytes(images)
        if held
        else images.clip(-_MOST_FLOAT16, _MOST_FLOAT16).astype(np.float16),
        "taught_frames": np.array([len(one.images) for one in examples], dtype=np.int32),
        "taught_span": np.array(spans, dtype=np.float32).reshape(-1, 2),
        "taught_words": np.array(words, dtype="U40").reshape(-1, 3),
        "taught_mirror": np.array([one.mirrored for one in examples], dtype=np.bool_),
        "taught_edge": np.array([one.edge for one in examples], dtype=np.float32),
    }


def unpack(a: npz.Arrays) -> tuple[Example, ...]:
    """Return the examples in arrays of `pack`, which `fits` accepts."""
    words = [[str(word) for word in row] for row in a["taught_words"]]
    images = a["taught"]
    images = from_bytes(images) if images.dtype == np.uint8 else images.astype(np.float32)
    cuts = np.split(images, np.cumsum(a["taught_frames"]))[:-1]
    return tuple(
        Example(label, cut, user, turns, bool(mirrored), (float(b), float(e)), float(edge))
        for cut, (label, user, turns), mirrored, (b, e), edge in zip(
            cuts, words, a["taught_mirror"], a["taught_span"], a["taught_edge"], strict=True
        )
    )


def fits(a: npz.Arrays, grid: tuple[int, ...]) -> bool:
    """Return whether arrays are those of examples, for `grid` = (rows, columns)."""
    try:
        frames, count = len(a["taught"]), len(a["taught_frames"])
    except (KeyError, TypeError):
        return False
    forms = {
        "taught": ("f2" if a["taught"].dtype == np.float16 else "u1", (frames, *grid)),
        "taught_frames": ("i4", (count,)),
        "taught_span": ("f4", (count, 2)),
        "taught_words": ("<U40", (count, 3)),
        "taught_mirror": ("b1", (count,)),
        "taught_edge": ("f4", (count,)),
    }
    return (
        _formed(a, forms)
        and int(a["taught_frames"].sum()) == frames
        and bool((a["taught_frames"] > 0).all())
        and all(str(rotations) in TURNS for rotations in a["taught_words"][:, 2])
    )


def _formed(a: npz.Arrays, forms: Mapping[str, tuple[str, tuple[Any, ...]]]) -> bool:
    """Return whether there are arrays of these types and shapes, by name; all numbers finite."""
    return all(
        name in a
        and (a[name].dtype, a[name].shape) == (np.dtype(kind), shape)
        and (a[name].dtype.kind != "f" or bool(np.isfinite(a[name]).all()))
        for name, (kind, shape) in forms.items()
    )


def to_bytes(images: NDArray[np.floating]) -> ImageBytes:
    """Return z, (n, rows, columns), as bytes like in telemetry: steps of 0.005, 0.36 to 1.635."""
    steps = np.rint((images.astype(np.float64) - 1.0) * STEPS_PER_Z) + UNTOUCHED
    return np.asarray(np.clip(steps, 0, 255), dtype=np.uint8)


def from_bytes(images: ImageBytes) -> Images:
    """Return the z of bytes, (n, rows, columns)."""
    return np.asarray(1.0 + (images.astype(np.float32) - UNTOUCHED) / STEPS_PER_Z, np.float32)
