"""`controller install`, `rollback` and `models`: which bundle this device uses."""

import argparse
import json
import sys
import textwrap
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from controller import bundle as bundles
from controller.bundle import Bundle, BundleError
from controller.ends import complain
from controller.links.stdout import let_go
from controller.shelf import proof as proofs
from controller.shelf.shelf import Entry, Record, Shelf, name_of

_SHIPS: Final = "shipped"  # what people call the bundle without a name


def install(argv: Sequence[str]) -> int:
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
        print(f"{options.file} is whole: {_about(fresh)}")
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
    print(f"{entry.name} is in use with {best.engine}{back}{_called(record.previous)}")
    return 0


def check_fits(fresh: Bundle, in_use: Bundle) -> None:
    """Refuse a bundle for another sensor.

    Raises:
        BundleError: Its grid or rate is another than that of the bundle in use.
    """
    ours = (in_use.rows, in_use.columns, in_use.rate_hz)
    if (fresh.rows, fresh.columns, fresh.rate_hz) != ours:
        raise BundleError(
            f"the bundle is for {_sensor(fresh)}, and this device has {_sensor(in_use)}; "
            "--other-sensor installs it all the same"
        )


def rollback(argv: Sequence[str]) -> int:
    """Run `controller rollback` and return its exit status."""
    argparse.ArgumentParser(
        prog="controller rollback",
        description="Take the bundle of before into use; run again, it brings the newer one back.",
    ).parse_args(argv)
    shelf = Shelf()
    try:
        record = shelf.rollback()
    except BundleError as error:
        return complain(error, 1)
    except OSError as error:
        return complain(f"{shelf.folder} cannot be written: {error.strerror}", 1)
    print(f"{_called(record.current)} is in use; {_called(record.previous)} is kept")
    return 0


def models(argv: Sequence[str]) -> int:
    """Run `controller models` and return its exit status."""
    grammar = argparse.ArgumentParser(
        prog="controller models", description="List the bundles of this device with their cards."
    )
    grammar.add_argument("--json", action="store_true", help="for programs, not people")
    options = grammar.parse_args(argv)
    shelf = Shelf()
    try:
        record = shelf.record()
    except BundleError as error:
        return complain(error, 1)
    rows = [_row(shelf, record, name) for name in ("", *(e.name for e in record.entries))]
    lines = [json.dumps(rows)] if options.json else [line for row in rows for line in _lines(row)]
    try:
        print("\n".join(lines), flush=True)
    except BrokenPipeError:  # whoever read the lines has gone: ... | head
        let_go(sys.stdout)
    return 0


def _row(shelf: Shelf, record: Record, name: str) -> dict[str, Any]:
    """Return what is known of one bundle."""
    entry, path = record.entry(name), shelf.path(name)
    row: dict[str, Any] = {
        "name": _called(name),
        "path": str(path),
        "in_use": name == record.current,
        "previous": name == record.previous,
        "engine": entry.engine if entry else "",
        "step_us": entry.step_us if entry else None,
        "installed": entry.installed if entry else "",
        "problem": "",
    }
    try:
        bundle = bundles.read(path)
    except BundleError as error:
        return {**row, "problem": str(error)}
    return {**row, "hash": bundle.hash, "about": _about(bundle), "card": bundle.card}


def _lines(row: dict[str, Any]) -> Iterator[str]:
    """Yield what people are told of one bundle."""
    mark = "in use" if row["in_use"] else "before" if row["previous"] else ""
    yield f"{row['name']:18}  {mark:6}  {row['problem'] or row['about']}"
    if row["installed"]:
        yield f"{'':28}installed {row['installed']}, {row['engine']}, {row['step_us']:.0f} µs"
    for key, value in row.get("card", {}).items():
        yield " " * 28 + textwrap.shorten(f"{key}: {value}", 120, placeholder=" ...")


def _about(bundle: Bundle) -> str:
    return f"{', '.join(bundle.labels[1:])}; for {_sensor(bundle)}"


def _sensor(bundle: Bundle) -> str:
    return f"{bundle.rows}×{bundle.columns} taxels at {bundle.rate_hz:g} Hz"


def _timed(proof: proofs.Proof) -> str:
    return f"{proof.step_us:6.0f} µs a step, {proof.worst_us:.0f} µs at most in 99 of 100"


def _called(name: str | None) -> str:
    return "" if name is None else name or f"the {_SHIPS} bundle"


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
