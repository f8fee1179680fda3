"""`controller sensors`: list them; `controller sensors try`: look at one, and describe it."""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np

from controller import plugins
from controller.aliases import Frames
from controller.arguments import Parser
from controller.cli.sensor_options import load
from controller.diagnostics.frame_source import FrameReader, VirtualFinger
from controller.diagnostics.report import faulty, table
from controller.diagnostics.sensor_trial import Trial, examine
from controller.errors import TROUBLE
from controller.files import atomic_write
from controller.recognition.scale import PICOFARAD
from controller.sensors import base as sensors
from controller.sensors.geometry import SensorError
from controller.sensors.hardware.description import Description


def main(
    argv: Sequence[str],
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> int:
    """Run `controller sensors`; exit status 0: success, 1: trouble, 2: wrong usage."""
    options = _parser().parse_args(argv)
    if options.command is None:
        others = plugins.packages("sensors")
        for name in sorted({*others, *sensors.names()}):
            if name in sensors.names():
                purpose = (sensors.module_of(name).__doc__ or "").partition("\n")[0]
            else:
                purpose = f"Of the package {others[name]}."
            print(f"{name:12}  {purpose}")
        return 0
    if options.out is not None and options.out.exists():
        raise SensorError(f"{options.out} is there already; name another file with --out")
    with closing(load(options)) as sensor:
        if options.out is not None and sensor.description is None:
            raise SensorError(f"--out is for sensors with a description; {options.sensor} has none")
        trial = _try(
            FrameReader(sensor, clock=clock, sleep=sleep), min(max(1.0, options.seconds), 600.0)
        )
        print(table(trial.rows))
        if sensor.description is not None and options.out is not None:
            _write(options.out, sensor.description, sensor.signal.unit, trial)
    return TROUBLE if faulty(trial.rows) else 0


def _try(watch: FrameReader, seconds: float) -> Trial:
    """Return what a sensor does at rest, and while it is touched."""
    sensor, known = watch.sensor, watch.sensor.description
    say(f"hands off the sensor for {seconds:g} seconds ...")
    rest = watch.frames(seconds)
    say(f"now touch every taxel firmly, one after the other, for {2 * seconds:g} seconds ...")
    touched = _presses(watch) if sensor.virtual else watch.frames(2 * seconds)
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
        description="List the sensors, those of other packages included; or try one.",
        epilog="Try it: controller sensors try virtual",
    )
    group = grammar.add_subparsers(dest="command", metavar="try")
    trial = group.add_parser(
        "try",
        help="show rate, range, rest, sign and noise of a sensor, and which taxels move",
        description="Read a sensor at rest, then while every taxel is touched. Exit status 1: no "
        "touch was seen, or a taxel does not answer.",
    )
    add = trial.add_argument
    add("sensor", metavar="NAME[:KEY=VALUE,...]", help="which, such as lines:port=/dev/ttyACM0")
    add("--wiring", metavar="FILE", type=Path, help="its description (docs/sensors.md)")
    add("--seconds", metavar="S", type=float, default=5.0, help="at rest; touches take twice "
        "as long (default: 5)")  # fmt: skip
    add("--out", metavar="FILE", type=Path, help="write the description, with what was found")
    trial.set_defaults(seed=1, preset="nominal", fault=[])
    return grammar
