"""Measurements behind the tables of the documentation: commands, and how their results are read."""

import json
import re
import resource
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final

from controller.bundles import bundle
from controller.bundles.bundle import USUAL
from tests.support.fingerprint import SHORT, fingerprint

from .results import say
from .stored import ROOT, Stored, machine

CACHE: Final = ROOT / ".cache" / "figures"
_PROGRAM: Final = re.compile(r"^(models|host|controller) ")


class PartError(RuntimeError):
    """A command failed; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Part:
    """A measurement: commands one after the other, and the file in which the last one writes.

    `{out}` in a command is a folder, kept until the part is complete. Without a file the last line
    of the output is the result.
    """

    name: str
    commands: tuple[str, ...]
    file: str = ""
    minutes: float = 1.0  # of one core, about
    study: bool = False  # measured on request only, and may be of an older bundle
    bundle: str = USUAL  # of those that ship, the one that is measured; empty: none
    drop: tuple[str, ...] = ()  # entries that no table shows, wherever they are

    @property
    def command(self) -> str:
        """The commands for readers."""
        text = " && ".join(self.commands).replace(f"{{out}}/{self.file}", "FILE")
        return text.replace("{out}", "DIR")


def measured(part: Part) -> str:
    """Return the fingerprint of the bundle that a part measures; empty if it measures none."""
    folder = bundle.default_path().parent
    return fingerprint(bundle.read(folder / part.bundle)) if part.bundle else ""


def measure(part: Part) -> Stored:
    """Run the commands of a part; raise PartError if one fails, or the bundle is replaced."""
    before_it = measured(part)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    out = CACHE / f"{part.name}-{before_it[:SHORT]}"  # what was done before an interruption is kept
    out.mkdir(parents=True, exist_ok=True)
    text = ""
    for command in part.commands:
        text = _run(command.replace("{out}", str(out)))
    if part.file:
        text = (out / part.file).read_text(encoding="utf-8")
    else:
        text = text.rstrip().rpartition("\n")[2]
    results = json.loads(text.replace(str(out), "DIR"))
    shutil.rmtree(out)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if measured(part) != before_it:
        raise PartError("the bundle that ships was replaced meanwhile; run it again")
    today = datetime.now(UTC).date().isoformat()
    results = _without(results, part.drop)
    return Stored(part.name, part.command, today, machine(), before_it, round(cpu_s, 1), results)


def _run(command: str) -> str:
    """Run a command of the project, and return what it prints."""
    words = shlex.split(_PROGRAM.sub(r"python -m \1 ", command))
    done = subprocess.run(
        [sys.executable, *words[1:]], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False
    )
    if done.returncode:
        raise PartError(f"{command!r} ended with status {done.returncode}; see its messages above")
    return done.stdout


def _without(value: Any, drop: Sequence[str]) -> Any:
    if isinstance(value, dict):
        return {key: [] if key in drop else _without(one, drop) for key, one in value.items()}
    return [_without(one, drop) for one in value] if isinstance(value, list) else value


PARTS: Final = (
    Part(
        "card", ("models evaluate --json {out}/card.json",), "card.json", minutes=2.0,
        drop=("touches",),
    ),
    *(
        Part(
            f"tapping-{preset}",
            (f"python -m tests.benchmarks.tapping --preset {preset} --taps 12 --seeds 3 --json",),
            minutes=3.0,
        )
        for preset in ("nominal", "paper-snr")
    ),
    *(
        Part(
            f"driver-{way}",
            (f"python -m tests.benchmarks.driver --ways {way} --minutes 5 --json",),
            minutes=4.0,
        )
        for way in ("virtual", "column", "taxel")
    ),
    Part("games", ("python -m tests.benchmarks.played_games --json",), minutes=8.0),
    Part("command-cost", ("python -m tests.benchmarks.command_cost --json",)),
    Part(
        "information", ("models paper --only section6 bound --out {out}",), "paper.json",
        minutes=1.5,
    ),
    Part(
        "figure7", ("models paper --only figure7 --out {out}",), "paper.json", minutes=30.0,
        study=True, bundle="",
    ),
)  # fmt: skip


def chosen(names: Sequence[str]) -> list[Part]:
    """Return the parts whose names begin so; without names all that are no studies."""
    if not names:
        return [part for part in PARTS if not part.study]
    found = [part for part in PARTS if part.name.startswith(tuple(names))]
    if not found:
        every = ", ".join(part.name for part in PARTS)
        raise PartError(f"there is no part {', '.join(names)}; there are {every}")
    return found


def announce(part: Part, left_min: float) -> None:
    """Print which part is measured, and the time left."""
    say(f"{part.name}: {part.command}; about {left_min:.0f} CPU minutes left")
