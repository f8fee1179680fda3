"""The driver of an orb: scans a board, and makes picofarads of it. Real or emulated, all alike."""

import logging
from typing import Final

import numpy as np

from controller.recognition.images.frames import Frame
from controller.sensors.hardware import HardwareAwayError
from controller.sensors.hardware.board import Board
from controller.sensors.hardware.inversion import Inversion
from controller.sensors.hardware.scanner import Scan, Scanner
from controller.sensors.hardware.wiring import PumpWiring
from controller.shared.aliases import Array

_DARK_FIRST: Final = 16  # looks at the rows' own readings before the first frame
_DARK_EVERY: Final = 10  # frames from one later look to the next
_DARK_WEIGHT: Final = 1 / 64  # of a later look: leakage drifts slowly, and looks are noisy
_SILENT: Final = 0.004  # of full scale, in the mean: a thirtieth of an orb, and above noise
_BUSY: Final = 0.8  # share of the time between two frames that a scan may take
_TINY_S: Final = 1e-6
_TRIES: Final = 3  # scans that are timed
_BOUNCES: Final = 2  # frames that a plug which was out may still bounce

SLACK: Final = 0.02  # of the target: what the pressure may fall before the pump starts again
_RISES_KPA: Final = 0.03  # what a run of `longest_s` must bring, or something leaks or is blocked
_BELOW_KPA: Final = -0.3  # no orb sucks: the pressure sensor is off
_TIMES: Final = 5  # impossible pressures in a row, before the pump is given up
_RUNS: Final = 3  # without a rise, before the pump is given up

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
            'with scheme = "column" (orbtouch docs hardware)',
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


class Pump:
    """Says whether the pump shall run.

    Attributes:
        problem: Why the pump is refused, in words; "" while all is well.
        running: What was last said.
    """

    def __init__(self, wiring: PumpWiring) -> None:
        """Begin with the pump at rest."""
        self.problem, self.running = "", False
        self._wiring = wiring
        self._since_s = 0.0  # when it began to run
        self._from_kpa = 0.0  # where
        self._rests_until_s = float("-inf")
        self._in_vain = self._impossible = 0

    def step(self, now_s: float, kpa: float) -> bool:
        """Return whether the pump shall run, for a pressure; call it often."""
        wiring = self._wiring
        refusal = self._refusal(kpa)
        self._impossible = self._impossible + 1 if refusal else 0
        if self._impossible >= _TIMES:
            self.problem = self.problem or refusal
        if self.problem or refusal or now_s < self._rests_until_s:
            self.running = False
        elif not self.running and kpa < wiring.target_kpa * (1.0 - SLACK):
            self.running, self._since_s, self._from_kpa = True, now_s, kpa
        elif self.running and kpa >= wiring.target_kpa:
            self.running, self._in_vain = False, 0
        elif self.running and now_s - self._since_s >= wiring.longest_s:
            self.running, self._rests_until_s = False, now_s + wiring.rest_s
            self._judge(kpa)
        return self.running

    def _refusal(self, kpa: float) -> str:
        if not kpa <= self._wiring.limit_kpa:
            return (
                f"the orb has {kpa:.2f} kPa, more than its limit of {self._wiring.limit_kpa:g}; "
                "the pump stays off until the controller is started again"
            )
        if kpa < _BELOW_KPA:
            return f"the pressure sensor reads {kpa:.2f} kPa; check its supply, the pump stays off"
        return ""

    def _judge(self, kpa: float) -> None:
        """Give up on a pump that runs in vain."""
        self._in_vain = 0 if kpa - self._from_kpa >= _RISES_KPA else self._in_vain + 1
        if self._in_vain >= _RUNS:
            self.problem = (
                f"the pump ran {_RUNS} times for {self._wiring.longest_s:g} s and the pressure is "
                f"still {kpa:.2f} kPa; look for a leak, a loose hose or a dead pump"
            )


def kilopascals(wiring: PumpWiring, volts: float) -> float:
    """Return the pressure that the sensor's output means."""
    return (volts - wiring.zero_v) / wiring.v_per_kpa
