"""Does the doctor name what is wrong? Faults of the wiring on random orbs, and orbs without any.

    python -m tests.benchmarks.doctor [--orbs N] [--healthy N] [--workers N] [--json]

Every orb draws its taxels, its parts' tolerances and the hand that presses it; every fault its
place and its size. An orb counts as what the first fault of the doctor's table says. What only
touches can tell (electrodes that are swapped, mirrored or turned at the plug; a taxel that feels
nothing) is looked for with presses; orbs without a fault are pressed, too.
"""

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from itertools import repeat
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.cli import doctor
from controller.diagnostics import measurements, touch_checks, wiring_checks
from controller.diagnostics.report import Row, Verdict
from controller.recognition.images.frames import Frame
from controller.sensors.base import Sensor
from controller.sensors.geometry import RATE_HZ, Geometry
from controller.sensors.hardware.driver import Driver
from controller.sensors.hardware.emulated.board import EmulatedBoard
from controller.sensors.hardware.emulated.circuit import KINDS, WiringFault
from controller.sensors.hardware.wiring import Wiring
from controller.shared.protocol.messages import Contact
from controller.simulator.orb import PRESETS, preset
from tests.support.presses import pressed

from .results import Results, command_line

ROWS, COLUMNS, PITCH_MM = 5, 5, 10.0
HANDS = 8  # who miss the taxel that they mean, each in another way
AIM_MM = 1.5  # deviation of a finger from where it should press: as in the simulated sessions
DEPTHS_MM = (6.5, 12.0)
_DRIFT = 0.004  # of each taxel from one touch to the next
NOTHING: Final = "nothing"
# Sizes are drawn log-evenly between these; () where a kind has none. Noise is in counts of 4096, on
# top of what a preset has.
SIZES: Final[dict[str, tuple[float, float] | tuple[()]]] = {
    "open_row": (), "open_column": (), "short_rows": (), "short_columns": (), "short_taxel": (),
    "grounded_row": (), "grounded_column": (), "swapped_channels": (), "no_channel": (), "dead": (),
    "no_bleed": (), "no_row_capacitor": (), "unplugged": (), "no_converter": (),
    "bus_errors": (0.05, 0.4), "other_converter": (), "low_reference": (0.6, 0.9),
    "noise": (100.0, 300.0),
}  # fmt: skip
TOUCHED: Final = ("swapped_rows", "swapped_columns", "stiff", "mirrored", "turned")
# What a fault is called, where that is not the name of its kind: seen from the board they are one.
CALLED: Final = {
    "low_reference": "reference", "grounded_row": "stuck", "grounded_column": "stuck",
    "no_bleed": "bleed", "open_row": "open", "open_column": "open", "short_rows": "short",
    "short_columns": "short",
}  # fmt: skip
_PLACES: Final = {
    "taxel": (ROWS, COLUMNS), "row": (ROWS,), "rows": (ROWS - 1,), "column": (COLUMNS,),
    "columns": (COLUMNS - 1,), "": (),
}  # fmt: skip
SLOW_HZ: Final = 2.0  # where nobody presses, so that less is emulated
_FAMILY: Final = 5_000_000  # of seeds
_HEALTHY: Final = 1_000_000


@cache
def presses(hand: int) -> NDArray[np.float64]:
    """Return z - 1 under every press that the doctor asks for, by one hand."""
    rng = np.random.default_rng([7, hand])
    return np.array(
        [
            pressed(
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
        turned: bool = False, mirrored: str = "", stiff: tuple[int, int] | None = None,
    ) -> None:  # fmt: skip
        rng = np.random.default_rng([11, seed])
        self.rate_hz, self.turned, self.mirrored = rate_hz, turned, mirrored
        parts = preset(name).electronics
        self._rest = rng.normal(*parts.rest_pf, (ROWS, COLUMNS))
        broken = [WiringFault.parse(fault) for fault in faults]
        wiring = replace(Wiring(), pump=None)
        # on which it lies
        self.bench = EmulatedBoard(
            wiring, seed, model=parts.readout, faults=broken, picofarads=self._rest
        )
        self.board = self.bench.board
        self.driver = Driver(self.board)
        self._hand, self._rng = int(rng.integers(HANDS)), rng
        self._stiff = stiff

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
        if self._stiff is not None:
            change[self._stiff] = 0.0
        drift = 1.0 + _DRIFT * self._rng.standard_normal((ROWS, COLUMNS))
        self.bench.touch(self._rest * (1.0 + change) * drift, fingers)

    def close(self) -> None:
        self.driver.close()


def draw(kind: str, name: str, seed: int) -> tuple[str, dict[str, Any]]:
    """Return a fault of this kind as the bench takes it, and what else is done to the sensor."""
    rng = np.random.default_rng([_FAMILY, seed])
    if kind == "turned":
        return "", {"turned": True}
    if kind == "stiff":
        return "", {"stiff": (int(rng.integers(ROWS)), int(rng.integers(COLUMNS)))}
    if kind == "mirrored":
        return "", {"mirrored": str(rng.choice(["rows", "columns"]))}
    place = ",".join(str(rng.integers(limit)) for limit in _PLACES[KINDS[kind].place])
    text = f"{kind}:{place}" if place else kind
    if size := SIZES.get(kind, ()):
        value = float(np.exp(rng.uniform(*np.log(size))))
        if kind in ("noisy", "noise"):
            value += 2.0 * preset(name).electronics.readout.noise_lsb
        text += f"={value:.4f}"
    return text, {}


def diagnose(sensor: Wired, *, press: bool) -> list[Row]:
    """Return what the doctor finds wrong."""
    if press:
        rows = doctor.sensor_rows(sensor)
    else:
        rows = iter(wiring_checks.judge(measurements.measure(sensor.board)))
    return [row for row in rows if row.verdict is Verdict.FAULT]


def one(kind: str, name: str, number: int) -> tuple[str, bool]:
    """Return what an orb's fault is called by the doctor, and whether the place is right."""
    seed = _FAMILY + 1000 * (number + 1) + sum(kind.encode())
    text, more = draw(kind, name, seed)
    rate_hz = RATE_HZ if kind in TOUCHED else SLOW_HZ
    sensor = Wired(seed, name, [text] if text else [], rate_hz=rate_hz, **more)
    try:
        faults = diagnose(sensor, press=kind in TOUCHED)
    finally:
        sensor.close()
    if not faults:
        return NOTHING, False
    first = faults[0]
    numbers = "".join(c if c.isdigit() else " " for c in first.name).split()
    text = text or f":{more['stiff'][0]},{more['stiff'][1]}" if "stiff" in more else text
    wanted = text.partition(":")[2].partition("=")[0].split(",") if ":" in text else numbers
    return first.code, numbers == wanted


def healthy(name: str, number: int) -> list[tuple[str, str, str]]:
    """Return what an orb without a fault is accused of."""
    sensor = Wired(_HEALTHY + number, name, rate_hz=RATE_HZ)
    try:
        return [(row.code, row.name, row.found) for row in diagnose(sensor, press=True)]
    finally:
        sensor.close()


def main() -> None:
    """Print how often each fault is named, for each preset, and what sound orbs are accused of."""
    options = command_line(__doc__, orbs=50, healthy=500, workers=1).parse_args()
    results = Results("doctor")
    kinds = (*SIZES, *TOUCHED)
    with ProcessPoolExecutor(options.workers) as pool:
        for name in PRESETS:
            print(f"\n{name}: {options.orbs} orbs each; share named, share placed, other answers")
            named, seen = [], []
            for kind in kinds:
                told = list(pool.map(one, repeat(kind), repeat(name), range(options.orbs)))
                right = [code == CALLED.get(kind, kind) for code, _ in told]
                placed = [place for (_, place), hit in zip(told, right, strict=True) if hit]
                others = Counter(code for code, _ in told if code != CALLED.get(kind, kind))
                shares = f"{np.mean(right):6.2f}{np.mean(placed):6.2f}"
                print(f"{kind:<18}{shares}  {dict(others)}", flush=True)
                named += right
                seen += [code != NOTHING for code, _ in told]
            results.note("faults_named", float(np.mean(named)), "share", preset=name)
            results.note("faults_seen", float(np.mean(seen)), "share", preset=name)
            flags = list(pool.map(healthy, repeat(name), range(options.healthy)))
            share = sum(bool(flag) for flag in flags) / max(1, options.healthy)
            results.note("healthy_flagged", share, "share", preset=name, goal=0.01)
            for accused in flags:
                for code, where, found in accused:
                    print(f"  accused: {code} at {where}: {found}")
    results.finish(options.json)


if __name__ == "__main__":
    main()
