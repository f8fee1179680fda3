"""Markdown: tables, and pages of which a part between two marks is replaced by a command."""

from pathlib import Path

from models.reports.tables import Table
from models.results import storage


def table(content: Table) -> str:
    """Return a table as Markdown."""
    lines = [content.head, ["---"] * len(content.head), *content.rows]
    return "\n".join(f"|{'|'.join(map(_cell, line))}|" for line in lines)


def _cell(text: str) -> str:
    return f" {text.replace('|', chr(92) + '|')} " if text else " "


def check(path: Path, command: str) -> None:
    """Raise ValueError if a page lacks the two marks of a command."""
    between(storage.read_text(path), command, "")


def update(path: Path, command: str, content: str) -> None:
    """Replace the text between the two marks of a command in a page that has them."""
    storage.write_text(path, between(storage.read_text(path), command, content))


def between(page: str, command: str, content: str) -> str:
    """Return a page with other content between a command's marks; raise ValueError without."""
    begin, end = f"<!-- {command} -->", f"<!-- so far {command} -->"
    before, first, rest = page.partition(begin)
    _, last, after = rest.partition(end)
    if not (first and last):
        raise ValueError(f"there is no place for the tables; write {begin} and {end}")
    return f"{before}{begin}\n\n{content}\n\n{end}{after}"
