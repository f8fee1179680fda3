"""`controller install`: test a bundle on this device and take it into use."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from controller.bundles.deploy.install import install
from controller.bundles.deploy.store import BundleStore
from controller.errors import TROUBLE, complain, printable, reason, run


def main(argv: Sequence[str]) -> int:
    """Run `controller install` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    return run("controller", lambda: _install(argv))


def _install(argv: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(
        prog="controller install",
        description="Test a bundle on this device and take it into use: its hash, its golden "
        "vectors, and the time of a control step with each engine. The faster engine is used. The "
        "bundle before is kept for `controller rollback`.",
    )
    parser.add_argument("file", metavar="FILE", type=Path, help="a bundle, NAME.orb")
    parser.add_argument(
        "--other-sensor",
        action="store_true",
        help="allow another grid, pitch or rate than the bundle in use has",
    )
    options = parser.parse_args(argv)
    try:
        done = install(
            options.file, BundleStore(), other_sensor=options.other_sensor, report=_report
        )
    except OSError as error:
        return complain("controller", f"the bundle cannot be kept: {reason(error)}", TROUBLE)
    _report(done)
    return 0


def _report(line: str) -> None:
    print(printable(line))
