"""Golden vectors: the answers of a bundle's networks when they were made, `golden.npz`."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controller import npz
from controller.recognition.user_id import Users

_HEAD = "head."  # before a user's name: the answers of that user's own gesture network
_PEOPLE = "people"
_OTHERS = ("windows", "images", "touches", _PEOPLE)  # what is no answer of a gesture network

Answers = NDArray[np.float32]


class GoldenError(ValueError):
    """The vectors are not what the manifest promises; the message has no subject."""


def _none() -> Answers:
    return np.zeros((0, 0), dtype=np.float32)


@dataclass(frozen=True, slots=True)
class Golden:
    """What the networks answered when they were made; the device asks them again.

    Attributes:
        windows: Questions to the gesture networks and to the user network, (n, window, rows,
            columns), z.
        probabilities: The gesture network's answers, (n, classes).
        images: Questions to the location network, (m, rows, columns), z.
        touches: Its answers, (m, 2), x and y in grid units.
        people: The user network's answers, (n, 1 + users), n is 0 where there is none.
        heads: Answers of users' own gesture networks, (n, classes) by name.
    """

    windows: NDArray[np.float32]
    probabilities: Answers
    images: NDArray[np.float32]
    touches: Answers
    people: Answers = field(default_factory=_none)
    heads: Mapping[str, Answers] = field(default_factory=dict)

    def pack(self) -> bytes:
        """Return the file."""
        return npz.pack(self.arrays())

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """Return what `golden.npz` holds."""
        arrays = {
            "windows": self.windows,
            "probabilities": self.probabilities,
            "images": self.images,
            "touches": self.touches,
        }
        if self.people.shape[1]:
            arrays[_PEOPLE] = self.people
        return arrays | {f"{_HEAD}{name}": answers for name, answers in self.heads.items()}


def read(
    data: bytes,
    grid: tuple[int, int, int],
    classes: int,
    *,
    located: bool,
    users: Users,
    told: bool,
    most: int,
) -> Golden:
    """Return the golden vectors in a file, of the shapes that the manifest promises.

    Args:
        data: The file.
        grid: Window, rows and columns.
        classes: Outputs of the gesture network.
        located: Whether there is a location network.
        users: Whom the bundle knows.
        told: Whether there is a user network.
        most: Bytes that the arrays may have together.

    Raises:
        GoldenError: It holds anything else.
    """
    try:
        arrays = npz.unpack(data, most)
    except npz.NpzError as error:
        raise GoldenError(f"has golden vectors whose file {error}") from None
    shapes: dict[str, tuple[int, ...]] = {
        "windows": grid,
        "probabilities": (classes,),
        "images": grid[1:],
        "touches": (2,),
    }
    if users.names:
        shapes[_PEOPLE] = (1 + len(users.names),)
    shapes |= {f"{_HEAD}{name}": (classes,) for name in users.heads}
    if set(arrays) != set(shapes):
        raise GoldenError(f"has golden vectors {', '.join(arrays)}, not {', '.join(shapes)}")
    for name, shape in shapes.items():
        array = arrays[name]
        if array.dtype != np.float32 or array.shape[1:] != shape or not np.isfinite(array).all():
            raise GoldenError(
                f"has golden {name} of {array.dtype} {array.shape}; "
                f"expected are finite float32 (n, {', '.join(map(str, shape))})"
            )
    asked = len(arrays["windows"])
    pairs = [(len(arrays["images"]), len(arrays["touches"]), located)]
    pairs += [(asked, len(arrays[name]), True) for name in shapes if name not in _OTHERS]
    if users.names:
        pairs.append((asked if told else 0, len(arrays[_PEOPLE]), told))
    if any(given != answered or bool(given) != wanted for given, answered, wanted in pairs):
        raise GoldenError("has golden questions and answers that are not equally many")
    heads = {name: arrays.pop(f"{_HEAD}{name}") for name in users.heads}
    return Golden(**arrays, heads=heads)
