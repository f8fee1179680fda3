"""`controller service`: print the systemd unit for this installation."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Final

NAME: Final = "orbtouch.service"
# Groups that may use Bluetooth over D-Bus, pins and converter, on Debian and Raspberry Pi OS.
GROUPS: Final = ("bluetooth", "gpio", "spi")


def main(argv: Sequence[str]) -> int:
    """Print the unit, and how to install it; return 0."""
    parser = argparse.ArgumentParser(
        prog="controller service",
        description="Print a systemd unit that runs this controller: it starts with the machine, "
        "and again after a crash or a hang.",
        epilog=f"controller service | sudo tee /etc/systemd/system/{NAME}; "
        f"sudo systemctl enable --now {NAME}",
    )
    parser.add_argument(
        "options",
        nargs="*",
        metavar="-- OPTION",
        help="options of the controller, after two dashes (default: --link rfcomm:)",
    )
    options = parser.parse_args(argv)
    print(unit(command(), options.options or ["--link", "rfcomm:"]), end="")
    return 0


def unit(program: Sequence[str], options: Sequence[str]) -> str:
    """Return the unit.

    Args:
        program: Command of the controller.
        options: Its options.
    """
    text = files("controller.runtime").joinpath(NAME).read_text(encoding="utf-8")
    words = " ".join(_quoted(word) for word in (*program, *options))
    text = text.replace("@COMMAND@", words).replace("@GROUPS@", " ".join(_groups()))
    return text.replace("SupplementaryGroups=\n", "")


def command() -> list[str]:
    """Return the command of this installation."""
    beside = Path(sys.executable).parent / "controller"
    found = str(beside) if beside.exists() else shutil.which("controller")
    return [found] if found else [sys.executable, "-m", "controller"]


def _groups() -> list[str]:
    """Return the groups that exist: systemd refuses a unit with a missing one."""
    try:
        import grp
    except ImportError:  # a system without systemd
        return list(GROUPS)
    there = {entry.gr_name for entry in grp.getgrall()}
    return [name for name in GROUPS if name in there]


def _quoted(word: str) -> str:
    """Return a word quoted for a systemd unit."""
    word = word.replace("\\", "\\\\").replace("%", "%%").replace("$", "$$").replace('"', '\\"')
    return f'"{word}"' if not word or any(letter.isspace() for letter in word) else word
