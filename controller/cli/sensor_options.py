"""Options that choose and simulate a sensor, alike in all commands that read one."""

import argparse
import math
import re
from pathlib import Path

from controller.arguments import whole
from controller.sensors import base as sensors
from controller.sensors.base import Sensor
from controller.sensors.geometry import SensorError

PRESETS = ("nominal", "paper-snr")  # names only: to import the simulator takes longer than a start


def add_sensor(grammar: argparse.ArgumentParser, sensor: str) -> None:
    """Add --sensor, whose help begins with `sensor`, --wiring, --seed, --preset and --fault."""
    # fmt: off
    add = grammar.add_argument
    add("--sensor", metavar="NAME[:KEY=VALUE,...]", default="virtual",
        help=f"{sensor}: {', '.join(sensors.names())}, with options of its own (default: virtual)")
    add("--wiring", metavar="FILE", type=Path,
        help="description of the sensor: docs/sensors.md; of a real or emulated orb what hangs on "
        "which pin (default: as docs/hardware.md draws it)")
    add("--seed", metavar="N", type=whole(0, 2**32 - 1), default=1,
        help="which orb and hand are simulated, 0 or more (default: 1)")
    add("--preset", metavar="NAME", default="nominal",
        help=f"the virtual orb's quality: {', '.join(PRESETS)} (default: nominal)")
    add("--fault", metavar="FAULT", action="append", default=[],
        help="break the virtual orb, as often as you like: dead:ROW,COLUMN, open_row:ROW, "
        "air_leak ...: docs/simulator.md; with --sensor emulated its wiring, too: docs/hardware.md")
    # fmt: on


def load_skin(options: argparse.Namespace) -> Sensor:
    """Return the sensor as `load` does; SensorError if it does not read as the orb's skin does."""
    sensor = load(options)
    if not sensor.signal.ratio:
        sensor.close()
        raise SensorError(
            f"{sensor.device_id} is no skin in pF that a touch lowers, and needs no calibration; "
            "run: controller sensors"
        )
    return sensor


def load(options: argparse.Namespace) -> Sensor:
    """Return the sensor that `add_sensor`'s options choose, or raise SensorError."""
    return sensors.load(
        options.sensor, seed=options.seed, preset=options.preset, fault=tuple(options.fault),
        wiring=options.wiring,
    )  # fmt: skip


def hand_of(words: str) -> tuple[str, str]:
    """Return the user and the day, if there is one, of NAME or NAME:DAY."""
    if not re.fullmatch("[A-Za-z0-9]+(:[A-Za-z0-9]+)?", words):
        expected = "a NAME of letters and digits, or NAME:DAY"
        raise argparse.ArgumentTypeError(f"{words!r} must be {expected}")
    name, _, day = words.partition(":")
    return name, day


def rate(words: str) -> float:
    """Return a rate in hertz, above 0, or raise ArgumentTypeError."""
    try:
        value = float(words)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError(f"{words} must be a number above 0, in hertz")
    return value
