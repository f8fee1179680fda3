"""A sweep's folder: one file for each finished job, so that an interrupted sweep goes on.

A job's file has the job's name, which is a hash, and is written beside and renamed: there is
never half of one. `results.json` holds what does not depend on where or when it was made.
"""

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from models import user_files
from models.studies.sweep.figures import LEARNED

JOBS: Final = "jobs"
RESULTS: Final = "results.json"
TIMES: Final = "times.json"
REPORT: Final = "report.html"

Answer = dict[str, Any]  # "name", "result", "where", "seconds", "cpu_s"


def answers(folder: Path) -> dict[str, Answer]:
    """Return what is finished, by name; what cannot be read is done again."""
    found = {}
    for path in sorted((folder / JOBS).glob("[!.]*.json")):
        with suppress(user_files.UserFileError, KeyError, TypeError, AttributeError):
            answer = user_files.read_json(path)
            if answer["name"] == path.stem and _whole(answer):
                found[path.stem] = answer
    return found


def _whole(answer: Answer) -> bool:
    """Whether a finished job says all that is shown of it."""
    result, spent = answer["result"], (answer["seconds"], answer["cpu_s"])
    counts = [*spent, *(result["learned"][key] for key in LEARNED), result["random"] or 0.0]
    for one in result["held"]:
        counts += [*one.get("frames", ()), *one["events" if "events" in one else "error"]]
        if not (isinstance(one["user"], str) and isinstance(one["session"], str)):
            return False
    notes = result.get("notes", [])
    return (
        bool(result["held"])
        and isinstance(answer["where"], str)
        and isinstance(notes, list)
        and all(isinstance(note, str) for note in notes)
        and all(type(count) in (int, float) for count in counts)
    )


def keep(folder: Path, answer: Mapping[str, Any]) -> None:
    """Write a finished job."""
    user_files.write_text(folder / JOBS / f"{answer['name']}.json", text(answer))


def text(content: Any) -> str:
    """Return JSON, the same for the same content."""
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
