"""The verbs of `orbtouch`, from the tables of the programs that have them."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import host.cli
import tetris
from controller.cli import COMMANDS
from controller.shared.errors import unknown_command
from orbtouch import __version__, pages

# Headings of the help.
_PLAY, _TEACH, _TRAIN, _CARE, _READ = "play", "teach", "train", "look after an orb", "read"
_TEACHING: Final = ("teach", "recordings")
_FRAME: Final = """\
usage: orbtouch [VERB] [-h] ...

Play with an orb, teach it gestures, train its networks and look after it.
Without a verb: play.
{}
options:
  -h, --help   show this help message, or that of a verb
  --version    show the version

Try it without an orb: orbtouch; all options of a verb: orbtouch VERB --help"""


@dataclass(frozen=True, slots=True)
class Verb:
    """A verb of this command."""

    name: str
    heading: str  # where the help lists it
    program: str  # module whose `main` runs it
    purpose: str  # line of help, from the program's own table
    words: tuple[str, ...] = ()  # what the program calls it; (): what it does without a verb


def verbs() -> Iterator[Verb]:
    """Yield all verbs; `models` is imported when its first one is reached.

    Where two programs have a verb, as `install`, it is that of the first.
    """
    yield Verb("play", _PLAY, "host.__main__", host.cli.PLAY[1])
    yield Verb("tetris", _PLAY, "tetris.__main__", tetris.PURPOSE)
    for name, (_, purpose) in host.cli.VERBS.items():
        yield Verb(name, _CARE, "host.__main__", purpose, (name,))
    yield Verb("run", _CARE, "controller.__main__", COMMANDS[""][1])
    for name, (_, purpose) in COMMANDS.items():
        if name and name not in host.cli.VERBS:
            heading = _TEACH if name in _TEACHING else _CARE
            yield Verb(name, heading, "controller.__main__", purpose, (name,))
    for name, purpose in pages.VERBS.items():
        yield Verb(name, _READ, "orbtouch.pages", purpose, (name,))
    from models import cli

    for name, purpose in cli.COMMANDS.items():
        yield Verb(name, _TRAIN, "models.__main__", purpose, (name,))


def find(name: str) -> Verb:
    """Return a verb; raise UserError, which names the nearest, if there is none."""
    names = []
    for verb in verbs():
        if verb.name == name:
            return verb
        names.append(verb.name)
    raise unknown_command("orbtouch", name, names)


def show(option: str) -> int:
    """Print the version or the help; return the exit status."""
    print(f"orbtouch {__version__}" if option == "--version" else _help(), flush=True)
    return 0


def _help() -> str:
    """Return every verb with its purpose, under its heading."""
    found, lines = list(verbs()), []
    for heading in (_PLAY, _TEACH, _TRAIN, _CARE, _READ):
        lines += ["", f"{heading}:"]
        lines += [f"  {v.name:11}  {v.purpose}" for v in found if v.heading == heading]
    return _FRAME.format("\n".join([*lines, ""]))
