"""`controller calibrate`: take the rest image with care, judge it, and keep it."""

import argparse
import logging
import sys
from collections.abc import Sequence
from contextlib import closing

from controller.diagnostics.calibration import CALIBRATION_S, keep
from controller.diagnostics.frame_source import FrameReader
from controller.diagnostics.report import Verdict, table
from controller.sensors import base as sensors
from controller.sensors import calibration_store
from controller.sensors.geometry import SensorError
from controller.shared.arguments import Parser


def main(argv: Sequence[str]) -> int:
    """Run `controller calibrate`; exit status 0: kept, 1: not kept, 2: wrong usage."""
    options = _parser().parse_args(argv)
    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    if options.forget:
        with closing(sensors.load(options.sensor)) as sensor:
            there = calibration_store.forget(sensor.device_id)
            print(f"{sensor.device_id}: {'forgotten' if there else 'nothing was kept'}")
        return 0
    with closing(sensors.load(options.sensor)) as sensor:
        if not sensor.signal.ratio:
            raise SensorError(
                f"{sensor.device_id} is no skin in pF that a touch lowers, and needs no "
                "calibration; run: controller doctor"
            )
        if not sensor.virtual:
            print(f"hands off the orb for {CALIBRATION_S:.0f} seconds ...", file=sys.stderr)
        frames = FrameReader(sensor).frames(CALIBRATION_S)
        rows, kept = keep(sensor, frames)
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
    return grammar
