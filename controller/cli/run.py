"""A plain run: read what the user asks for, and run the loop."""

from __future__ import annotations

import json
import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING

from controller import console
from controller.cli.options import parser
from controller.console import TROUBLE, complain, let_go
from controller.errors import UserError
from controller.links import PRINT, LinkAwayError
from controller.runtime.assemble import Parts, exchange, open_device, prepare, refreshed, renew
from controller.runtime.assemble import clerk as parts_clerk
from controller.runtime.device import Device
from controller.runtime.loop import ORPHAN_S, Loop
from controller.runtime.realtime import IdleCollector, real_time, reserve
from controller.runtime.systemd import WatchdogHeartbeat
from controller.shutdown import ShutdownSignals, signals

if TYPE_CHECKING:
    from controller.keymap.terminal import Keyboard

_log = logging.getLogger("controller")


def main(words: Sequence[str]) -> int:
    """Run the device and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    options = parser().parse_args(words)
    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    with signals() as ends:
        ends.at_once = True
        parts = prepare(options)
        ends.at_once = False
        if parts.owned:
            threading.Thread(target=_watch_host, args=(ends,), name="owner", daemon=True).start()
        try:
            with _keyboard(parts) as keys:
                _run(parts, ends, keys)
        except UserError as error:
            return complain("controller", error, TROUBLE)
        finally:
            parts.link.close()
        problem = parts.link.problem
        return complain("controller", problem, TROUBLE) if problem else 0


def _keyboard(parts: Parts) -> AbstractContextManager[Keyboard | None]:
    """Return the keys, which label what is recorded."""
    if parts.runs is None:
        return nullcontext()
    from controller.keymap.terminal import keyboard

    return keyboard()


def _run(parts: Parts, ends: ShutdownSignals, keyboard: Keyboard | None) -> None:
    """Run until stopped, or until a recording ends or is complete."""
    printing, replaying = parts.options.link == PRINT, parts.options.replay is not None
    if url := parts.link.url:
        _announce(url)
    if printing and replaying:
        _replay(open_device(parts, 1), lambda: bool(ends))
        return
    reserve()
    if parts.options.realtime:
        real_time()
    heart = WatchdogHeartbeat()
    heart.ready()
    sweeper = IdleCollector()
    parts = replace(parts, sweeper=sweeper)
    try:
        while _sessions(parts, ends, keyboard, heart):
            ends.renew = False
            try:
                parts = renew(parts)
            except UserError as error:
                _log.error("going on as before: %s", error)
    finally:
        heart.stopping()
        sweeper.close()
        if parts.ledger is not None:
            from controller.runtime.latency_report import close_ledger

            close_ledger(parts.ledger)


def _sessions(
    parts: Parts, ends: ShutdownSignals, keyboard: Keyboard | None, heart: WatchdogHeartbeat
) -> bool:
    """Run with these parts; return whether to go on with new ones."""
    printing, replaying = parts.options.link == PRINT, parts.options.replay is not None
    sessions = count(1)
    clerk = parts_clerk(parts)

    def exchanged(device: Device) -> bool:
        """Go on with the networks of the bundle now in use, if nothing else has changed."""
        nonlocal parts
        try:
            changed = refreshed(parts)
        except UserError as error:
            _log.error("going on as before: %s", error)
            return True
        if changed is not None:
            parts = changed
            exchange(parts, device)
        return changed is not None

    loop = Loop(
        parts.link,
        lambda: open_device(parts, next(sessions), keyboard),
        time.monotonic,
        # What is simulated or recorded has no time of its own: it begins when somebody looks.
        await_host=not printing and (parts.sensor.virtual or replaying),
        orphan_s=ORPHAN_S if parts.owned else None,
        clerk=clerk,
        exchange=exchanged,
    )

    def over() -> bool:
        """Show systemd that the loop turns; say whether it shall go on."""
        heart.beat()
        heart.tell(_state(parts))
        # Whoever read the lines has gone (`controller | head`): that is an end as well.
        return bool(ends) or ends.renew or (printing and not parts.link.connected)

    loop.run(over)
    if loop.missed:
        missed = console.count(loop.missed, "frame")
        _log.info("missed %s; is the machine too busy?", missed)
    return not ends and (ends.renew or (clerk is not None and clerk.switched))


def _state(parts: Parts) -> str:
    """Return how the link is, in a line."""
    if parts.link.connected:
        return "a host is connected"
    ready, where = parts.link.state, parts.link.url or parts.options.link
    return f"waiting for a host at {where}" if ready == "ready" else ready


def _announce(url: str) -> None:
    """Print where a host finds us, the first line of all."""
    try:
        print(json.dumps({"listening": url}), flush=True)
    except OSError as error:
        let_go(sys.stdout)
        raise LinkAwayError(f"cannot print where this orb listens: {error.strerror}") from None


def _watch_host(ends: list[str]) -> None:
    """Note the host's end: it holds the other end of our standard input, however it dies."""
    with suppress(OSError):
        while os.read(0, 4096):
            pass
    ends.append("the host has gone")


def _replay(device: Device, stopped: Callable[[], bool]) -> None:
    """Take a whole recording through the pipeline, as fast as it can."""
    while device.due is not None and device.link.connected and not stopped():
        device.advance(device.sensor.rate_hz)
    device.close()
