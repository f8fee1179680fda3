"""`controller install`: prove a bundle on this device and take it into use."""

import argparse
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from controller import bundle as bundles
from controller.bundle import Bundle, BundleError
from controller.ends import complain
from controller.shelf import proof as proofs
from controller.shelf.shelf import Entry, Shelf, name_of
from controller.shelf.words import about, called, sensor


def main(argv: Sequence[str]) -> int:
    """Run `controller install` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    grammar = argparse.ArgumentParser(
        prog="controller install",
        description="Prove a bundle on this device and take it into use: its hash, its golden "
        "answers, and the time of a control step with each engine, of which the faster one is "
        "kept. The bundle of before stays for `controller rollback`.",
    )
    grammar.add_argument("file", metavar="FILE", type=Path, help="a bundle, NAME.orb")
    grammar.add_argument(
        "--other-sensor",
        action="store_true",
        help="allow another grid or rate than the bundle in use has",
    )
    options = grammar.parse_args(argv)
    shelf = Shelf()
    try:
        fresh = bundles.read(options.file)
        in_use = bundles.read(shelf.current()[0])
        if not options.other_sensor:
            check_fits(fresh, in_use)
        print(f"{options.file} is whole: {about(fresh)}")
        shown = proofs.prove(options.file)
    except BundleError as error:
        return complain(error, 2)
    for one in shown:
        print(f"  {one.engine:12} {one.problem or _timed(one)}")
    best = shown[0]
    period_us = 1e6 / fresh.rate_hz
    if best.worst_us > period_us:
        return complain(
            f"a step takes {best.worst_us / 1000:.1f} ms on this device, longer than the "
            f"{period_us / 1000:.1f} ms from frame to frame; train a smaller network",
            1,
        )
    entry = Entry(name_of(fresh), best.engine, best.step_us, _now())
    try:
        record = shelf.install(options.file.read_bytes(), entry)
    except BundleError as error:
        return complain(error, 1)
    except OSError as error:
        return complain(f"{shelf.folder} cannot be written: {error.strerror}", 1)
    back = "" if record.previous is None else "; `controller rollback` goes back to "
    print(f"{entry.name} is in use with {best.engine}{back}{called(record.previous)}")
    return 0


def check_fits(fresh: Bundle, in_use: Bundle) -> None:
    """Refuse a bundle for another sensor.

    Raises:
        BundleError: Its grid or rate is another than that of the bundle in use.
    """
    ours = (in_use.rows, in_use.columns, in_use.rate_hz)
    if (fresh.rows, fresh.columns, fresh.rate_hz) != ours:
        raise BundleError(
            f"the bundle is for {sensor(fresh)}, and this device has {sensor(in_use)}; "
            "--other-sensor installs it all the same"
        )


def _timed(proof: proofs.Proof) -> str:
    return f"{proof.step_us:6.0f} µs a step, {proof.worst_us:.0f} µs at most in 99 of 100"


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
