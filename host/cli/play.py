"""`host` without a verb: find or start an orb, and play."""

import argparse
import json
import logging
import secrets
import sys
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from controller import __version__
from controller.shared import arguments
from controller.shared.protocol import psk
from controller.shared.protocol.link_events import Connected
from controller.shared.shutdown import Shutdown, signals
from host import phone, taps, targets
from host import window_loop as loop
from host.app.application import OrbApp
from host.app.orbs import Orbs
from host.cli import VERBS, add_option, warn
from host.cli._device_defaults import DeviceDefaults, seek
from host.connection.device_store import DeviceStore
from host.connection.latency import EndToEndLatency
from host.connection.receiver import Receiver
from host.connection.transport import open_transport
from host.connection.virtual_orb import VirtualOrbProcess
from host.demo import demo
from host.injection import backends
from host.taps import open_taps
from host.targets import TargetOptions

_DEMO_S = 120.0  # default length of the demo
_USUAL = "tetris"  # the target, if neither the user nor the device's past names one
_UNSEEN = ("keyboard", "gamepad")  # targets that act elsewhere, and have no window


def main(words: list[str]) -> int:
    """Play, and return the exit status: 0 success, 1 trouble, 2 wrong usage."""
    parser = _parser()
    options = parser.parse_args(words)
    if options.orb and "--" not in words:
        parser.error(
            f"{options.orb[0]} stands alone; a port is named with --link {options.orb[0]}, and "
            "options of the virtual orb follow two dashes: host -- --preset paper-snr"
        )
    options.headless |= options.json  # the result is a line, no picture
    _check(parser, options)
    logging.basicConfig(
        format="%(message)s", level=logging.INFO if options.verbose else logging.ERROR
    )
    seed = secrets.randbits(31) if options.seed is None else options.seed
    with signals() as shutdown:
        (_demo if options.demo and options.headless else _play)(options, seed, shutdown)
    return shutdown.status


def _play(options: argparse.Namespace, seed: int, shutdown: Shutdown) -> None:
    """Open the window and the link, and play until the window is closed."""
    memory = DeviceStore(warn=warn)
    with ExitStack() as stack:
        own: VirtualOrbProcess | None = None
        seeker = seek(options, memory)
        key = b"" if options.key is None else psk.read(options.key)
        orb_options = demo.quick(options.orb) if options.demo else options.orb
        at_once = (options.seed is not None or options.seconds is not None) and not options.demo
        wish = TargetOptions(
            seed if at_once else None,
            not options.headless,
            options.mapping,
            options.backend,
            options.profile or "",
            seed if options.demo else None,
        )
        workers = open_taps(options.tap, stack, warn)
        if seeker is not None:
            receiver = Receiver(seeker.open, key=key)
        elif options.link is not None:
            receiver = Receiver(lambda: open_transport(options.link), key=key)
        else:
            own = VirtualOrbProcess(seed, orb_options)
            stack.callback(own.close)
            receiver = Receiver(own.open, token=own.token)
        stack.callback(receiver.close)
        for worker in workers:
            receiver.subscribe(worker.hear)
        target, surface = _open(options, wish)
        stack.callback(_end_phone, target)  # the window may start one, too
        if options.phone is not None:
            _begin_phone(options.phone, target)
        stack.callback(target.close)  # before the receiver, which may take seconds to close
        noted = DeviceDefaults(memory, options, target, seeker)
        stack.callback(noted.close)
        receiver.subscribe(noted.on_received, Connected)
        if isinstance(target, OrbApp):
            target.orbs = orbs = Orbs(
                receiver,
                memory,
                partial(VirtualOrbProcess, seed, orb_options),
                own=own,
                where=lambda: seeker.url if seeker else options.link or "",
                moved=noted.moved,
            )
            stack.callback(orbs.close)
        receiver.start()
        if surface is None:
            loop.serve(target, receiver, shutdown, seconds=options.seconds)
            return
        hops = target.orb.latency = EndToEndLatency(lambda: receiver.clock_offset_ms)
        receiver.subscribe(hops.on_received)
        lasts = options.seconds
        loop.play(target, receiver, surface, shutdown, seconds=lasts, drawn=hops.drawn)


def _open(
    options: argparse.Namespace, wish: TargetOptions
) -> tuple[targets.Target, loop.Surface | None]:
    if options.target == _USUAL:
        surface = loop.window(headless=options.headless)
        return targets.load(_USUAL, wish), surface
    target = targets.load(options.target, wish)
    windowed = target.windowed
    return target, loop.window(headless=options.headless, size=target.size) if windowed else None


def _begin_phone(words: str, target: targets.Target) -> None:
    """Serve the phone's page, and show its code in the window or the terminal."""
    target.phone = phone.open_phone(words)
    if isinstance(target, OrbApp):
        target.show_phone()
    else:
        phone.code(target.phone.url).print_ascii(out=sys.stderr, invert=True)


def _end_phone(target: targets.Target) -> None:
    if target.phone:
        target.phone.close()


def _demo(options: argparse.Namespace, seed: int, shutdown: Shutdown) -> None:
    """Play a demo of some granted time, and print how it went, unless it is ended early."""
    with demo.Demo(seed, options.seconds or _DEMO_S, options.orb, options.link) as played:
        while not (played.over or shutdown):
            played.tick()
        verdict = played.verdict()
    if not shutdown:
        print(json.dumps(verdict) if options.json else demo.summary(verdict))


def _check(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    if options.device is not None and (options.demo or options.link is not None or options.orb):
        parser.error("--device names an orb that is there; leave out --link, --demo and --")
    if options.demo and (options.tap or options.phone is not None):
        parser.error("--tap and --phone are for games by hand; leave out --demo")
    if options.orb and options.link is not None:
        parser.error("what follows -- is for a virtual orb of our own; leave out --link")
    if options.demo and options.target not in (None, "tetris"):
        parser.error("--demo plays Tetris; leave out --target")
    if options.json and not options.demo:
        parser.error("--json belongs to the demo; add --demo")
    if options.key is not None and options.link is None and options.device is None:
        parser.error(
            "--key is for an orb elsewhere, ours needs none; name it with --link or --device"
        )
    if options.link == "":
        parser.error("--link names no port; leave it out to play with a virtual orb")
    if options.device is None and options.target is None:
        options.target = _USUAL
    acts = options.target in (None, *_UNSEEN)  # None: what the device played last
    chosen = options.backend != backends.AUTO
    if not acts and (options.mapping or options.profile or chosen):
        parser.error("--mapping, --profile and --backend need --target keyboard or gamepad")
    if options.headless and not (options.demo or acts) and options.seconds is None:
        parser.error("--headless leaves nobody to close the window; add --demo or --seconds")
    if options.seconds == 0.0:
        parser.error("--seconds must be more than 0; leave it out to play on")


def _parser() -> argparse.ArgumentParser:
    verbs = "".join(f"  {name:7}  {purpose}\n" for name, (_, purpose) in VERBS.items())
    parser = arguments.Parser(
        prog="host",
        usage="host [OPTION ...] [-- OPTION OF THE VIRTUAL ORB ...]\n       host COMMAND [-h] ...",
        description="Play with an orb. Without one, a virtual orb is started: touch it with the\n"
        "mouse. The left button presses, the right one pinches, a drag round the rim\n"
        f"twists.\n\ncommands:\n{verbs}",
        epilog="Try it without an orb: host; or lean back: host --demo",
        formatter_class=lambda prog: argparse.RawDescriptionHelpFormatter(
            prog, max_help_position=20
        ),
        allow_abbrev=False,  # --key must stand for nothing but itself
    )
    parser.add_argument("--version", action="version", version=f"host {__version__}")
    add = partial(add_option, parser)
    _add_orb(add)
    _add_targets(add)
    add("--demo", "let the virtual orb's own hand play; touch the dome to take over")
    add(
        "--headless",
        "open no window: the demo is played as fast as it can be; Tetris needs --demo or --seconds",
    )
    lasts = f"stop after so long (default: play on; a demo without a window: {_DEMO_S:g})"
    add("--seconds N", lasts, type=arguments.number(0.0))
    add("--json", "end a demo without a window with one line of JSON: how it went")
    add("--verbose", "log what happens to the link")
    return parser


def _add_orb(add: Callable[..., None]) -> None:
    add(
        "orb -- OPTION",
        "options of the virtual orb, after two dashes: -- --preset paper-snr; "
        "controller --help lists them",
        nargs="*",
    )
    add(
        "--link URL",
        "where the orb is: a serial port's name, rfcomm://ADDRESS (paired before: orbtouch docs "
        "bluetooth), or a pyserial URL such as socket://127.0.0.1:4000 (default: a virtual orb of "
        "our own)",
    )
    add(
        "--device NAME",
        "the orb of this identity or name, whatever its port; host find lists them. Without "
        "--target it plays what it played last",
    )
    key = "the orb's own key, made by `controller --key FILE` (orbtouch docs link)"
    add("--key FILE", key, type=Path)


def _add_targets(add: Callable[..., None]) -> None:
    add("--target NAME", f"what to play: {', '.join(targets.names())} (default: {_USUAL})")
    add(
        "--tap NAME",
        f"let other programs read along: {', '.join(taps.names())}, or "
        "osc://HOST:PORT (orbtouch docs taps); may be given several times",
        action="append",
        default=[],
    )
    serves = (
        "serve a page on this address of this machine, ADDRESS or ADDRESS:PORT, with which a phone "
        f"touches the virtual orb (orbtouch docs play; default port: {phone.PORT})"
    )
    add("--phone ADDRESS", serves, nargs="?", const="")
    seed = "which game, and which virtual orb; the same again (default: new ones)"
    add("--seed N", seed, type=arguments.whole(0, 2**31 - 1))
    mapping = "what commands press, for the targets keyboard and gamepad (orbtouch docs keys)"
    add("--mapping FILE", mapping, type=Path)
    add("--profile NAME", "the mapping's profile to begin with (default: its first)")
    add(
        "--backend NAME",
        f"what presses them: {', '.join(backends.NAMES)} (default: the best there is); print: "
        "print what would be pressed, and press nothing",
        choices=(backends.AUTO, *backends.NAMES, backends.PRINT),
        default=backends.AUTO,
    )
