"""The grammar of a plain run; `controller/cli/run.py` does what it says."""

import argparse
import math
import re
import time
from pathlib import Path

from controller import __version__
from controller.bundles.inference import engines
from controller.cli.commands import COMMANDS
from controller.cli.sensor_options import add_sensor
from controller.links import PRINT


def parser() -> argparse.ArgumentParser:
    """Return the command line's grammar."""
    grammar = argparse.ArgumentParser(
        prog="controller",
        usage="controller [OPTION ...]\n       controller COMMAND [-h] ...",
        description="Recognise gestures on the soft sensor and send them as commands, until Ctrl-C."
        "\n\ncommands:\n"
        + "".join(f"  {name:12}  {purpose}\n" for name, (_, purpose) in COMMANDS.items()),
        epilog="Try it without hardware: controller --sensor virtual --link -",
        formatter_class=lambda prog: argparse.RawDescriptionHelpFormatter(
            prog, max_help_position=18
        ),
    )
    add = grammar.add_argument
    add("--version", action="version", version=f"controller {__version__}")
    add_sensor(grammar, "where frames come from")
    add(
        "--hand-of",
        metavar="NAME[:DAY]",
        type=_hand_of,
        default=("", ""),
        help="whose hand the virtual orb has, as `controller teach --user NAME --session DAY` has "
        "it; another DAY is another mood of that person's (default: nobody's hand)",
    )
    add(
        "--bundle",
        metavar="FILE",
        type=Path,
        help="the trained networks and their settings (default: the one that `controller install` "
        "took into use, else the one that ships)",
    )
    add(
        "--engine",
        metavar="NAME",
        choices=engines.NAMES,
        default="",
        help=f"what runs the networks: {', '.join(engines.NAMES)} (default: what `controller "
        f"install` measured to be the faster one here, else {engines.STANDARD})",
    )
    add(
        "--labels",
        metavar="FILE",
        type=Path,
        help="a vocabulary, whose gestures the virtual orb's own hand then knows: docs/teach.md",
    )
    add(
        "--mapping",
        metavar="FILE",
        type=Path,
        help="gestures to commands, in place of the bundle's: docs/mapping.md",
    )
    add(
        "--link",
        metavar="URL",
        default=PRINT,
        help="where commands go: - prints them, listen://127.0.0.1:PORT waits for a host, rfcomm: "
        "waits for paired ones over Bluetooth (controller pair --help, docs/bluetooth.md), "
        "else a serial port or a pyserial URL (default: -)",
    )
    add(
        "--key",
        metavar="FILE",
        type=Path,
        help="the key that this orb and its host share, for --link; `controller key FILE` makes "
        "one: docs/link.md",
    )
    add(
        "--unprotected",
        action="store_true",
        help="let listen:// take hosts of other machines without a key: everybody who reaches the "
        "port can connect",
    )
    add(
        "--record",
        metavar="PATH",
        nargs="?",
        type=Path,
        const=Path(),
        help="keep the session in a new .npz file, or in a folder (default: here), where it is "
        "named sub-USER_ses-SESSION_run-01.npz; what a crash left unfinished there is recovered",
    )
    add(
        "--user",
        metavar="ID",
        default="",
        help="who touches the sensor, for --record: letters and digits; and who plays, where the "
        "bundle knows them (docs/users.md; default: whoever it takes them for)",
    )
    add(
        "--session",
        metavar="ID",
        default=time.strftime("%Y%m%d"),
        help="which of the user's sessions, for --record (default: today's date)",
    )
    add(
        "--label",
        metavar="NAME",
        default="",
        help="what the sensor's label button means, for --record, where it says only up and down",
    )
    add(
        "--cues",
        metavar="FILE",
        type=Path,
        help="a plan of what to record, for --record: get ready, go, rest, until there is enough "
        "of all: docs/recording.md",
    )
    add(
        "--replay",
        metavar="FILE",
        type=Path,
        help="a recording in place of a sensor: as fast as it can, or, over a link, as recorded",
    )
    add(
        "--rate",
        metavar="HZ",
        type=_rate,
        help="sensor scans per second, within 2 %% of the bundle's (default: the bundle's)",
    )
    add(
        "--ledger",
        metavar="FILE",
        type=Path,
        help="keep how long each hop of each frame took, as comma-separated milliseconds",
    )
    add(
        "--realtime",
        action="store_true",
        help="ask the system to wake the loop before all ordinary programs",
    )
    return grammar  # fmt: skip


def _hand_of(words: str) -> tuple[str, str]:
    if not re.fullmatch("[A-Za-z0-9]+(:[A-Za-z0-9]+)?", words):
        raise argparse.ArgumentTypeError(f"{words!r} must be a NAME of letters and digits, or "
                                         "NAME:DAY")  # fmt: skip
    name, _, day = words.partition(":")
    return name, day


def _rate(words: str) -> float:
    try:
        value = float(words)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError(f"{words} must be a number above 0, in hertz")
    return value
