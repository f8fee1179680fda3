"""`controller models`, `install` and `rollback`: the bundles of this device."""

import json
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from controller.arguments import Parser
from controller.bundles import bundle as bundles
from controller.bundles.bundle import BundleError
from controller.bundles.deploy import install as installer
from controller.bundles.deploy.store import BundleStore, InstalledRecord, shown_name, summary
from controller.errors import TROUBLE, complain, one_line, printable, reason, run


def models(argv: Sequence[str]) -> int:
    """Run `controller models` and return its exit status."""
    parser = Parser(
        prog="controller models", description="List the bundles of this device with their cards."
    )
    parser.add_argument("--json", action="store_true", help="as JSON, for programs")
    options = parser.parse_args(argv)
    store = BundleStore()
    try:
        record = store.record()
    except BundleError as error:
        return complain("controller", error, TROUBLE)
    rows = [_row(store, record, name) for name in ("", *(e.name for e in record.entries))]
    if options.json:
        print(json.dumps(rows, default=str))  # TOML has times, JSON has none
    else:
        for line in (line for row in rows for line in _lines(row)):
            print(one_line(line))
    return 0


def _row(store: BundleStore, record: InstalledRecord, name: str) -> dict[str, Any]:
    """Return the entries of one bundle."""
    entry, path = record.entry(name), store.path(name)
    row: dict[str, Any] = {
        "name": shown_name(name),
        "path": str(path),
        "in_use": name == record.current,
        "previous": name == record.previous,
        "step_us": entry.step_us if entry else None,
        "installed": entry.installed if entry else "",
        "corrects": shown_name(entry.corrects) if entry else "",
        "problem": "",
    }
    try:
        bundle = bundles.read(path)
    except BundleError as error:
        return {**row, "problem": str(error)}
    return {**row, "hash": bundle.hash, "about": summary(bundle), "card": bundle.card}


def _lines(row: dict[str, Any]) -> Iterator[str]:
    """Yield the lines about one bundle."""
    mark = "in use" if row["in_use"] else "before" if row["previous"] else ""
    yield f"{row['name']:18}  {mark:6}  {row['problem'] or row['about']}"
    if row["installed"]:
        yield f"{'':28}installed {row['installed']}, {row['step_us']:.0f} µs a step"
    if row["corrects"]:
        yield f"{'':28}a correction of {row['corrects']}"
    for key, value in row.get("card", {}).items():
        yield " " * 28 + textwrap.shorten(f"{key}: {value}", 120, placeholder=" ...")


def install(argv: Sequence[str]) -> int:
    """Run `controller install`; return 0: success, 1: trouble, 2: wrong usage."""
    return run("controller", lambda: _install(argv))


def _install(argv: Sequence[str]) -> int:
    parser = Parser(
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
        done = installer.install(
            options.file, BundleStore(), other_sensor=options.other_sensor, report=_report
        )
    except OSError as error:
        return complain("controller", f"the bundle cannot be kept: {reason(error)}", TROUBLE)
    _report(done)
    return 0


def _report(line: str) -> None:
    print(printable(line))


def rollback(argv: Sequence[str]) -> int:
    """Run `controller rollback` and return its exit status."""
    Parser(
        prog="controller rollback",
        description="Take the previous bundle into use; a second rollback restores the newer one.",
    ).parse_args(argv)
    store = BundleStore()
    try:
        record = store.rollback()
    except BundleError as error:
        return complain("controller", error, TROUBLE)
    except OSError as error:
        return complain("controller", f"{store.folder} cannot be written: {reason(error)}", TROUBLE)
    print(f"{shown_name(record.current)} is in use; {shown_name(record.previous)} is kept")
    return 0
