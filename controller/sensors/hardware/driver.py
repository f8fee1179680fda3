"""The driver of an orb: scans a board, and makes picofarads of it. Real or emulated, all alike."""

import logging
from typing import Final

import numpy as np

from controller.recognition.images.frames import Frame
from controller.sensors.hardware import HardwareAwayError
from controller.sensors.hardware.board import Board
from controller.sensors.hardware.inversion import Inversion
from controller.sensors.hardware.pump import Pump, kilopascals
from controller.sensors.hardware.scanner import Scan, Scanner
from controller.shared.aliases import Array

_DARK_FIRST: Final = 16  # looks at the rows' own readings before the first frame
_DARK_EVERY: Final = 10  # frames from one later look to the next
_DARK_WEIGHT: Final = 1 / 64  # of a later look: leakage drifts slowly, and looks are noisy
_SILENT: Final = 0.004  # of full scale, in the mean: a thirtieth of an orb, and above noise
_BUSY: Final = 0.8  # share of the time between two frames that a scan may take
_TINY_S: Final = 1e-6
_TRIES: Final = 3  # scans that are timed
_BOUNCES: Final = 2  # frames that a plug which was out may still bounce

_log = logging.getLogger("controller")


class Driver:
    """Frames of one board, and what stands around the orb.

    Attributes:
        board: Which.
        scanner: Reads it.
        dark: What the rows read by themselves, counts, (rows,); None: not read yet.
        pressure_kpa: The orb's at the latest frame; None: not measured.
        pump: When it runs; None: there is none.
    """

    def __init__(self, board: Board) -> None:
        """Ground all electrodes."""
        self.board, self.scanner = board, Scanner(board)
        self.dark: Array | None = None
        self.pressure_kpa: float | None = None
        self.pump = None if board.wiring.pump is None else Pump(board.wiring.pump)
        self._inversion = Inversion(board.wiring, 1 << board.chip.bits)
        self._frames, self._lit, self._told = 0, False, ""
        self._bounces = 0  # frames that are not believed yet

    def frame(self, now_s: float = 0.0) -> Frame:
        """Scan, and return picofarads, (rows, columns); `now_s` is for the pump's limits.

        Raises:
            HardwareAwayError: The converter does not answer, or no orb hangs on it.
        """
        try:
            if self.dark is None:
                self.dark = self.scanner.dark(_DARK_FIRST)
            reading = self.scanner.scan()
            self._refuse_silence(reading, self.dark)
            self._follow_dark(self.dark)
            self._inflate(now_s)
        except HardwareAwayError:
            # What does not tell its pressure is not inflated; what blinks asks to be looked at.
            self.board.knobs.pump(False)
            self._light(not self._lit)
            self._bounces = _BOUNCES
            raise
        if self._bounces:
            self._bounces -= 1
            raise HardwareAwayError("the orb is coming back")
        self._light(True)
        self._frames += 1
        frame = self._inversion.picofarads(reading.counts, reading.age_s, self.dark)
        return np.asarray(frame, dtype=np.float32)

    def affordable(self, wanted_hz: float) -> float:
        """Return the rate at which to scan: as wanted, or what a scan takes leaves time for."""
        took_s = min(self._scan_s() for _ in range(_TRIES))  # other programs only ever delay one
        _log.info("a scan takes %.1f ms here", took_s * 1e3)
        most_hz = max(1.0, float(np.floor(_BUSY / max(took_s, _TINY_S))))
        if wanted_hz <= most_hz:
            return wanted_hz
        _log.warning(
            "that is too long for %g Hz, so the orb is read at %g Hz; shorten [times], or scan "
            'with scheme = "column" (docs/hardware.md)',
            wanted_hz,
            most_hz,
        )
        return most_hz

    def _scan_s(self) -> float:
        """Return what a scan takes, seconds."""
        began_s = self.board.clock()
        self.scanner.scan()
        return self.board.clock() - began_s

    def button(self) -> str | None:
        """Return what the label button says: "" down, "null" up; None: there is none."""
        pressed = self.board.knobs.pressed()
        return None if pressed is None else "" if pressed else "null"

    def close(self) -> None:
        """Stop the pump, ground all electrodes, and release the board."""
        self.board.close()

    def _follow_dark(self, before: Array) -> None:
        """Follow the rows' own readings, (rows,), slowly."""
        if self._frames % _DARK_EVERY == 0:
            self.dark = before + _DARK_WEIGHT * (self.scanner.dark(1) - before)

    def _refuse_silence(self, reading: Scan, dark: Array) -> None:
        """Refuse a frame that no orb can give; `dark` is (rows,)."""
        full = 1 << self.board.chip.bits
        if (reading.counts - dark[:, None]).mean() < _SILENT * full:
            raise HardwareAwayError(
                "all electrodes read nothing; see whether the membrane is plugged in and the "
                "converter has its supply"
            )
        if reading.counts.min() >= full - 1:
            raise HardwareAwayError(
                "all electrodes read full scale; see whether the converter has its ground"
            )

    def _inflate(self, now_s: float) -> None:
        """Run the pump, or let it rest."""
        wiring = self.board.wiring
        if self.pump is None or wiring.pump is None:
            return
        count = self.board.convert(wiring.pump.channel)
        volts = count / (1 << self.board.chip.bits) * wiring.supply_v
        self.pressure_kpa = kilopascals(wiring.pump, volts)
        self.board.knobs.pump(self.pump.step(now_s, self.pressure_kpa))
        if self.pump.problem != self._told:
            self._told = self.pump.problem
            _log.warning("%s", self._told)

    def _light(self, on: bool) -> None:
        if on != self._lit:
            self._lit = on
            self.board.knobs.light(on)
