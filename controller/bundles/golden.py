"""Golden vectors, `golden.npz`: reference inputs and outputs of a bundle's networks, as trained."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controller.bundles.container import BundleError, arrays_of, check_arrays
from controller.shared import npz

_PEOPLE = "people"  # output of the user network

Answers = NDArray[np.float32]  # (n, outputs)


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
) -> Golden:
    """Return the golden vectors in a file for windows of a grid (window, rows, columns).

    `people` is the number of outputs of the user network; 0: there is none. BundleError if the file
    is damaged, or its arrays have other shapes.
    """
    arrays = arrays_of(data, "golden vectors")
    shapes: dict[str, tuple[int, ...]] = {
        "windows": grid,
        "probabilities": (classes,),
        "images": grid[1:],
        "touches": (2,),
    }
    if people:
        shapes[_PEOPLE] = (people,)
    check_arrays("golden vectors", arrays, {name: (-1, *shape) for name, shape in shapes.items()})
    windows, images = len(arrays["windows"]), len(arrays["images"])
    answers = [len(arrays[name]) for name in ("probabilities", _PEOPLE) if name in arrays]
    same = {windows} == set(answers) and images == len(arrays["touches"])
    if not same or not windows or bool(images) != located:
        raise BundleError("has different numbers of golden inputs and outputs")
    return Golden(**arrays)
