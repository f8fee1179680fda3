"""The command line: read what the user asks for, and run the loop."""

import json
import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext, suppress
from importlib import import_module
from itertools import count
from typing import Final

from controller.bundle import BundleError
from controller.device import Device
from controller.ends import Ends, complain, signals
from controller.key import KeyFileError
from controller.labelling.terminal import Keyboard, keyboard
from controller.links import LinkError
from controller.links.stdout import let_go
from controller.loop import ORPHAN_S, Loop
from controller.mapping import MappingError
from controller.options import PRINT, parser
from controller.parts import Parts, open_device, prepare, renew
from controller.parts import clerk as parts_clerk
from controller.quiet import Sweeper, real_time
from controller.recordings.recording import RecordingError
from controller.sensors import SensorError
from controller.service.notify import Heart
from controller.vocabulary import VocabularyError

MISTAKES: Final = (
    BundleError, MappingError, RecordingError, SensorError, VocabularyError, LinkError, KeyFileError
)  # fmt: skip
# What has a command line of its own: its module, whose `main` runs it.
COMMANDS: Final = {
    "install": "controller.shelf.install",
    "key": "controller.key",
    "models": "controller.shelf.models",
    "recordings": "controller.recordings.command",
    "rollback": "controller.shelf.rollback",
    "teach": "controller.teaching.command",
    "pair": "controller.bluetooth.pair",
    "service": "controller.service.unit",
    "status": "controller.service.status",
    "doctor": "controller.doctor.command",
    "calibrate": "controller.calibrate",
}

_log = logging.getLogger("controller")


def main(argv: Sequence[str] | None = None) -> int:
    """Run `controller` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    words = sys.argv[1:] if argv is None else list(argv)
    if words[:1] and words[0] in COMMANDS:
        status: int = import_module(COMMANDS[words[0]]).main(words[1:])
        return status
    options = parser().parse_args(words)
    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    with signals() as ends:
        try:
            parts = prepare(options)
        except MISTAKES as error:
            return complain(error, 2)
        if parts.owned:
            threading.Thread(target=_watch_host, args=(ends,), name="owner", daemon=True).start()
        try:
            with keyboard() if parts.runs is not None else nullcontext() as keys:
                _run(parts, ends, keys)
        except (RecordingError, SensorError, LinkError) as error:
            return complain(error, 1)
        finally:
            parts.link.close()
        problem: str = getattr(parts.link, "problem", "")
        return complain(problem, 1) if problem else 0


def _run(parts: Parts, ends: Ends, keyboard: Keyboard | None) -> None:
    """Run until stopped, or until a recording ends or is complete."""
    printing, replaying = parts.options.link == PRINT, parts.options.replay is not None
    if url := getattr(parts.link, "url", None):
        _announce(url)
    if printing and replaying:
        _replay(open_device(parts, 1), lambda: bool(ends))
        return
    if parts.options.realtime:
        real_time()
    heart = Heart()
    heart.ready()
    parts.sweeper = sweeper = Sweeper()
    try:
        while _sessions(parts, ends, keyboard, heart):
            ends.renew = False
            try:
                parts = renew(parts)
            except MISTAKES as error:
                _log.error("going on as before: %s", error)
    finally:
        heart.stopping()
        sweeper.close()
        if parts.ledger is not None:
            parts.ledger.close()


def _sessions(parts: Parts, ends: Ends, keyboard: Keyboard | None, heart: Heart) -> bool:
    """Run with these parts; return whether to go on with new ones."""
    printing, replaying = parts.options.link == PRINT, parts.options.replay is not None
    sessions = count(1)
    clerk = parts_clerk(parts)
    loop = Loop(
        parts.link,
        lambda: open_device(parts, next(sessions), keyboard),
        time.monotonic,
        # What is simulated or recorded has no time of its own: it begins when somebody looks.
        await_host=not printing and (parts.sensor.virtual or replaying),
        orphan_s=ORPHAN_S if parts.owned else None,
        clerk=clerk,
    )

    def over() -> bool:
        """Show systemd that the loop turns; say whether it shall go on."""
        heart.beat()
        heart.tell(_state(parts))
        # Whoever read the lines has gone (`controller | head`): that is an end as well.
        return bool(ends) or ends.renew or (printing and not parts.link.connected)

    loop.run(over)
    if loop.missed:
        _log.info("%d frames were missed; is the machine too busy?", loop.missed)
    return not ends and (ends.renew or (clerk is not None and clerk.switched))


def _state(parts: Parts) -> str:
    """Return how the link is, in a line."""
    if parts.link.connected:
        return "a host is connected"
    ready: str = getattr(parts.link, "state", "ready")
    where: str = getattr(parts.link, "url", parts.options.link)
    return f"waiting for a host at {where}" if ready == "ready" else ready


def _announce(url: str) -> None:
    """Print where a host finds us, the first line of all."""
    try:
        print(json.dumps({"listening": url}), flush=True)
    except OSError as error:
        let_go(sys.stdout)
        raise LinkError(f"cannot print where this orb listens: {error.strerror}") from None


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


if __name__ == "__main__":
    sys.exit(main())
