"""`controller calibrate`: take the rest image with care, judge it, and keep it."""

import argparse
import logging
import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace

import numpy as np

from controller.bundles import bundle
from controller.diagnostics import calibration
from controller.diagnostics.calibration import CALIBRATION_S, DEPTHS_MM, PRESSING_S
from controller.diagnostics.frame_source import FrameReader
from controller.diagnostics.report import Verdict, table
from controller.sensors import base as sensors
from controller.sensors import calibration_store
from controller.sensors.geometry import SensorError
from controller.shared.arguments import Parser, number


def main(argv: Sequence[str]) -> int:
    """Run `controller calibrate`; exit status 0: kept, 1: not kept, 2: wrong usage."""
    options = _parser().parse_args(argv)
    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    if options.forget:
        with closing(sensors.load(options.sensor)) as sensor:
            there = calibration_store.forget(sensor.device_id)
            print(f"{sensor.device_id}: {'forgotten' if there else 'nothing was kept'}")
        return 0
    loaded = None if options.depth is None else bundle.read(bundle.default_path())
    rate_hz = None if loaded is None else loaded.rate_hz
    with closing(sensors.load(options.sensor, rate_hz)) as sensor:
        if not sensor.signal.ratio:
            raise SensorError(
                f"{sensor.device_id} is no skin in pF that a touch lowers, and needs no "
                "calibration; run: controller doctor"
            )
        if loaded is not None:
            calibration.refuse_other(loaded, sensor.geometry.rows, sensor.geometry.columns)
        if not sensor.virtual:
            print(f"hands off the orb for {CALIBRATION_S:.0f} seconds ...", file=sys.stderr)
        reader = FrameReader(sensor)
        frames = reader.frames(CALIBRATION_S)
        rows, kept = calibration.keep(sensor, frames)
        if kept is not None and loaded is not None:
            print(
                f"now press {options.depth:g} mm deep, with one finger, in ten places, and hold "
                f"each for a second; you have {PRESSING_S:.0f} seconds ...",
                file=sys.stderr,
            )
            pressed = np.concatenate([frames, reader.frames(PRESSING_S)])
            row, factor = calibration.calibrate_depth(loaded, pressed, options.depth)
            rows.append(row)
            last = calibration_store.load(sensor.device_id)
            if factor is not None and last is not None:
                calibration_store.save(sensor.device_id, replace(last, depth=factor))
    sound = all(row.verdict is Verdict.GOOD for row in rows)
    verdict = "failed" if kept is None else "good" if sound else "doubtful"
    print(table(rows))
    print(f"calibration: {verdict}" + (f", kept in {kept}" if kept else ""))
    return 0 if kept else 1


def _parser() -> argparse.ArgumentParser:
    grammar = Parser(
        prog="controller calibrate",
        description="Take the rest image of the untouched orb for ten seconds, judge it, and keep "
        "it: the controller then begins sooner, and notices a finger that is there from the start. "
        "Exit status 0: kept; 1: refused.",
        epilog="Try it without hardware: controller calibrate --sensor virtual",
        formatter_class=lambda prog: argparse.HelpFormatter(prog, max_help_position=18),
    )
    add = grammar.add_argument
    sensors.add_option(grammar, "which")
    text = "remove what is kept of this sensor instead"
    add("--forget", action="store_true", help=text)
    text = (
        "then measure presses of this depth, 2 to 15 mm, for a minute: estimated depths are right"
    )
    add("--depth", type=number(*DEPTHS_MM), metavar="MM", help=text)
    return grammar
