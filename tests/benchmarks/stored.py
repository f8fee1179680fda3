"""Stored results of measurements, and the blocks of pages that are rendered from them.

A stored result is a JSON file in docs/figures: the figures, the commands that made them, the date,
the machine, and the fingerprint of the bundle that was measured. A block of a page stands between
`<!-- figures: NAME -->` and `<!-- /figures -->`.
"""

import hashlib
import json
import platform
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any, Final

from controller.shared.files import atomic_write
from models.results.storage import plain
from tests.support.fingerprint import SHORT

ROOT: Final = Path(__file__).resolve().parents[2]
FOLDER: Final = ROOT / "docs" / "figures"
END: Final = "<!-- /figures -->"
BLOCK: Final = re.compile(r"<!-- figures: ([\w-]+) -->\n\n(.*?)\n\n<!-- /figures -->", re.DOTALL)
_CPU: Final = Path("/proc/cpuinfo")


class BlockError(ValueError):
    """A page has no block of a name, or several; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Stored:
    """A stored result."""

    name: str
    command: str  # makes it again
    date: str  # ISO 8601
    machine: str
    bundle: str  # fingerprint of the measured bundle; empty: none was measured
    cpu_s: float  # time of processors
    results: Any  # plain data
    sum: str = ""  # SHA-256 of all other entries: a change by hand is found

    def sealed(self) -> "Stored":
        """Return it with the sum of its entries."""
        entries = {key: one for key, one in asdict(self).items() if key != "sum"}
        text = json.dumps(plain(entries), sort_keys=True)
        return replace(self, sum=hashlib.sha256(text.encode()).hexdigest())

    @property
    def origin(self) -> str:
        """Bundle, date and machine, as Markdown."""
        day = date.fromisoformat(self.date)
        of = f"Bundle `{self.bundle[:SHORT]}`" if self.bundle else "No bundle"
        return f"{of}, {day.day} {day:%B %Y}, {self.machine}"


def caption(results: Sequence[Stored]) -> str:
    """Return the origin of results, and the commands that make them again, as Markdown."""
    commands: dict[str, list[str]] = {}
    for one in results:
        commands.setdefault(one.origin, []).append(f"`{one.command}`")
    return "; ".join(f"{origin}: {', '.join(own)}" for origin, own in commands.items())


def machine() -> str:
    """Return this machine in words."""
    text = _CPU.read_text(encoding="utf-8") if _CPU.is_file() else ""
    models = re.findall(r"^model name\s*: (.+)$", text, re.MULTILINE)
    cores = f"{len(models)} cores of {models[0]}" if models else platform.machine()
    return f"{cores}, Python {platform.python_version()}"


def path_of(name: str, folder: Path = FOLDER) -> Path:
    """Return the file of a stored result."""
    return folder / f"{name}.json"


def load(name: str, folder: Path = FOLDER) -> Stored | None:
    """Return a stored result; None if there is none, or if it was changed by hand."""
    path = path_of(name, folder)
    if not path.is_file():
        return None
    found = Stored(**json.loads(path.read_text(encoding="utf-8")))
    return found if found.sealed() == found else None


def keep(stored: Stored, folder: Path = FOLDER) -> None:
    """Write a result, with its sum; an older one goes."""
    folder.mkdir(exist_ok=True)
    sealed = replace(stored, results=plain(stored.results), sum="").sealed()
    text = json.dumps(plain(sealed), indent=1, ensure_ascii=False)
    lists = re.compile(r"\[\s+([^][{}]*?)\s+\]")  # a list of plain values stays on a line
    text = lists.sub(lambda one: f"[{' '.join(one[1].split())}]", text)
    atomic_write(path_of(stored.name, folder), f"{text}\n".encode())


def block(page: str, name: str) -> str:
    """Return the content of a block of a page."""
    found = [one[2] for one in BLOCK.finditer(page) if one[1] == name]
    if len(found) != 1:
        raise BlockError(
            f"there are {len(found)} blocks {name!r}; write <!-- figures: {name} -->, a line and "
            f"{END} once, with empty lines between"
        )
    return found[0]


def replaced(page: str, name: str, content: str) -> str:
    """Return a page with other content of a block."""
    block(page, name)
    return BLOCK.sub(
        lambda one: f"<!-- figures: {name} -->\n\n{content}\n\n{END}" if one[1] == name else one[0],
        page,
    )
