"""A whole sweep: what is there already, what is missing, and what came of it."""

import json
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from controller.console import count
from models import text as words
from models import user_files
from models.studies.sweep import jobs, kept, version
from models.studies.sweep.plan import Plan

Engine = Callable[[Sequence[str]], Iterator[str]]  # orders -> answers, in any order
Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Sweep:
    """What was asked for.

    Attributes:
        plan: The file.
        folder: Where results are.
        digest: hash of the recordings and their vocabulary; "" where people are simulated.
        places: Where the recordings are.
    """

    plan: Plan
    folder: Path
    digest: str = ""
    places: tuple[str, ...] = ()

    def named(self) -> dict[str, jobs.Job]:
        """Return all jobs by name, in the plan's order."""
        own = version.own()
        return {jobs.name(job, own): job for job in jobs.jobs(self.plan, self.digest)}


def run(sweep: Sweep, engine: Engine, say: Say) -> dict[str, Any]:
    """Do what is missing; write and return the results.

    Args:
        sweep: What was asked for.
        engine: Does jobs.
        say: Takes lines of progress.

    Returns:
        What `results` returns.
    """
    user_files.folder_target(sweep.folder / kept.JOBS)
    named = sweep.named()
    there = kept.answers(sweep.folder)
    missing = [name for name in named if name not in there]
    _announce(named, there, missing, say)
    orders = [order(sweep, name, named[name]) for name in missing]
    failed: dict[str, str] = {}
    noted: set[str] = set()
    began = time.monotonic()
    for number, text in enumerate(engine(orders) if orders else (), 1):
        answer = json.loads(text)
        job = named[answer["name"]]
        if "failed" in answer:
            failed[answer["name"]] = answer["failed"]
        else:
            kept.keep(sweep.folder, answer)
            for note in answer["result"].get("notes", ()):
                if note not in noted:
                    noted.add(note)
                    say(note)
        left = len(missing) - number
        line = f"{len(named) - left}/{len(named)} {jobs.words(job)}: {_outcome(answer)}"
        if left:
            line += f"; {words.duration((time.monotonic() - began) / number * left)} left"
        say(line)
    there = kept.answers(sweep.folder)
    for name in named:
        if name not in there:
            failed.setdefault(name, "its process died again and again (out of memory?)")
    found = results(sweep, named, there, failed)
    user_files.write_text(sweep.folder / kept.RESULTS, kept.text(found))
    user_files.write_text(sweep.folder / kept.TIMES, kept.text(times(named, there)))
    return found


def order(sweep: Sweep, name: str, job: jobs.Job) -> str:
    """Return a job as it travels: with its name, our version, and where recordings are."""
    data = {**job["data"], "folders": list(sweep.places)} if sweep.places else job["data"]
    said = {"name": name, "version": version.own(), "job": {**job, "data": data}}
    return json.dumps(said, sort_keys=True)


def results(
    sweep: Sweep, named: dict[str, jobs.Job], there: dict[str, kept.Answer], failed: dict[str, str]
) -> dict[str, Any]:
    """Return what came of it, in the plan's order: nothing in it hangs on where and when."""
    return {
        "sweep": sweep.plan.name,
        "version": version.own(),
        "axes": {name: list(values) for name, values in sweep.plan.axes},
        "data": {**sweep.plan.data, **({"sha256": sweep.digest} if sweep.digest else {})},
        "train": sweep.plan.train,
        "test": sweep.plan.test,
        "jobs": [
            {"name": name, **_place(job), **_came(name, there, failed)}
            for name, job in named.items()
        ],
    }


def times(named: Iterable[str], there: dict[str, kept.Answer]) -> dict[str, Any]:
    """Return where and for how long each job ran."""
    told = ("where", "seconds", "cpu_s")
    return {name: {key: there[name][key] for key in told} for name in named if name in there}


def _place(job: jobs.Job) -> dict[str, Any]:
    return {"at": job["at"], "fold": job["test"]["fold"]}


def _came(name: str, there: dict[str, kept.Answer], failed: dict[str, str]) -> dict[str, Any]:
    return {"result": there[name]["result"]} if name in there else {"failed": failed[name]}


def _announce(
    named: dict[str, jobs.Job], there: Iterable[str], missing: Sequence[str], say: Say
) -> None:
    done = len(named) - len(missing)
    others = sum(name not in named for name in there)
    say(count(len(named), "training") + (f", {done} of them done already" if done else ""))
    if others:
        say(f"of other settings or another version, and not used: {others} finished there")


def _outcome(answer: dict[str, Any]) -> str:
    if "failed" in answer:
        return f"failed: {answer['failed']}"
    held = answer["result"]["held"]
    if "events" in held[0]:
        right, whole = (sum(one["events"][i] for one in held) for i in (0, 1))
        return f"{right} of {whole} unseen events named rightly"
    error, count = (sum(one["error"][i] for one in held) for i in (0, 1))
    return f"unseen touches {error / max(1, count):.3f} grid units off"
