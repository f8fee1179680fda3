"""`controller install`: take a bundle into use; without one, list the bundles of this device."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from controller.bundles import bundle as bundles
from controller.bundles.container import BundleError
from controller.bundles.deploy import install as installer
from controller.bundles.deploy.store import BundleStore, InstalledRecord, shown_name, summary
from controller.shared.arguments import Parser
from controller.shared.errors import TroubleError, one_line, printable, reason

SHIPPED: Final = "shipped"  # the word for the bundle that ships
_LEAST: Final = 4  # digits of a hash that name a bundle


def main(argv: Sequence[str]) -> int:
    """Run `controller install`; return 0: success, 1: trouble, 2: wrong usage."""
    parser = Parser(
        prog="controller install",
        description="Test a bundle on this device and take it into use: its hash, its golden "
        "vectors, and the time of a control step. Without a bundle, list those of this device.",
    )
    parser.add_argument(
        "bundle",
        metavar="BUNDLE",
        nargs="?",
        default="",
        help=f"a file, NAME.orb; or the hash of a listed bundle, or {SHIPPED}, to go back to it",
    )
    parser.add_argument(
        "--other-sensor",
        action="store_true",
        help="allow another grid, pitch or rate than the bundle in use has",
    )
    options = parser.parse_args(argv)
    store = BundleStore()
    if not options.bundle:
        record = store.record()
        for name in ("", *(entry.name for entry in record.entries)):
            for line in _lines(store, record, name):
                print(one_line(line))
        return 0
    try:
        print(printable(take(options.bundle, store, other_sensor=options.other_sensor)))
    except OSError as error:
        raise TroubleError(f"{store.folder} cannot be written: {reason(error)}") from None
    return 0


def take(words: str, store: BundleStore, *, other_sensor: bool = False) -> str:
    """Take a file or a stored bundle into use; return a sentence. BundleError, OSError."""
    path = Path(words)
    name = None if path.exists() else _stored(words, store)
    if name is not None:
        return f"{shown_name(store.use(name).current)} is in use"
    return installer.install(
        path, store, other_sensor=other_sensor, report=lambda line: print(printable(line))
    )


def _stored(words: str, store: BundleStore) -> str | None:
    """Return the name of the stored bundle that `words` begin; None if they begin none."""
    if words == SHIPPED:
        return ""
    names = [entry.name for entry in store.record().entries if entry.name.startswith(words)]
    return names[0] if len(words) >= _LEAST and len(names) == 1 else None


def _lines(store: BundleStore, record: InstalledRecord, name: str) -> Iterator[str]:
    """Yield the lines about one bundle."""
    entry, card = record.entry(name), {}
    try:
        bundle = bundles.read(store.path(name))
        about, card = summary(bundle), bundle.card
    except BundleError as error:
        about = str(error)
    mark = "in use" if name == record.current else "before" if name == record.previous else ""
    yield f"{name or SHIPPED:16}  {mark:6}  {about}"
    if entry is not None:
        yield f"{'':26}installed {entry.installed}, {entry.step_us:.0f} µs a step"
        if entry.corrects is not None:
            yield f"{'':26}a correction of {shown_name(entry.corrects)}"
    for line in _card(card):
        yield " " * 26 + line


def _card(card: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line for each entry of a bundle's card."""
    for key, value in card.items():
        yield textwrap.shorten(f"{key}: {value}", 120, placeholder=" ...")
