"""`controller sensors`: list them, or try one and describe it."""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from controller.diagnostics.frame_source import FrameReader, VirtualFinger
from controller.diagnostics.report import faulty, table
from controller.diagnostics.sensor_trial import Trial, examine
from controller.recognition.images.scale import PICOFARAD
from controller.sensors import base as sensors
from controller.sensors.geometry import SensorError
from controller.sensors.hardware.description import Description
from controller.shared import plugins
from controller.shared.aliases import Frames
from controller.shared.arguments import Parser
from controller.shared.errors import TROUBLE
from controller.shared.files import atomic_write

REST_S: Final = 6.0
TOUCHED_S: Final = 12.0


def main(
    argv: Sequence[str],
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> int:
    """Run `controller sensors`; exit status 0: success, 1: trouble, 2: wrong usage."""
    options = _parser().parse_args(argv)
    if options.sensor is None:
        _list()
        return 0
    if options.out is not None and options.out.exists():
        raise SensorError(f"{options.out} is there already; name another file with --out")
    with closing(sensors.load(options.sensor)) as sensor:
        if options.out is not None and sensor.description is None:
            raise SensorError(f"--out is for sensors with a description; {options.sensor} has none")
        trial = _try(FrameReader(sensor, clock=clock, sleep=sleep))
        print(table(trial.rows))
        if sensor.description is not None and options.out is not None:
            _write(options.out, sensor.description, sensor.signal.unit, trial)
    return TROUBLE if faulty(trial.rows) else 0


def _list() -> None:
    """Print all sensors with their purposes; a part of another package is not imported."""
    others = plugins.packages("sensors")
    for name in sorted({*others, *sensors.names()}):
        if name in sensors.names():
            purpose = (sensors.module_of(name).__doc__ or "").partition("\n")[0]
        else:
            purpose = f"Of the package {others[name]}."
        print(f"{name:12}  {purpose}")


def _try(watch: FrameReader) -> Trial:
    """Return what a sensor does at rest, and while it is touched."""
    sensor, known = watch.sensor, watch.sensor.description
    say(f"hands off the sensor for {REST_S:g} seconds ...")
    rest = watch.frames(REST_S)
    say(f"now touch every taxel firmly, one after the other, for {TOUCHED_S:g} seconds ...")
    touched = _presses(watch) if sensor.virtual else watch.frames(TOUCHED_S)
    rate_hz = known.rate_hz if known is not None and known.rate_hz else sensor.rate_hz
    return examine(rest, touched, rate_hz, sensor.signal.unit)


def _presses(watch: FrameReader) -> Frames:
    """Return a frame of a press on each taxel of a virtual orb, (n, rows, columns)."""
    finger, frames = VirtualFinger(watch), []
    for place in np.ndindex(watch.sensor.geometry.rows, watch.sensor.geometry.columns):
        finger.press(place)
        frames.append(watch.frames(0.0)[0])
        finger.lift()
    return np.array(frames)


def _write(path: Path, known: Description, unit: str, trial: Trial) -> None:
    """Write the description of a sensor as it was seen, or raise SensorError without a touch."""
    if trial.sign is None:
        raise SensorError("no description is written, as no touch was seen (docs/sensors.md)")
    unit = "counts" if trial.at_zero and unit == PICOFARAD else unit
    seen = replace(known, unit=unit, sign=trial.sign, scale=trial.scale)
    atomic_write(path, seen.text().encode())
    say(f"written: {path}")


def say(line: str) -> None:
    """Print a message: to standard error, because results go to standard output."""
    print(line, file=sys.stderr, flush=True)


def _parser() -> argparse.ArgumentParser:
    grammar = Parser(
        prog="controller sensors",
        description="List the sensors, those of other packages included. With a name, read that "
        "sensor at rest, then while every taxel is touched: rate, range, rest, sign and noise, and "
        "which taxels move. Exit status 1: no touch was seen, or a taxel does not answer.",
        epilog="Try it: controller sensors virtual",
    )
    add = grammar.add_argument
    text = "which to try, such as lines:port=/dev/ttyACM0 or lines:wiring=FILE, its description"
    add("sensor", metavar="NAME[:KEY=VALUE,...]", nargs="?", help=text)
    add("--out", metavar="FILE", type=Path, help="write the description, with what was found")
    return grammar
