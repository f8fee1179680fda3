"""Pages and examples that ship: `orbtouch docs [PAGE]` and `orbtouch examples OUT`."""

import shutil
from pathlib import Path
from typing import Final

from controller.shared.arguments import Parser
from controller.shared.errors import UserError, run
from controller.shared.files import shipped

VERBS: Final = {
    "docs": "print a page of the documentation, or the list of all",
    "examples": "copy examples, sketches of sensors and a recording into a folder",
}


def main(argv: list[str]) -> int:
    """Run one of `VERBS`; return the exit status."""
    return run("orbtouch", lambda: (_docs if argv[0] == "docs" else _examples)(argv))


def _docs(argv: list[str]) -> int:
    pages = {page.stem: page for page in sorted(shipped("docs").glob("*.md"))}
    grammar = Parser(prog="orbtouch docs", description="Print a page, or the list of all pages.")
    grammar.add_argument(
        "page", nargs="?", metavar="PAGE", type=lambda word: Path(word).stem, choices=[*pages]
    )
    texts = {name: page.read_text(encoding="utf-8") for name, page in pages.items()}
    titles = "".join(f"{name:16}{text.splitlines()[0][2:]}\n" for name, text in texts.items())
    print(texts.get(grammar.parse_args(argv[1:]).page, titles), end="")
    return 0


def _examples(argv: list[str]) -> int:
    grammar = Parser(
        prog="orbtouch examples",
        description=f"{VERBS['examples'].capitalize()}: README.md in it lists them.",
    )
    grammar.add_argument("out", metavar="OUT", type=Path, help="a folder to make")
    out = grammar.parse_args(argv[1:]).out
    if out.exists():
        raise UserError(f"{out} is there already; name a folder to make")
    leave = shutil.ignore_patterns("__pycache__")
    shutil.copytree(shipped("examples"), out, ignore=leave)
    shutil.copytree(shipped("firmware"), out / "firmware")
    shutil.copy(shipped("assets") / "demo.npz", out)
    print(f"{out}: README.md lists the examples; firmware has the sketches")
    return 0
