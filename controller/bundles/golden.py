"""Golden vectors, `golden.npz`: reference inputs and outputs of a bundle's networks."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controller import npz
from controller.recognition.user_id import Users

_HEAD = "head."  # before a user's name: outputs of that user's own gesture network
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
    probabilities: Answers  # outputs of the gesture network, (n, classes)
    images: NDArray[np.float32]  # inputs of the location network, (m, rows, columns), z
    touches: Answers  # its outputs, (m, 2), x and y in grid units
    # outputs of the user network, (n, 1 + users); n is 0 without that network
    people: Answers = field(default_factory=_none)
    # outputs of users' own gesture networks, (n, classes) by name
    heads: Mapping[str, Answers] = field(default_factory=dict)

    def pack(self) -> bytes:
        """Return the file `golden.npz`."""
        names = ("windows", "probabilities", "images", "touches", _PEOPLE)
        arrays = {name: getattr(self, name) for name in names}
        if not self.people.shape[1]:
            del arrays[_PEOPLE]
        return npz.pack(arrays | {f"{_HEAD}{name}": heads for name, heads in self.heads.items()})


def read(
    data: bytes, grid: tuple[int, int, int], classes: int,
    *, located: bool, users: Users, identified: bool, limit_bytes: int,
) -> Golden:  # fmt: skip
    """Return the golden vectors in a file for windows of a grid (window, rows, columns).

    GoldenError if the file is damaged, or its arrays have other shapes than the manifest implies.
    """
    try:
        arrays = npz.unpack(data, limit_bytes)
    except npz.NpzError as error:
        raise GoldenError(f"has golden vectors whose file {error}") from None
    heads = [f"{_HEAD}{name}" for name in users.heads]
    shapes: dict[str, tuple[int, ...]] = {
        "windows": grid, "probabilities": (classes,), "images": grid[1:], "touches": (2,),
        **({_PEOPLE: (1 + len(users.names),)} if users.names else {}),
        **dict.fromkeys(heads, (classes,)),
    }  # fmt: skip
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
    lengths = dict.fromkeys(("probabilities", *heads), windows) | {"touches": images}
    if users.names:
        lengths[_PEOPLE] = windows if identified else 0
    equal = all(len(arrays[name]) == length for name, length in lengths.items())
    if not equal or not windows or bool(images) != located:
        raise GoldenError("has different numbers of golden inputs and outputs")
    return Golden(
        **{name: arrays[name] for name in arrays if name not in heads},
        heads={name: arrays[f"{_HEAD}{name}"] for name in users.heads},
    )
