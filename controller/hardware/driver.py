"""The driver of an orb: scans a board, and makes picofarads of it. Real or emulated, all alike."""

import logging
from typing import Final

import numpy as np

from controller.hardware.board import Board
from controller.hardware.inversion import Array, picofarads
from controller.hardware.scanner import Scanner
from controller.preprocess import Frame

_DARK_EVERY: Final = 600  # frames from one look at the rows' own readings to the next

_log = logging.getLogger("controller")


class Driver:
    """Frames of one board.

    Attributes:
        board: Which.
        scanner: Reads it.
        dark: What the rows read by themselves, counts, (rows,); None: not read yet.
    """

    def __init__(self, board: Board) -> None:
        """Ground all electrodes."""
        self.board, self.scanner = board, Scanner(board)
        self.dark: Array | None = None
        self._frames = 0

    def frame(self) -> Frame:
        """Scan, and return picofarads, (rows, columns).

        Raises:
            HardwareAwayError: The converter does not answer.
        """
        if self.dark is None or self._frames % _DARK_EVERY == 0:
            self.dark = self.scanner.dark()
        reading = self.scanner.scan()
        self._frames += 1
        full = 1 << self.board.chip.bits
        frame = picofarads(self.board.wiring, reading.counts, reading.age_s, self.dark, full)
        return np.asarray(frame, dtype=np.float32)

    def close(self) -> None:
        """Release the board."""
        self.board.close()
