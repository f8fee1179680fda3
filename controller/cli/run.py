"""A plain run: parse and check the options, assemble the parts, and run the loop."""

from __future__ import annotations

import argparse
import gc
import json
import logging
import os
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from itertools import count
from pathlib import Path

from controller import __version__
from controller.cli import COMMANDS
from controller.links import PRINT
from controller.links.base import LinkAwayError
from controller.runtime.assemble import Parts, RunOptions, open_device, prepare
from controller.runtime.device import Device
from controller.runtime.loop import ORPHAN_S, Handler, Loop, hurry
from controller.runtime.renewal import exchange, renew
from controller.runtime.systemd import WatchdogHeartbeat
from controller.sensors import base as sensors
from controller.shared import errors
from controller.shared.arguments import Parser, number, whole
from controller.shared.errors import TROUBLE, UserError, complain, let_go
from controller.shared.shutdown import Shutdown, signals

_log = logging.getLogger("controller")


def main(words: Sequence[str]) -> int:
    """Run the device and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    options = options_of(words)
    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    with signals(renews=True) as shutdown:
        shutdown.at_once = True
        parts = prepare(options)
        shutdown.at_once, shutdown.close = False, parts.link.close
        if parts.owned:
            threading.Thread(
                target=_watch_host, args=(shutdown,), name="owner", daemon=True
            ).start()
        try:
            _run(parts, shutdown)
        except UserError as error:
            return complain("controller", error, TROUBLE)
        finally:
            parts.link.close()
        problem = parts.link.problem
        return complain("controller", problem, TROUBLE) if problem else 0


def _run(parts: Parts, shutdown: Shutdown) -> None:
    """Run until stopped, or until a recording ends or is complete."""
    printing, replaying = parts.options.link == PRINT, parts.options.replay is not None
    if url := parts.link.url:
        _announce(url)
    if printing and replaying:
        hurry(open_device(parts, 1), lambda: bool(shutdown) or not parts.link.connected)
        return
    watchdog = WatchdogHeartbeat()
    watchdog.ready()
    gc.collect()
    gc.freeze()  # a collection looks at later objects only: 0.1 ms in place of 0.4 s
    try:
        while _sessions(parts, shutdown, watchdog):
            shutdown.renew = False
            try:
                parts = renew(parts)
            except UserError as error:
                _log.error("the change is refused, continuing as before: %s", error)
    finally:
        watchdog.stopping()


def _sessions(parts: Parts, shutdown: Shutdown, watchdog: WatchdogHeartbeat) -> bool:
    """Run with these parts; return whether to continue with new ones."""
    printing, replaying = parts.options.link == PRINT, parts.options.replay is not None
    sessions = count(1)

    def take_up(changed: Parts | None, device: Device) -> None:
        """Have the device take changed parts, or end this run for a new one."""
        nonlocal parts
        if changed is None:
            shutdown.renew = True
        else:
            parts = changed
            exchange(parts, device)

    handlers: Sequence[Handler] = ()
    if not printing:
        from controller.remote import handlers as remote  # only a run with a link imports them

        handlers = remote.handlers(lambda: parts, take_up)
    loop = Loop(
        parts.link,
        lambda: open_device(parts, next(sessions)),
        time.monotonic,
        # A simulation or a replay begins when a host connects.
        await_host=not printing and (parts.sensor.virtual or replaying),
        orphan_s=ORPHAN_S if parts.owned else None,
        handlers=handlers,
    )

    def over() -> bool:
        """Send the watchdog heartbeat; return whether to stop."""
        watchdog.beat()
        watchdog.status(_state(parts))
        # The reader of the lines has closed the pipe, as in `controller | head`.
        shutdown.sealing = parts.runs is not None
        device, end_s = loop.device, parts.options.seconds
        if end_s and device is not None and device.now_s > end_s - 0.5 / device.sensor.rate_hz:
            return True
        return bool(shutdown) or shutdown.renew or (printing and not parts.link.connected)

    loop.run(over)
    if loop.missed:
        missed = errors.count(loop.missed, "frame")
        _log.info("missed %s; is the machine too busy?", missed)
    return not shutdown and shutdown.renew


def _state(parts: Parts) -> str:
    """Return the state of the link in a line."""
    if parts.link.connected:
        return "a host is connected"
    ready, where = parts.link.state, parts.link.url or parts.options.link
    return f"waiting for a host at {where}" if ready == "ready" else ready


def _announce(url: str) -> None:
    """Print the address for hosts as the first line."""
    try:
        print(json.dumps({"listening": url}), flush=True)
    except OSError as error:
        let_go(sys.stdout)
        raise LinkAwayError(f"cannot print where this orb listens: {error.strerror}") from None


def _watch_host(shutdown: list[str]) -> None:
    """Stop when the parent host exits: standard input reaches end of file."""
    with suppress(OSError):
        while os.read(0, 4096):
            pass
    shutdown.append("the host has gone")


# --- options --------------------------------------------------------------------------------------


def _parser() -> argparse.ArgumentParser:
    """Return the command line's parser."""
    options = Parser(
        prog="controller",
        usage="controller [OPTION ...]\n       controller COMMAND [-h] ...",
        description="Recognise gestures on the soft sensor and send them as commands, until Ctrl-C."
        "\n\ncommands:\n"
        + "".join(f"  {name:12}  {purpose}\n" for name, (_, purpose) in COMMANDS.items() if name),
        epilog="Try it without hardware: controller --sensor virtual --link -",
        formatter_class=lambda prog: argparse.RawDescriptionHelpFormatter(
            prog, max_help_position=18
        ),
    )
    add = options.add_argument
    add("--version", action="version", version=f"controller {__version__}")
    sensors.add_option(options, "where frames come from")
    seed = whole(0, 2**32 - 1)
    add("--seed", metavar="N", type=seed, help="which orb and hand are simulated (default: 1)")
    text = "the virtual orb's quality: nominal, paper-snr (default: nominal)"
    add("--preset", metavar="NAME", help=text)
    text = (
        "break the virtual orb, as often as you like: dead:ROW,COLUMN, open_row:ROW, air_leak ...: "
        "orbtouch docs simulator; with --sensor emulated its wiring, too: orbtouch docs hardware"
    )
    add("--fault", metavar="FAULT", action="append", help=text)
    text = (
        "the trained networks and their settings (default: the one that `controller install` took "
        "into use, else the one that ships)"
    )
    add("--bundle", metavar="FILE", type=Path, help=text)
    text = "gestures to commands, in place of the bundle's: orbtouch docs mapping"
    add("--mapping", metavar="FILE", type=Path, help=text)
    text = (
        "destination of commands: - prints, listen://127.0.0.1:PORT waits for a host, rfcomm: "
        "waits for paired ones over Bluetooth (controller pair --help, orbtouch docs bluetooth), "
        "else a serial port or a pyserial URL (default: -)"
    )
    add("--link", metavar="URL", help=text)
    text = (
        "the pre-shared key of this orb and its host, for --link; drawn if there is no such file: "
        "orbtouch docs link"
    )
    add("--key", metavar="FILE", type=Path, help=text)
    text = (
        "record the session into a new .npz file, or into a folder (default: here) as "
        "sub-USER_ses-SESSION_run-01.npz; recordings left unfinished by a crash are recovered"
    )
    add("--record", metavar="PATH", nargs="?", type=Path, const=Path(), help=text)
    text = (
        "the user who touches the sensor, for --record: letters and digits; and the player, if "
        "enrolled (orbtouch docs users; default: as identified)"
    )
    add("--user", metavar="ID", help=text)
    text = "name of the user's session, for --record (default: today's date)"
    add("--session", metavar="ID", default=time.strftime("%Y%m%d"), help=text)
    text = "label of the sensor's label button, for --record, if it has none itself"
    add("--label", metavar="NAME", help=text)
    text = "a recording in place of a sensor: as fast as possible, or, over a link, as recorded"
    add("--replay", metavar="FILE", type=Path, help=text)
    text = "end with the frame of that time, with --record (default: until Ctrl-C)"
    add("--seconds", metavar="S", type=number(1.0), help=text)
    text = "sensor scans per second, within 2 %% of the bundle's (default: the bundle's)"
    add("--rate", metavar="HZ", type=number(0.1, 1000.0), help=text)
    return options


def options_of(words: Sequence[str]) -> RunOptions:
    """Return checked options; raise UserError for a contradictory combination."""
    given = vars(_parser().parse_args(words))
    given["fault"] = given["fault"] and tuple(given["fault"])
    return check(RunOptions(**{name: one for name, one in given.items() if one is not None}))


def check(options: RunOptions) -> RunOptions:
    """Return the options; raise UserError for a contradictory combination."""
    replay, printing = options.replay is not None, options.link == PRINT
    recording, usual = options.record is not None, RunOptions()
    names = ("sensor", "preset", "seed", "fault")
    for_sensor = replay and any(getattr(options, name) != getattr(usual, name) for name in names)
    refused = {
        "a replay is a recording already; leave out --record": replay and recording,
        "a recording has its own rate; leave out --rate": replay and options.rate is not None,
        "a replay has no sensor; leave out --sensor, --preset, --seed, --fault": for_sensor,
        "--key is for hosts; name their link with --link": printing and options.key is not None,
        "--label is for recordings; add --record": not recording and options.label,
        "--seconds is for recordings; add --record": not recording and options.seconds,
    }
    for words, wrong in refused.items():
        if wrong:
            raise UserError(words)
    return options
