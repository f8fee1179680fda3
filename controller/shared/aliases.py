"""Names of types that many modules use: arrays by element type and shape, and callbacks."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]  # of any shape
Complex = NDArray[np.complex128]  # of any shape; points of the plane are x + 1j * y
Mask = NDArray[np.bool_]  # of any shape, such as (rows, columns)
Index = NDArray[np.int64]  # (n,)

Frames = NDArray[np.float32]  # (n, rows, columns), picofarads
Images = NDArray[np.float32]  # (n, rows, columns), z
Windows = NDArray[np.float32]  # (windows, images, rows, columns), z
Reading = NDArray[np.float64]  # (rows, columns), picofarads, or relative to rest
Change = NDArray[np.float64]  # (rows, columns), z - 1

State = dict[str, NDArray[np.float64]]  # state of a stage, by name
Say = Callable[[str], None]  # takes a line for the user
