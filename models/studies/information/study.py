"""All parts of all sets, measured on every core; what was found is kept, and not measured again."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from models import processes
from models.studies.information import check
from models.studies.information.parts import parts
from models.studies.information.results import Found, keep, load
from models.studies.information.sets import RecordingSet

CHECK: Final = "check"

Say = Callable[[str], None]


def measure(
    sets: Sequence[RecordingSet],
    only: Sequence[str],
    workers: int,
    path: Path | None,
    say: Say,
    *,
    checked: bool = False,
) -> Found:
    """Return everything, measuring what was not found yet.

    Args:
        sets: What is measured.
        only: Parts whose names begin with one of these; none: all.
        workers: Processes.
        path: Where results are kept after each part, so that what is interrupted goes on; None:
            nowhere.
        say: Takes lines of progress.
        checked: Also tries the estimators on what is known.
    """
    found = load(path)
    told = {one.name: repr((one.paths, one.choice, one.quick)) for one in sets}
    for name, settings in told.items():  # what was measured of something else is forgotten
        if found.setdefault("settings", {}).get(name, settings) != settings:
            found["parts"] = {k: v for k, v in found["parts"].items() if k.split("|")[0] != name}
        found["settings"][name] = settings
    jobs: dict[str, Callable[[], Any]] = {}
    for one in sets:
        for name, part in parts(one).items():
            if not only or any(name.startswith(wanted) for wanted in only):
                jobs[f"{one.name}|{name}"] = part
    jobs = {key: job for key, job in jobs.items() if key not in found["parts"]}
    if checked and not found["check"]:
        jobs |= {f"{CHECK}|{name}": job for name, job in check.jobs()}
    rows: dict[str, list[Any]] = {}
    begun = time.monotonic()
    for done, (key, result) in enumerate(_work(jobs, workers), 1):
        left_s = (time.monotonic() - begun) / done * (len(jobs) - done)
        say(f"{done}/{len(jobs)} {key.replace('|', ': ')}; {left_s:.0f} s left")
        if key.startswith(f"{CHECK}|"):
            rows[key] = [asdict(row) for row in result]
            if len(rows) == sum(name.startswith(f"{CHECK}|") for name in jobs):
                found["check"] = [row for name in jobs for row in rows.get(name, [])]
        else:
            found["parts"][key] = result
        keep(path, found)
    return found


def _work(jobs: Mapping[str, Callable[[], Any]], workers: int) -> Iterator[tuple[str, Any]]:
    """Do everything, and yield each result as it comes."""
    if workers == 1 or len(jobs) < 2:
        for key, job in jobs.items():
            yield key, job()
        return
    with processes.pool(min(workers, len(jobs)), hasty=True) as pool:
        waiting: dict[Future[Any], str] = {pool.submit(job): key for key, job in jobs.items()}
        for done in as_completed(waiting):
            yield waiting[done], done.result()
