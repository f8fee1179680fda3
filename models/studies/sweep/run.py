"""Run of a sweep: each missing training in a process of this machine, or on a Dask cluster.

A job says everything that its result depends on, and is named by a hash of that and of the
program's version. Its result is one file, so an interrupted sweep goes on with what is missing.
"""

import hashlib
import io
import json
import os
import platform
import threading
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, redirect_stderr, suppress
from dataclasses import asdict, dataclass
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, cast

from controller.recordings.recording import software
from controller.shared.aliases import Say
from controller.shared.errors import TroubleError, count, output_folder
from models import formatting, processes
from models.results import storage
from models.studies.sweep import report
from models.studies.sweep.plan import Job, Plan

JOBS: Final = "jobs"  # folder of the results, a file each
RESULTS: Final = "results.json"
LETTERS: Final = 24  # of a job's name: 96 bits
ANSWER_S: Final = 10.0  # for a scheduler to answer
WORKERS_S: Final = 30.0  # for the first worker to register

Answer = dict[str, Any]  # "name"; "result", or "failed"; "where", "cpu_s"; JSON

_ALONE: Final = threading.Lock()  # PyTorch's random numbers are the process's, not the thread's


class ClusterError(ValueError):
    """The cluster cannot be used; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """A plan, and where it is run."""

    plan: Plan  # what is trained
    folder: Path  # holds the results
    digest: str = ""  # hash of the recordings and their vocabulary
    places: tuple[str, ...] = ()  # absolute folders of the recordings
    workers: int = 1  # processes on this machine
    cluster: str = ""  # address of a Dask scheduler; "": this machine

    def named(self) -> dict[str, Job]:
        """Return all jobs by name, in the plan's order."""
        own = own_version()
        return {name_of(job, own): job for job in self.plan.jobs(self.digest)}

    def order(self, name: str, job: Job) -> Job:
        """Return a job as it is sent: with its name, our version, and the recordings' place."""
        data = {**job["data"], "folders": list(self.places)}
        return {"name": name, "version": own_version(), "job": {**job, "data": data}}


def run(sweep: Sweep, say: Say) -> dict[str, Any]:
    """Train what is missing; write `RESULTS` and return its content."""
    output_folder(sweep.folder / JOBS)
    named, done = sweep.named(), answers(sweep.folder)
    finished = sum(name in done for name in named)
    say(count(len(named), "training") + (f", {finished} of them done already" if finished else ""))
    failed: dict[str, str] = {}
    began = time.monotonic()
    orders = [sweep.order(name, job) for name, job in named.items() if name not in done]
    for number, answer in enumerate(_answers(sweep, orders), 1):
        if "failed" in answer:
            failed[answer["name"]] = answer["failed"]
            outcome = f"failed: {answer['failed']}"
        else:
            storage.write_text(sweep.folder / JOBS / f"{answer['name']}.json", _json(answer))
            outcome = f"score {report.score(answer['result']):.4g}"
        left = (time.monotonic() - began) / number * (len(orders) - number)
        at = describe(named[answer["name"]])
        say(f"{finished + number}/{len(named)} {at}: {outcome}; {formatting.duration(left)} left")
    found = results(sweep, answers(sweep.folder), failed)
    storage.write_text(sweep.folder / RESULTS, _json(found))
    return found


def results(sweep: Sweep, done: Mapping[str, Answer], failed: Mapping[str, str]) -> dict[str, Any]:
    """Return all results in the plan's order, without where and when they were made."""
    plan = sweep.plan
    return {
        "sweep": plan.name,
        "version": own_version(),
        "axes": plan.axes,
        "data": {**asdict(plan.data), "sha256": sweep.digest},
        "train": plan.train,
        "test": asdict(plan.test),
        "jobs": [
            {"name": name, "at": job["at"], "fold": job["test"]["fold"]}
            | ({"failed": failed[name]} if name in failed else {"result": done[name]["result"]})
            for name, job in sweep.named().items()
        ],
    }


def answers(folder: Path) -> dict[str, Answer]:
    """Return the finished jobs in a sweep's folder, by name; damaged ones are left out."""
    found = {}
    for path in sorted((folder / JOBS).glob("[!.]*.json")):
        with suppress(storage.UserFileError, KeyError, TypeError, AttributeError, ValueError):
            answer = storage.read_json(path)
            if answer["name"] == path.stem:
                report.score(answer["result"])
                found[path.stem] = answer
    return found


def describe(job: Job) -> str:
    """Return a job's place, such as "users 3, seed 1, fold 2"."""
    fold = {"fold": job["test"]["fold"] + 1} if job["test"]["folds"] else {}
    return report.title({**job["at"], **fold})


def name_of(job: Job, version: str) -> str:
    """Return a hash of what a job's result depends on; not of where recordings are."""
    data = {key: value for key, value in job["data"].items() if key != "folders"}
    whole = {"data": data, "test": job["test"], "train": job["train"], "version": version}
    canonical = json.dumps(whole, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()[:LETTERS]


@cache
def own_version() -> str:
    """Return the versions that results depend on: this program, its sources, NumPy, PyTorch."""
    digest = hashlib.sha256()
    for package in ("controller", "models"):
        root = Path(str(files(package)))
        for path in sorted(root.rglob("*"), key=lambda path: path.as_posix()):
            if path.suffix in (".py", ".toml"):
                source = path.read_bytes().replace(b"\r\n", b"\n")
                digest.update(f"{path.relative_to(root).as_posix()}:{len(source)}:".encode())
                digest.update(source)
    numpy, torch = map(_version, ("numpy", "torch"))
    return f"{software()} (sources {digest.hexdigest()[:12]}, NumPy {numpy}, PyTorch {torch})"


def _version(package: str) -> str:
    """Return a package's version, without the suffix of the processor that it was built for."""
    with suppress(PackageNotFoundError):
        return version(package).partition("+")[0]
    return "missing"


def perform(order: Job) -> Answer:
    """Do one job as `Sweep.order` makes it, on any machine; every error becomes a sentence."""
    with _ALONE, redirect_stderr(io.StringIO()):
        began = time.thread_time()
        outcome = _outcome(order)
        cpu_s = time.thread_time() - began
    where = f"{platform.node()} {os.getpid()}"
    return {"name": order["name"], **outcome, "where": where, "cpu_s": cpu_s}


def _outcome(order: Job) -> dict[str, Any]:
    if order["version"] != own_version():
        return {"failed": f"{platform.node()} has {own_version()}, not {order['version']}"}
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # before PyTorch is imported
    try:
        from models.studies.sweep import training

        return {"result": training.train(order["job"])}
    except (ValueError, OSError) as error:
        return {"failed": " ".join(str(error).split())}
    except Exception as error:  # the other jobs go on
        frame = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(frame.filename).name}, line {frame.lineno}"
        return {"failed": f"{type(error).__name__} in {place}: {' '.join(str(error).split())}"}


def _answers(sweep: Sweep, orders: Sequence[Job]) -> Iterator[Answer]:
    """Yield the answers to all orders, in any order; raise ClusterError or TroubleError."""
    if sweep.cluster and orders:
        import distributed

        done = cast(Any, distributed.as_completed)
        with closing(_connected(sweep.cluster)) as client:
            yield from (one.result() for one in done(client.map(perform, orders, pure=False)))
        return
    jobs = {order["name"]: partial(perform, order) for order in orders}
    try:
        yield from (answer for _, answer, _ in processes.completed(jobs, sweep.workers))
    except BrokenProcessPool:
        raise TroubleError(
            "a process died (out of memory?); the same command goes on, with fewer --workers"
        ) from None


def _connected(address: str) -> Any:
    """Return a client of a scheduler; raise ClusterError if it is silent or gets no workers."""
    import distributed

    connect: Any = distributed.Client
    try:
        if not address.rpartition(":")[2].isdigit():
            raise ValueError("it has no port")
        client = connect(address, timeout=ANSWER_S)
    except (OSError, ValueError) as error:
        raise ClusterError(
            f"no Dask scheduler answers at {address!r} ({error}); give HOST:PORT, and start one "
            "with: dask scheduler (orbtouch docs sweeps)"
        ) from None
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except TimeoutError:
        client.close()
        raise ClusterError(
            f"the scheduler has no workers after {WORKERS_S:g} s; start some: dask worker {address}"
        ) from None
    return client


def _json(content: Any) -> str:
    """Return JSON, the same for the same content."""
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
