"""A sweep's folder: one file for each finished job, so that an interrupted sweep goes on.

A job's file has the job's name, which is a hash, and is written beside and renamed: there is
never half of one. `results.json` holds what does not depend on where or when it was made.
"""

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from controller.files import atomic_write

JOBS: Final = "jobs"
RESULTS: Final = "results.json"
TIMES: Final = "times.json"
REPORT: Final = "report.html"

Answer = dict[str, Any]  # "name", "result", "where", "seconds", "cpu_s"


def claim(folder: Path) -> None:
    """Make the folder.

    Raises:
        ValueError: It cannot be written to.
    """
    try:
        (folder / JOBS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        problem = error.strerror or error
        raise ValueError(f"cannot write into {folder}: {problem}; choose another --out") from None


def answers(folder: Path) -> dict[str, Answer]:
    """Return what is finished, by name; what cannot be read is done again."""
    found = {}
    for path in sorted((folder / JOBS).glob("[!.]*.json")):
        with suppress(ValueError, KeyError, TypeError):
            answer = json.loads(path.read_text(encoding="utf-8"))
            if answer["name"] == path.stem and answer["result"]:
                found[path.stem] = answer
    return found


def keep(folder: Path, answer: Mapping[str, Any]) -> None:
    """Write a finished job."""
    replace(folder / JOBS / f"{answer['name']}.json", text(answer))


def replace(path: Path, content: str) -> None:
    """Write a file whole or not at all; an old one goes."""
    atomic_write(path, content.encode())


def text(content: Any) -> str:
    """Return JSON, the same for the same content."""
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
