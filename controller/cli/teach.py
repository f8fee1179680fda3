"""`controller teach`: take people through examples of their gestures, and offer to train."""

import argparse
import logging
import shlex
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from controller import arguments
from controller.arguments import Parser
from controller.bundles import bundle as bundles
from controller.bundles.vocabulary import FILE, NO_MIRROR, ROTATIONS, SELF
from controller.cli import install
from controller.cli.sensor_options import add_sensor, rate
from controller.errors import (
    INTERRUPTED,
    TROUBLE,
    TroubleError,
    UserError,
    agreed,
    ask,
    complain,
    reason,
)
from controller.protocol.messages import COMMANDS
from controller.recognition.mapping import NONE
from controller.shutdown import signals
from controller.teach import TeachError, add_gesture, dataset_folder, protocols, session
from controller.teach.progress import summary
from controller.teach.session import TeachPlan, say

OUT: Final = Path("recordings")
_MOST: Final = 1000  # repetitions


def main(argv: Sequence[str]) -> int:
    """Run `controller teach` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    options = parser().parse_args(argv)
    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    if options.example is not None:
        for path in dataset_folder.example(options.example):
            print(path)
        return 0
    if options.add is not None:
        return _add(options)
    for name in ("command", "rotations", "mirror"):
        if getattr(options, name):
            raise TeachError(f"--{name} is of the gesture that --add names; add it")
    people = _people(options)
    lesson = session.prepare(options)
    made, interrupted = _sessions(lesson, people)
    for path in made:
        print(path, flush=True)
    taken = dataset_folder.taken(options.out)
    if not taken:
        say("nothing was recorded")
        return 1
    agree = agreed if _interactive() and not interrupted else None
    plan = (
        dataset_folder.course_of_people
        if options.protocol == protocols.USERS
        else dataset_folder.course
    )
    try:
        return dataset_folder.offer(
            plan(options.out, taken), agree=agree, say=say, yes=options.yes and not interrupted
        )
    except KeyboardInterrupt:
        say("interrupted; the same commands go on from here")
        raise


def _add(options: argparse.Namespace) -> int:
    """Teach one gesture from a few examples, and offer to take what has learned it into use."""
    options.rotations, options.mirror = options.rotations or "none", options.mirror or "none"
    options.bundle = add_gesture.source(options)
    known = bundles.read(options.bundle)
    wanted = add_gesture.vocabulary(options, known)
    (entry,) = wanted.entries
    options.protocol = protocols.FEW
    options.repetitions = options.repetitions or add_gesture.USUAL
    if isinstance(entry.command, str) and entry.command not in (*COMMANDS, NONE):
        say(f"the game has no command {entry.command!r}, only {', '.join(COMMANDS)}; going on")
    home, options.out = options.out, options.out / options.add
    lesson = session.prepare(options, wanted)
    made, interrupted = _sessions(lesson, iter([options.user]))
    if interrupted or not made:
        say("broken off; nothing was learned")
        return INTERRUPTED if interrupted else TROUBLE
    try:
        out = add_gesture.learn(options.bundle, made, entry, options.user, home, say)
    except UserError as error:
        return complain("controller", error, TROUBLE)
    except OSError as error:
        return complain("controller", f"the bundle cannot be written: {reason(error)}", TROUBLE)
    print(out, flush=True)
    return _offer_install(out, yes=options.yes)


def _offer_install(out: Path, *, yes: bool) -> int:
    """Take a bundle into use, if that is wanted, or say how."""
    if yes or (_interactive() and agreed("Take it into use now?")):
        return install.main([str(out)])
    say(f"take it into use with: controller install {shlex.quote(str(out))}")
    say(f"or only play with it: host -- --bundle {shlex.quote(str(out))}")
    return 0


def _sessions(lesson: TeachPlan, people: Iterator[str]) -> tuple[list[Path], bool]:
    """Take people through a session each; return recordings, and whether one broke it off."""
    made: list[Path] = []
    for number, user in enumerate(people):
        try:
            begun = session.begin(lesson, user)
        except UserError as error:
            if number:
                raise TroubleError(str(error)) from None
            raise
        if lesson.options.protocol == protocols.USERS:
            say(f"{user}: take a seat")
        if begun.model is None:
            say("there is no model for this sensor yet")
        with signals() as ends:
            ends.sealing = True
            try:
                made += session.run(begun, lambda: bool(ends))
            except UserError as error:  # the request was right
                raise TroubleError(str(error)) from None
        for line in summary(begun.tally):
            say(line)
        understood = begun.tally.understood(lesson.options.add or "")
        if user and understood and understood[0] == understood[1] > 0:
            say(f"{user} is understood anyway, so there is hardly anything to gain (docs/teach.md)")
        if ends:
            return made, True
    return made, False


def _people(options: argparse.Namespace) -> Iterator[str]:
    """Return the users to teach, in order; TeachError if none is named and no terminal can ask."""
    names = options.user.split(",") if options.user else []
    if options.protocol != protocols.USERS:
        if len(names) > 1:
            raise TeachError("several users take turns with --protocol users")
        return iter(names or [""])
    if names:
        return iter(names)
    if not _interactive():
        raise TeachError("say who takes turns: --user ada,ben")
    return _asked()


def _interactive() -> bool:
    """Return whether questions can be asked."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def _asked() -> Iterator[str]:
    """Ask who is next until nobody is."""
    while True:
        try:
            name = ask("Who is next? (letters and digits; nothing ends) ").strip()
        except (EOFError, KeyboardInterrupt):
            say("")
            return
        if not name:
            return
        yield name


def parser() -> argparse.ArgumentParser:
    """Return the command line's grammar."""
    grammar = Parser(
        prog="controller teach",
        description="Gather examples of your own gestures: get ready, go, rest, until there is "
        "enough of all. Then train, tune and evaluate. All of it: docs/teach.md.",
        epilog="Try it without hardware (seconds): controller teach --example mine, then "
        "controller teach --sensor virtual --out mine --speed 0",
        formatter_class=lambda prog: argparse.HelpFormatter(prog, max_help_position=18),
    )
    add = grammar.add_argument
    add_sensor(grammar, "what is touched; the virtual orb's own hand does what the cues ask for")
    add("--labels", metavar="FILE", type=Path,
        help=f"the gestures, a vocabulary (default: DIR/{FILE}, else the paper's)")  # fmt: skip
    add("--protocol", choices=tuple(protocols.REPETITIONS), default=protocols.GESTURES,
        help="gestures in any order; locations: on every site of the grid and between them; "
        "users: one person after the other (default: gestures)")  # fmt: skip
    add("--out", metavar="DIR", type=Path, default=OUT,
        help=f"folder for the recordings; no file is replaced (default: {OUT})")  # fmt: skip
    add("--user", metavar="ID", default="",
        help="who touches the sensor: letters, digits; for users: ada,ben")  # fmt: skip
    add("--session", metavar="ID", default=time.strftime("%Y%m%dT%H%M%S"),
        help="which of the user's sessions (default: date and time)")  # fmt: skip
    usual = protocols.REPETITIONS
    add("--repetitions", metavar="N", type=arguments.whole(1, _MOST), default=0,
        help="examples of each gesture, or of each place (default: "
        f"{usual[protocols.GESTURES]}, of places {usual[protocols.LOCATIONS]})")  # fmt: skip
    add("--bundle", metavar="FILE", type=Path,
        help="the model to compare with (default: the shipped one, if it fits)")  # fmt: skip
    add("--rate", metavar="HZ", type=rate,
        help="sensor scans per second (default: the sensor's own)")  # fmt: skip
    add("--speed", metavar="X", type=arguments.number(0.0), default=1.0,
        help="of a virtual orb: 1 is real time, 0 as fast as it can (default: 1)")  # fmt: skip
    add("--yes", action="store_true",
        help="train, tune and evaluate unasked; with --add, take it into use")  # fmt: skip
    add("--add", metavar="NAME",
        help=f"teach the bundle in use (or --bundle) one new gesture from a few examples "
        f"({add_gesture.USUAL}, or --repetitions 1, 3 ...), here and in seconds; with --user, how "
        "somebody does one that it knows")  # fmt: skip
    add("--command", metavar="WORD", help="what the new gesture asks for, such as hold")
    add("--rotations", choices=ROTATIONS,
        help="turns that leave the new gesture the same (default: none)")  # fmt: skip
    add("--mirror", choices=(SELF, NO_MIRROR),
        help="self: its mirror image is the same gesture (default: none)")  # fmt: skip
    add("--example", metavar="DIR", type=Path,
        help=f"only write {FILE} to begin with, and a gesture, into DIR")  # fmt: skip
    return grammar
