"""`controller install`: prove a bundle on this device and take it into use."""

import argparse
import hashlib
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle, BundleError
from controller.bundles.deploy import selftest
from controller.bundles.deploy.record_words import about, called, sensor
from controller.bundles.deploy.store import BundleStore, StoredBundle, name_of
from controller.console import TROUBLE, complain, printable, run
from controller.errors import reason
from controller.protocol import codec, messages, packets


class TooSlowError(BundleError):
    """The bundle is good, and this device too slow for it."""


def main(argv: Sequence[str]) -> int:
    """Run `controller install` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    return run("controller", lambda: _install(argv))


def _install(argv: Sequence[str]) -> int:
    grammar = argparse.ArgumentParser(
        prog="controller install",
        description="Prove a bundle on this device and take it into use: its hash, its golden "
        "answers, and the time of a control step with each engine, of which the faster one is "
        "kept, or, where both are as fast, the one that starts sooner. The bundle of before stays "
        "for `controller rollback`.",
    )
    grammar.add_argument("file", metavar="FILE", type=Path, help="a bundle, NAME.orb")
    grammar.add_argument(
        "--other-sensor",
        action="store_true",
        help="allow another grid, pitch or rate than the bundle in use has",
    )
    options = grammar.parse_args(argv)
    try:
        told = install(options.file, BundleStore(), other_sensor=options.other_sensor, tell=_tell)
    except TooSlowError as error:
        return complain("controller", error, TROUBLE)
    except OSError as error:
        return complain("controller", f"the bundle cannot be kept: {reason(error)}", TROUBLE)
    _tell(told)
    return 0


def _tell(line: str) -> None:
    print(printable(line))


def install(
    path: Path,
    shelf: BundleStore,
    *,
    other_sensor: bool,
    tell: Callable[[str], object],
    corrects: str | None = None,
) -> str:
    """Prove a bundle and take it into use; return which one is, in a sentence.

    Args:
        path: The bundle.
        shelf: Where it will stand.
        other_sensor: Whether it may be for another grid, pitch or rate than the bundle in use.
        tell: Takes what is found on the way, line by line.
        corrects: The name of the bundle that it is a correction of; None: it is none.

    Raises:
        BundleError: It is damaged, does not fit, or proves to be no good here.
        OSError: It cannot be written; nothing has changed.
    """
    fresh = bundles.read(path)
    check_packets(fresh)
    if not other_sensor:
        check_fits(fresh, bundles.read(shelf.current()[0]))
    tell(f"{path} is whole: {about(fresh)}")
    shown = selftest.prove(path)
    for one in shown:
        tell(f"  {one.engine:12} {one.problem or _timed(one)}")
    best, period_us = shown[0], 1e6 / fresh.rate_hz
    if best.worst_us > period_us:
        raise TooSlowError(
            f"a step takes {best.worst_us / 1000:.1f} ms on this device, longer than the "
            f"{period_us / 1000:.1f} ms from frame to frame; train a smaller network"
        )
    data = path.read_bytes()
    if hashlib.sha256(data).hexdigest() != fresh.hash:
        raise BundleError(f"{path} has changed while it was proved; install it once more")
    entry = StoredBundle(name_of(fresh), best.engine, best.step_us, _now(), corrects)
    record = shelf.install(data, entry)
    back = called(record.previous)
    back = back and f"; `controller rollback` goes back to {back}"
    return f"{entry.name} is in use with {best.engine}{back}"


def check_fits(fresh: Bundle, in_use: Bundle) -> None:
    """Refuse a bundle for another sensor.

    Raises:
        BundleError: Its grid, its pitch or its rate is another than that of the bundle in use.
    """
    ours = (in_use.rows, in_use.columns, in_use.rate_hz)
    pitch = fresh.pitch_mm != in_use.pitch_mm
    if pitch or (fresh.rows, fresh.columns, fresh.rate_hz) != ours:
        raise BundleError(
            f"the bundle is for {sensor(fresh, pitch=pitch)}, and this device has "
            f"{sensor(in_use, pitch=pitch)}; `controller install --other-sensor` takes it all the "
            "same"
        )


def check_packets(fresh: Bundle) -> None:
    """Refuse a bundle whose labels and commands the link cannot carry.

    Raises:
        BundleError: They do not fit in a packet, at the longest of what else is in it.
    """
    name, labels, grid = "-" * messages.MAX_TEXT, fresh.labels, (fresh.rows, fresh.columns)
    commands = fresh.users.commands(fresh.mapping)
    welcome = messages.Welcome(
        messages.VERSION, 0, name, name, False, *grid, 1.0, 1.0, 1, 1, labels, commands
    )
    image, shares = bytes(fresh.rows * fresh.columns), (0.0,) * len(labels)
    telemetry = messages.Telemetry(0, image, shares, (0.0, 0.0), max(labels, key=len), True, 1.0)
    try:
        for message in (welcome, telemetry):
            packets.encode(message, session=0, sequence=0, t_ms=0)
    except codec.ProtocolError as error:
        raise BundleError(f"{error}; use fewer or shorter labels and commands") from None


def _timed(proof: selftest.SelfTestResult) -> str:
    worst = f"{proof.worst_us:.0f} µs at most in 99 of 100"
    return f"{proof.step_us:6.0f} µs a step, {worst}; {proof.start_ms:.0f} ms to start"


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
