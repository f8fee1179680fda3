"""Figures of the documentation: measure what is missing or of another bundle, and render it.

    python -m tests.benchmarks.docs [--list] [--render] [--only NAME ...]

Each part is stored in docs/figures as it ends, so that a run that was interrupted goes on with what
is left. Studies are older measurements: they are made again only when they are named.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from controller.shared.files import atomic_write
from tests.support.fingerprint import SHORT

from . import docs_parts, stored
from .docs_parts import PARTS, Part, PartError
from .docs_tables import BLOCKS, Block
from .results import say
from .stored import FOLDER, ROOT, BlockError

PICTURES: Final = ROOT / "docs" / "pictures"


def state(part: Part, folder: Path = FOLDER) -> str:
    """Return "current", or the reason why a part is measured again."""
    found = stored.load(part.name, folder)
    if found is None:
        there = stored.path_of(part.name, folder).exists()
        return "changed by hand" if there else "missing"
    if found.command != part.command:
        return "of another command"
    if not part.study and found.bundle != docs_parts.measured(part):
        return f"of bundle {found.bundle[:SHORT]}"
    return "current"


def measure(parts: Sequence[Part], folder: Path = FOLDER, *, again: bool = False) -> None:
    """Measure parts that are not current, and store each as it ends."""
    due = [part for part in parts if again or state(part, folder) != "current"]
    for number, part in enumerate(due):
        docs_parts.announce(part, sum(one.minutes for one in due[number:]))
        result = docs_parts.measure(part)
        stored.keep(result, folder)
        say(f"{part.name}: {result.cpu_s:.0f} s of CPU; {number + 1} of {len(due)}")


def problem(block: Block, root: Path = ROOT, folder: Path = FOLDER) -> str | None:
    """Return why a block of a page is not what it should be; None if it is."""
    found = {}
    for part in (one for one in PARTS if one.name in block.parts):
        result = stored.load(part.name, folder)
        if result is None or (why := state(part, folder)) != "current":
            return f"{part.name} is {why if result else 'missing, or changed by hand'}"
        found[part.name] = result
    page = (root / block.page).read_text(encoding="utf-8")
    try:
        same = stored.block(page, block.name) == block.text(found)
    except BlockError as error:
        return str(error)
    return None if same else "differs from its stored result"


def render(root: Path = ROOT, folder: Path = FOLDER) -> None:
    """Write all blocks whose results are stored."""
    for block in BLOCKS:
        found = {name: stored.load(name, folder) for name in block.parts}
        known = {name: one for name, one in found.items() if one is not None}
        if len(known) < len(found):
            say(f"{block.name}: not measured yet")
            continue
        path = root / block.page
        old = path.read_text(encoding="utf-8")
        new = stored.replaced(old, block.name, block.text(known))
        if new != old:
            atomic_write(path, new.encode())
            say(f"{block.name}: written to {block.page}")


def draw(folder: Path = PICTURES) -> None:
    """Draw the pictures of docs/paper.md from stored results."""
    from models.studies.paper import drawings

    for name in ("figure7", "information"):
        if (found := stored.load(name)) is not None:
            drawings.draw(found.results, folder)


def main() -> int:
    """Measure and render; 1 if a block is not current afterwards."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.docs", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--list", action="store_true", help="print parts and blocks, and end")
    parser.add_argument("--render", action="store_true", help="render only, and measure nothing")
    parser.add_argument("--again", action="store_true", help="measure what is current as well")
    words = "parts whose names begin so; default: all but studies"
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help=words)
    arguments = parser.parse_args()
    try:
        if not (arguments.list or arguments.render):
            measure(docs_parts.chosen(arguments.only), again=arguments.again)
    except PartError as error:
        say(str(error))
        return 1
    if not arguments.list:
        render()
    if not (arguments.list or arguments.render):
        draw()
    for part in PARTS if arguments.list else ():
        kind = "study" if part.study else ""
        print(f"{part.name:20} {part.minutes:5.0f} CPU min  {kind:6} {state(part)}")
    problems = {block.name: problem(block) for block in BLOCKS}
    for name, text in problems.items():
        if text:
            say(f"block {name}: {text}")
    return int(any(problems.values()))


if __name__ == "__main__":
    sys.exit(main())
