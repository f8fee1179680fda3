"""Pages of Markdown of which a part, between two marks, is written anew by a command."""

from pathlib import Path

from models import user_files


def check(path: Path, begin: str, end: str) -> None:
    """Check that a page can take something between two marks.

    Raises:
        UserFileError: It cannot be read.
        ValueError: The marks are not in it.
    """
    between(user_files.read_text(path), begin, end, "")


def between(page: str, begin: str, end: str, content: str) -> str:
    """Return a page with other content between two marks.

    Raises:
        ValueError: The marks are not in it.
    """
    before, first, rest = page.partition(begin)
    _, last, after = rest.partition(end)
    if not (first and last):
        raise ValueError(f"there is no place for the tables; write {begin} and {end}")
    return f"{before}{begin}\n\n{content}\n\n{end}{after}"
