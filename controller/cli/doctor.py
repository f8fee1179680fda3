"""`controller doctor`: check computer, wiring, sensor and Bluetooth; print a table with advice."""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import asdict, replace
from pathlib import Path
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.diagnostics import measurements, sensor_trial, system_checks, wiring_checks
from controller.diagnostics.frame_source import Finger, FrameReader, VirtualFinger
from controller.diagnostics.report import Row, Verdict, faulty, table
from controller.diagnostics.skin_checks import skin_rows
from controller.recognition.images.scale import PICOFARAD
from controller.sensors import base as sensors
from controller.sensors.base import Sensor
from controller.sensors.geometry import RATE_HZ, SensorError
from controller.shared import files
from controller.shared.arguments import Parser
from controller.shared.errors import say

REAL: Final = "orb"  # the sensor whose board can be measured although it gives no frames
REST_S: Final = 6.0  # of a trial, then
TOUCHED_S: Final = 12.0


def main(argv: Sequence[str]) -> int:
    """Run `controller doctor` and return its exit status: 0 sound, 1 faults, 2 wrong usage."""
    options = _parser().parse_args(argv)
    sensors.module_of(options.sensor)  # a wrong name is refused before anything is measured
    if options.out is not None and options.out.exists():
        raise SensorError(f"{options.out} is there already; name another file with --out")
    rows = list(examine(options.sensor, options.out, bluetooth=options.bluetooth))
    if options.json:
        plain = {"healthy": not faulty(rows), "rows": [asdict(row) for row in rows]}
        print(json.dumps(plain, ensure_ascii=False))
    else:
        print(table(rows))
    return 1 if faulty(rows) else 0


def _parser() -> argparse.ArgumentParser:
    grammar = Parser(
        prog="controller doctor",
        description="Look at computer, wiring and skin, and say what is wrong and what to "
        "do. A sensor of another kind than the orb's skin is read at rest, then while every taxel "
        "is touched: rate, range, rest, sign and noise, and which taxels move. Exit status 0: "
        "sound; 1: faults found.",
        epilog="Try it without hardware: controller doctor --sensor virtual:fault=open_row:1",
        formatter_class=lambda prog: argparse.HelpFormatter(prog, max_help_position=18),
    )
    add = grammar.add_argument
    sensors.add_option(grammar, "what to look at")
    add("--json", action="store_true", help="print one JSON object in place of the table")
    add("--bluetooth", action="store_true", help="look at Bluetooth, too")
    text = "write the description of a sensor of another kind, with what was found"
    add("--out", metavar="FILE", type=Path, help=text)
    return grammar


def examine(
    spec: str = "virtual", out: Path | None = None, *, bluetooth: bool = False
) -> Iterator[Row]:
    """Yield all rows on a sensor, NAME:KEY=VALUE,..., and Bluetooth; SensorError if there is none.

    The description of a sensor that has one is written to `out`.
    """
    yield system_checks.runtime(bundles.default_path())
    yield system_checks.disk(files.state_folder())
    if bluetooth:
        from controller.diagnostics.bluetooth import rows

        yield from rows()
    try:
        sensor = sensors.load(spec)
    except SensorError as error:
        if spec.partition(":")[0] != REAL:
            raise
        yield Row("sensor", Verdict.FAULT, str(error), "See orbtouch docs hardware.", "sensor")
        yield from _board_alone(spec)
        return
    with closing(sensor):
        if out is None and sensor.signal.ratio:
            yield from sensor_rows(sensor)
        elif out is not None and sensor.description is None:
            raise SensorError(f"--out is for sensors with a description; {spec} has none")
        else:
            yield from _trial_rows(FrameReader(sensor), out)


def _board_alone(spec: str) -> Iterator[Row]:
    """Yield what can be measured on a board on which no orb answers."""
    from controller.sensors.hardware.raspberry_pi import open_board
    from controller.sensors.hardware.wiring import read
    from controller.sensors.orb import Options

    options = sensors.options(spec)
    try:
        board = open_board(read(options.wiring if isinstance(options, Options) else None))
    except SensorError:
        return  # the sensor cannot be opened, which another row reports
    with closing(board):
        yield from wiring_checks.judge(measurements.measure(board))


def _trial_rows(watch: FrameReader, out: Path | None) -> Iterator[Row]:
    """Yield what any sensor does at rest and under touches; write its description to `out`."""
    sensor, known = watch.sensor, watch.sensor.description
    say(f"hands off the sensor for {REST_S:g} seconds ...")
    rest = watch.frames(REST_S)
    say(f"now touch every taxel firmly, one after the other, for {TOUCHED_S:g} seconds ...")
    rate_hz = known.rate_hz if known is not None and known.rate_hz else sensor.rate_hz
    unit = sensor.signal.unit
    trial = sensor_trial.examine(rest, watch.frames(TOUCHED_S), rate_hz, unit)
    yield from trial.rows
    if out is None or known is None:
        return
    if trial.sign is None:
        say("no description is written, as no touch was seen (orbtouch docs sensors)")
        return
    unit = "counts" if trial.at_zero and unit == PICOFARAD else unit
    seen = replace(known, unit=unit, sign=trial.sign, scale=trial.scale)
    files.atomic_write(out, seen.text().encode())
    say(f"written: {out}")


def _find_hand(watch: FrameReader) -> Finger | None:
    """Return what can press this sensor, or None."""
    if watch.sensor.virtual:
        return VirtualFinger(watch)
    return Finger() if sys.stdin is not None and sys.stdin.isatty() else None


def sensor_rows(sensor: Sensor) -> Iterator[Row]:
    """Yield what measurements, rest and touches say."""
    driver, grid = sensor.driver, sensor.geometry
    bad = np.zeros((grid.rows, grid.columns), dtype=np.bool_)
    if driver is not None:
        measured = measurements.measure(driver.board)
        if isinstance(measured, Row):
            yield measured  # and nothing else can be read
            return
        found = wiring_checks.WiringChecks(measured)
        yield from found.faults
        yield from found.sound()
        if bundles.SLOW_HZ <= sensor.rate_hz < RATE_HZ:
            words = (
                f"takes {1e3 * measured.scan_s:.0f} ms, so frames come at {sensor.rate_hz:g} Hz "
                f"instead of {RATE_HZ:g}"
            )
            advice = 'Shorten [times] of the wiring, or scan with scheme = "column".'
            yield Row("scan", Verdict.DOUBTFUL, words, advice, "slow")
        bad |= found.bad
    watch = FrameReader(sensor)
    try:
        yield from skin_rows(watch, bad, _find_hand)
        if driver is not None and driver.pump is not None and driver.pressure_kpa is not None:
            if problem := driver.pump.problem:
                yield Row("pump", Verdict.FAULT, problem, "Look at pump and hose.", "pump")
            else:
                yield Row("pump", Verdict.GOOD, f"{driver.pressure_kpa:.2f} kPa")
    except SensorError as error:
        yield Row("sensor", Verdict.FAULT, str(error), "See orbtouch docs hardware.", "sensor")
