"""Input of the location network: a touch image, cropped around the touch, at one strength.

On a large grid most taxels show noise only, so the network gets a crop around the strongest spot.
The strength of a touch has nothing to do with its place, so the deviation is scaled to one level.
"""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.frames import Image
from controller.shared.aliases import Images

TOUCH_WINDOWS: Final = 3  # windows of frames in a touch image
_SPOT: Final = 5  # side of the square whose deviation is summed, taxels: one noisy taxel is no spot
_TINY: Final = 1e-9  # level of an image without a deviation

Corners = NDArray[np.float32]  # (n, 2), (x, y) of a crop's near left taxel, grid units


@dataclass(frozen=True, slots=True)
class TouchInput:
    """Settings of the location network's input; stored in the bundle, by default none.

    Attributes:
        crop: Taxels of each side of the crop; 0: the whole grid. Shorter sides stay whole.
        level: Root mean square of z - 1 to which the input is scaled; 0: as it is.
    """

    crop: int = field(default=0, metadata={"range": (0, 30)})
    level: float = field(default=0.0, metadata={"range": (0.0, 1.0)})

    def shape(self, rows: int, columns: int) -> tuple[int, int]:
        """Return rows and columns of the input, for those of the grid."""
        most = self.crop or max(rows, columns)
        return min(rows, most), min(columns, most)

    def of(self, images: Images) -> tuple[Images, Corners]:
        """Return inputs (n, height, width) of touch images (n, rows, columns), and their corners.

        A place in an input plus its corner, (n, 2), is the place on the grid, (x, y).
        """
        count, rows, columns = images.shape
        height, width = self.shape(rows, columns)
        inputs, corners = images, np.zeros((count, 2), dtype=np.float32)
        if (height, width) != (rows, columns):
            inputs = np.empty((count, height, width), dtype=np.float32)
            for number, image in enumerate(images):
                top, left = _top_left(image, height, width)
                inputs[number] = image[top : top + height, left : left + width]
                corners[number] = left, rows - height - top  # row 0 is the far side
        return (_scaled(inputs, self.level) if self.level else inputs), corners


def _top_left(image: Image, height: int, width: int) -> tuple[int, int]:
    """Return the first row and column of a crop around the strongest spot of an image."""
    rows, columns = image.shape
    begin = _SPOT // 2 + 1  # before the first taxel are zeros, as are after the last
    padded = np.zeros((rows + _SPOT, columns + _SPOT))
    padded[begin : begin + rows, begin : begin + columns] = image - 1.0
    total = padded.cumsum(axis=0).cumsum(axis=1)
    high = total[_SPOT:] - total[:-_SPOT]
    spot = np.abs(high[:, _SPOT:] - high[:, :-_SPOT])  # some sensors rise under a touch
    row, column = divmod(int(spot.argmax()), columns)
    top = min(max(row - height // 2, 0), rows - height)
    return top, min(max(column - width // 2, 0), columns - width)


def _scaled(images: Images, level: float) -> Images:
    """Return images (n, rows, columns) with the root mean square of z - 1 at a level."""
    change = images - 1.0
    mean_square = np.einsum("nij,nij->n", change, change) / max(1, change[:1].size)
    factor = level / np.maximum(np.sqrt(mean_square), _TINY)
    return np.asarray(1.0 + change * factor[:, None, None], dtype=np.float32)
