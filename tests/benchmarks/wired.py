"""Orbs on the emulated bench, quick enough for thousands: a skin that moves only when pressed."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from controller.diagnostics import touch_checks
from controller.recognition.images.frames import Frame
from controller.sensors.base import Sensor
from controller.sensors.geometry import Geometry
from controller.sensors.hardware.driver import Driver
from controller.sensors.hardware.emulated.board import BoardModel, EmulatedBoard
from controller.sensors.hardware.emulated.circuit import WiringFault
from controller.sensors.hardware.wiring import Wiring
from controller.shared.protocol.messages import Contact
from controller.simulator.orb import preset

ROWS, COLUMNS, PITCH_MM = 5, 5, 10.0
HANDS = 8  # who miss the taxel that they mean, each in another way
AIM_MM = 1.5  # deviation of a finger from where it should press: as in the simulated sessions
DEPTHS_MM = (6.5, 12.0)
_DRIFT = 0.004  # of each taxel from one touch to the next


@cache
def presses(hand: int) -> NDArray[np.float64]:
    """Return z - 1 under every press that the doctor asks for, by one hand."""
    rng = np.random.default_rng([7, hand])
    return np.array(
        [
            touch_checks.pressed(
                ROWS, COLUMNS, PITCH_MM, place,
                off_mm=complex(*rng.normal(0.0, AIM_MM, 2)),
                depth_mm=float(rng.uniform(*DEPTHS_MM)),
            )
            for place in touch_checks.places(ROWS, COLUMNS)
        ]
    )  # fmt: skip


class Wired(Sensor):
    """A virtual sensor on the bench, which can be pressed where the doctor asks for it."""

    virtual = True
    geometry = Geometry(ROWS, COLUMNS, PITCH_MM)
    device_id = "wired"
    driver: Driver

    def __init__(
        self, seed: int, name: str, faults: Sequence[str] = (), *, rate_hz: float = 2.0,
        turned: bool = False, mirrored: str = "",
    ) -> None:  # fmt: skip
        rng = np.random.default_rng([11, seed])
        self.rate_hz, self.turned, self.mirrored = rate_hz, turned, mirrored
        readout, parts = preset(name).electronics.readout, preset(name).electronics
        model = BoardModel(
            noise_lsb=readout.noise_lsb, mains=readout.mains, mains_hz=readout.mains_hz,
            finger_pf=readout.finger_pf,
        )  # fmt: skip
        self._rest = rng.normal(*parts.rest_pf, (ROWS, COLUMNS))
        broken = [WiringFault.parse(fault) for fault in faults]
        wiring = replace(Wiring(), pump=None)
        # on which it lies
        self.bench = EmulatedBoard(wiring, seed, model=model, faults=broken, picofarads=self._rest)
        self.board = self.bench.board
        self.driver = Driver(self.board)
        self._hand, self._rng = int(rng.integers(HANDS)), rng
        self._stiff = [(f.row, f.column) for f in broken if f.kind == "stiff"]

    def read(self, t_s: float) -> Frame:
        frame = self.driver.frame(t_s)
        frame = frame.T if self.turned else frame
        if self.mirrored:
            frame = frame[::-1] if self.mirrored == "rows" else frame[:, ::-1]
        return frame

    def touch(self, contacts: Sequence[Contact], t_s: float) -> None:
        change = np.zeros((ROWS, COLUMNS))
        fingers = np.zeros(ROWS)
        for contact in contacts:
            place = (round(ROWS - 1 - contact.y), round(contact.x))
            change = presses(self._hand)[touch_checks.places(ROWS, COLUMNS).index(place)].copy()
            fingers[place[0]] = 1.0
        drift = 1.0 + _DRIFT * self._rng.standard_normal((ROWS, COLUMNS))
        self.bench.touch(self._rest * (1.0 + change) * drift, fingers)

    def close(self) -> None:
        self.driver.close()
