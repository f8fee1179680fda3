"""Tables as Markdown."""

from models.reports.tables import Table


def table(content: Table) -> str:
    """Return a table as Markdown."""
    lines = [content.head, ["---"] * len(content.head), *content.rows]
    return "\n".join(f"|{'|'.join(map(_cell, line))}|" for line in lines)


def _cell(text: str) -> str:
    return f" {text.replace('|', chr(92) + '|')} " if text else " "
