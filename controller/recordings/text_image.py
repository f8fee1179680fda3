"""Small pictures of sensor images in a terminal, in blocks or in plain ASCII."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

BLOCKS: Final = " ░▒▓█"
ASCII: Final = " .:+#"
WIDTH: Final = 80  # columns of a terminal
TALL: Final = 16  # rows of a picture; larger grids are averaged
_INDENT: Final = 2
_APART: Final = 3  # columns between two pictures
_LONGEST: Final = 24  # letters of a name

Map = NDArray[np.floating]  # one number a taxel, 0 and more, (rows, columns)
Picture = tuple[str, Map, str]  # name, what to draw, and what stands under it


def gallery(pictures: Sequence[Picture], shades: str = BLOCKS) -> list[str]:
    """Return pictures side by side as lines for a terminal, each in shades of its own greatest.

    Args:
        pictures: What to draw.
        shades: From nothing to the greatest value.
    """
    if not pictures:
        return []
    blocks = [_block(*picture, shades) for picture in pictures]
    width = max(len(line) for block in blocks for line in block)
    abreast = max(1, (WIDTH - _INDENT + _APART) // (width + _APART))
    lines: list[str] = []
    for first in range(0, len(blocks), abreast):
        lines += [""] if first else []
        row = [[line.ljust(width) for line in block] for block in blocks[first : first + abreast]]
        lines += [
            (" " * _INDENT + (" " * _APART).join(cells)).rstrip()
            for cells in zip(*row, strict=True)
        ]
    return lines


def _block(name: str, values: Map, below: str, shades: str) -> list[str]:
    """Return one picture: its name, a line for each row, two characters a taxel, and a caption."""
    shown = _shrunk(values)
    shares = np.clip(shown / (shown.max() or 1.0), 0.0, 1.0)
    steps = np.rint(shares * (len(shades) - 1)).astype(int)
    picture = ["|" + "".join(2 * shades[step] for step in row) + "|" for row in steps.tolist()]
    return [name[:_LONGEST], *picture, below]


def _shrunk(values: Map) -> Map:
    """Return a picture that fits, by averaging squares of taxels."""
    rows, columns = values.shape
    most = (WIDTH - _INDENT - 2) // 2
    factor = max(-(-rows // TALL), -(-columns // most))
    if factor == 1:
        return values
    wide = np.full((-(-rows // factor) * factor, -(-columns // factor) * factor), np.nan)
    wide[:rows, :columns] = values
    squares = wide.reshape(wide.shape[0] // factor, factor, wide.shape[1] // factor, factor)
    return np.asarray(np.nanmean(squares, axis=(1, 3)))
