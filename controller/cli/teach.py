"""`controller teach`: examples of gestures by cues, to train from or to be learned at once."""

import logging
import shlex
import sys
import time
from argparse import HelpFormatter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from controller.bundles import bundle as bundles
from controller.bundles import vocabulary as vocabularies
from controller.bundles.deploy.store import BundleStore
from controller.bundles.vocabulary import FILE
from controller.recognition.mapping import NONE
from controller.sensors import base as sensors
from controller.shared.arguments import Parser, whole
from controller.shared.errors import (
    INTERRUPTED,
    TROUBLE,
    TroubleError,
    UserError,
    output_folder,
    reason,
    say,
)
from controller.shared.protocol.messages import COMMANDS
from controller.shared.shutdown import signals
from controller.teach import add_gesture, session
from controller.teach.session import FEW, GESTURES, LOCATIONS, SessionPlan

OUT: Final = Path("recordings")
_MOST: Final = 1000  # repetitions
_USUAL: Final = {GESTURES: 10, LOCATIONS: 2, FEW: 5}  # examples of each gesture, or place


def main(argv: Sequence[str]) -> int:
    """Run `controller teach` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    options = _parser().parse_args(argv)
    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    listed = vocabularies.shipped()
    if (options.out / FILE).exists():
        listed = vocabularies.read(options.out / FILE)
    protocol = FEW if options.add else LOCATIONS if options.places else GESTURES
    plan = SessionPlan(
        options.sensor,
        options.out,
        options.user,
        options.session,
        listed,
        protocol,
        options.repetitions or _USUAL[protocol],
    )
    if options.add:
        source = options.bundle or BundleStore().current()
        plan = add_gesture.plan(plan, options.add, options.command, bundles.read(source))
        if options.command not in (None, NONE, *COMMANDS):
            say(f"the game has no command {options.command!r}, only {', '.join(COMMANDS)}")
    elif options.command or options.bundle:
        raise UserError("--command and --bundle are for the gesture that --add names; add it")
    made, interrupted = _session(plan)
    if not options.add:
        for path in made:
            print(path, flush=True)
        if made:
            folder, bundle = shlex.quote(str(options.out)), options.out.resolve().name
            say(f"make a bundle of all sessions with: models train {folder} --out {bundle}.orb")
        return 0 if made else TROUBLE
    if interrupted or not made:
        say("broken off; nothing was learned")
        return INTERRUPTED if interrupted else TROUBLE
    try:
        out = add_gesture.learn(source, made, plan, options.out, say)
    except UserError as error:  # the request was right
        raise TroubleError(str(error)) from None
    except OSError as error:
        raise TroubleError(f"the bundle cannot be written: {reason(error)}") from None
    print(out, flush=True)
    say(f"take it into use with: controller install {shlex.quote(str(out))}")
    return 0


def _session(plan: SessionPlan) -> tuple[list[Path], bool]:
    """Run a session; return its recordings, and whether a signal ended it."""
    output_folder(plan.out)
    with signals() as ends:
        ends.sealing = True
        return session.run(plan, lambda: bool(ends), say), bool(ends)


def _parser() -> Parser:
    grammar = Parser(
        prog="controller teach",
        description="Gather examples of your own gestures: get ready, go, rest, until there is "
        f"enough of all. The gestures stand in DIR/{FILE}; without it they are the paper's. Or "
        "teach a bundle one further gesture at once: --add NAME. All of it: orbtouch docs teach.",
        epilog="Try it without hardware (seconds): controller teach --out mine",
        formatter_class=lambda prog: HelpFormatter(prog, max_help_position=18),
    )
    add = grammar.add_argument
    sensors.add_option(
        grammar, "what is touched; the virtual orb's own hand does what the cues ask for"
    )
    text = f"folder for the recordings; no file is replaced (default: {OUT})"
    add("--out", metavar="DIR", type=Path, default=OUT, help=text)
    add("--user", metavar="ID", default="", help="who touches the sensor: letters, digits")
    text = "which of the user's sessions (default: date and time)"
    add("--session", metavar="ID", default=time.strftime("%Y%m%dT%H%M%S"), help=text)
    text = "examples of each gesture, or of each place (default: 10; --places 2, --add 5)"
    add("--repetitions", metavar="N", type=whole(1, _MOST), help=text)
    text = "ask for located gestures on every taxel and between them, and for nothing else"
    add("--places", action="store_true", help=text)
    text = (
        "teach one gesture from a few examples, here and in seconds; with --user, how one user "
        "does one that is known"
    )
    add("--add", metavar="NAME", default="", help=text)
    add("--command", metavar="WORD", help="what the gesture asks for, such as hold; with --add")
    text = "the bundle that learns (default: the one in use); with --add"
    add("--bundle", metavar="FILE", type=Path, help=text)
    return grammar
