"""Does the doctor name what is wrong? Faults of the wiring on random orbs, and orbs without any.

    python -m tests.benchmarks.doctor [--orbs N] [--healthy N] [--workers N] [--json]

Every orb draws its taxels, its parts' tolerances and the hand that presses it; every fault its
place and its size. An orb counts as what the first fault of the doctor's table says. What only
touches can tell (electrodes that are swapped, mirrored or turned at the plug; a taxel that feels
nothing) is looked for with presses; orbs without a fault are pressed, too.
"""

from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from typing import Any, Final

import numpy as np

from controller.cli import doctor
from controller.diagnostics import measurements, wiring_checks
from controller.diagnostics.report import Row, Verdict
from controller.sensors.geometry import RATE_HZ
from controller.sensors.hardware.emulated.circuit import KINDS
from controller.simulator.orb import PRESETS, preset

from .results import Results, command_line
from .wired import COLUMNS, ROWS, Wired

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
    "low_reference": "reference", "grounded_row": "stuck_row", "grounded_column": "stuck_column",
    "no_bleed": "bleed",
}  # fmt: skip
_PLACES: Final = {
    "taxel": (ROWS, COLUMNS), "row": (ROWS,), "rows": (ROWS - 1,), "column": (COLUMNS,),
    "columns": (COLUMNS - 1,), "": (),
}  # fmt: skip
SLOW_HZ: Final = 2.0  # where nobody presses, so that less is emulated
_FAMILY: Final = 5_000_000  # of seeds
_HEALTHY: Final = 1_000_000


def draw(kind: str, name: str, seed: int) -> tuple[str, dict[str, Any]]:
    """Return a fault of this kind as the bench takes it, and what else is done to the sensor."""
    rng = np.random.default_rng([_FAMILY, seed])
    if kind == "turned":
        return "", {"turned": True}
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
