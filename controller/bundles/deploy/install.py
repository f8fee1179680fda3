"""Install a bundle: test it on this device and take it into use."""

import hashlib
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.container import BundleError
from controller.bundles.deploy import selftest
from controller.bundles.deploy.store import (
    BundleStore,
    StoredBundle,
    name_of,
    sensor_summary,
    summary,
)
from controller.shared.protocol import codec, messages, packets


class TooSlowError(BundleError):
    """The bundle is valid, but a step takes longer than a frame on this device."""

    status = 1


def install(
    path: Path,
    store: BundleStore,
    *,
    other_sensor: bool,
    report: Callable[[str], object],
    corrects: str | None = None,
) -> str:
    """Test a bundle and take it into use; return a sentence that names the one in use.

    With `other_sensor` another grid, pitch or rate is accepted; `corrects` names the bundle in use
    that it is a change of, and then it is tested for less time; lines of intermediate results are
    reported.

    Raises:
        BundleError: It is damaged, does not fit, or fails its self-test.
        OSError: It cannot be written; nothing has changed.
    """
    new = bundles.read(path)
    check_packets(new)
    if not other_sensor:
        check_fits(new, _in_use(store, new.rate_hz))
    report(f"{path} is whole: {summary(new)}")
    result = selftest.run(path, selftest.BLOCKS if corrects is None else selftest.FEW_BLOCKS)
    report(f"  {result.step_us:.0f} µs a step, {result.worst_us:.0f} µs at most in 99 of 100")
    period_us = 1e6 / new.rate_hz
    if result.worst_us > period_us:
        raise TooSlowError(
            f"a step takes {result.worst_us / 1000:.1f} ms on this device, longer than the "
            f"{period_us / 1000:.1f} ms from frame to frame; train a smaller network"
        )
    data = path.read_bytes()
    if hashlib.sha256(data).hexdigest() != new.hash:
        raise BundleError(f"{path} has changed while it was tested; install it once more")
    now = datetime.now(UTC).isoformat(timespec="seconds")
    entry = StoredBundle(name_of(new), round(result.step_us, 1), now, corrects)
    before = store.install(data, entry).previous
    back = "" if before is None else f"; `controller install {before or 'shipped'}` goes back"
    return f"{entry.name} is in use{back}"


def _in_use(store: BundleStore, rate_hz: float) -> Bundle:
    """Return the bundle in use; the one that ships if it cannot be read."""
    try:
        return bundles.read(store.current(rate_hz))
    except BundleError:
        return bundles.read(bundles.default_path(rate_hz))


def check_fits(new: Bundle, in_use: Bundle) -> None:
    """Raise BundleError if grid, pitch or rate differ from those of the bundle in use."""
    theirs, ours = sensor_summary(new), sensor_summary(in_use)
    if theirs != ours:
        raise BundleError(
            f"the bundle is for {theirs}, and this device has {ours}; `controller install "
            "--other-sensor` takes it all the same"
        )


def check_packets(new: Bundle) -> None:
    """Raise BundleError if labels and commands do not fit in a packet of the link."""
    name, labels, grid = "-" * messages.MAX_TEXT, new.labels, (new.rows, new.columns)
    commands = new.users.commands(new.mapping)
    welcome = messages.Welcome(
        messages.VERSION, 0, name, name, False, *grid, 1.0, 1.0, 1, 1, labels, commands
    )
    image, shares = bytes(new.rows * new.columns), (0.0,) * len(labels)
    telemetry = messages.Telemetry(0, image, shares, (0.0, 0.0), max(labels, key=len), True, 1.0)
    try:
        for message in (welcome, telemetry):
            packets.encode(message, session=0, sequence=0, t_ms=0)
    except codec.ProtocolError as error:
        raise BundleError(f"{error}; use fewer or shorter labels and commands") from None
