"""Golden vectors, `golden.npz`: reference inputs and outputs of a bundle's networks, as trained."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controller.shared import npz

_PEOPLE = "people"  # output of the user network

Answers = NDArray[np.float32]  # (n, outputs)


class GoldenError(ValueError):
    """The vectors do not match the manifest; the message has no subject."""


def _none() -> Answers:
    return np.zeros((0, 0), dtype=np.float32)


@dataclass(frozen=True, slots=True)
class Golden:
    """Reference inputs and outputs of the networks, against which a device compares its own."""

    # inputs of the gesture and user networks, (n, window, rows, columns), z
    windows: NDArray[np.float32]
    probabilities: Answers  # outputs of embedding and head as trained, (n, classes)
    images: NDArray[np.float32]  # inputs of the location network, (m, rows, columns), z
    touches: Answers  # its outputs, (m, 2), x and y in grid units
    # outputs of the user network, (n, 1 + users); n is 0 without that network
    people: Answers = field(default_factory=_none)

    def pack(self) -> bytes:
        """Return the file `golden.npz`."""
        names = ["windows", "probabilities", "images", "touches"]
        names += [_PEOPLE] if len(self.people) else []
        return npz.pack({name: getattr(self, name) for name in names})


def read(
    data: bytes,
    grid: tuple[int, int, int],
    classes: int,
    *,
    located: bool,
    people: int,
    limit_bytes: int,
) -> Golden:
    """Return the golden vectors in a file for windows of a grid (window, rows, columns).

    `people` is the number of outputs of the user network; 0: there is none. GoldenError if the file
    is damaged, or its arrays have other shapes.
    """
    try:
        arrays = npz.unpack(data, limit_bytes)
    except npz.NpzError as error:
        raise GoldenError(f"has golden vectors whose file {error}") from None
    shapes: dict[str, tuple[int, ...]] = {
        "windows": grid,
        "probabilities": (classes,),
        "images": grid[1:],
        "touches": (2,),
    }
    if people:
        shapes[_PEOPLE] = (people,)
    if set(arrays) != set(shapes):
        raise GoldenError(f"has golden vectors {', '.join(arrays)}, not {', '.join(shapes)}")
    for name, shape in shapes.items():
        array = arrays[name]
        if array.dtype != np.float32 or array.shape[1:] != shape or not np.isfinite(array).all():
            raise GoldenError(
                f"has golden {name} of {array.dtype} {array.shape}; "
                f"expected are finite float32 (n, {', '.join(map(str, shape))})"
            )
    windows, images = len(arrays["windows"]), len(arrays["images"])
    answers = [len(arrays[name]) for name in ("probabilities", _PEOPLE) if name in arrays]
    same = {windows} == set(answers) and images == len(arrays["touches"])
    if not same or not windows or bool(images) != located:
        raise GoldenError("has different numbers of golden inputs and outputs")
    return Golden(**arrays)
