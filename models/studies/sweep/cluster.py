"""Jobs on a Dask cluster that is there already: its scheduler gives them out, and again if need be.

Only texts travel: a job and its result are JSON, and nothing of ours stays on the cluster.
"""

import json
import logging
import queue
import re
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from models.studies.sweep import version
from models.studies.sweep.perform import perform

ANSWER_S: Final = 10.0  # for a scheduler to answer
WORKERS_S: Final = 30.0  # for a first worker to be there
LOOK_S: Final = 5.0  # between two looks at whether there is anybody left
GONE_S: Final = 60.0  # without a scheduler

ADDRESS: Final = re.compile(r"(?:tcp://|tls://)?(\[[0-9a-fA-F:]+\]|[^:/\s]+):([0-9]{1,5})")

Say = Callable[[str], None]
ADVICE: Final = "start one with: dask scheduler (docs/sweeps.md)"


class ClusterError(ValueError):
    """The cluster cannot be used; the message is one sentence."""


class GoneError(RuntimeError):
    """The cluster went away in between; the message is one sentence."""


def run(orders: Sequence[str], address: str, folders: Sequence[str], say: Say) -> Iterator[str]:
    """Yield the answer to each order, as they come.

    Args:
        orders: What `perform` takes.
        address: The scheduler's: HOST:PORT, or tcp:// or tls:// before it.
        folders: What every worker must be able to read.
        say: Takes lines about the cluster.

    Raises:
        ClusterError: It does not answer, has no workers, or they cannot do this.
        GoneError: It went away.
    """
    with _connected(address) as client:
        _check(client, address, folders, say)
        yield from _answers(client, orders, say)


def _connected(address: str) -> Any:
    """Return a connection to the scheduler."""
    import distributed

    for name in ("distributed", "distributed.client"):  # what matters is said in our own words
        logging.getLogger(name).disabled = True
    parts = ADDRESS.fullmatch(address)
    if parts is None:
        raise ClusterError(
            f"{address!r} is no address of a Dask scheduler; give HOST:PORT, such as 127.0.0.1:8786"
        )
    client: Any = distributed.Client
    try:  # whether anybody is there at all is known at once
        socket.create_connection((parts[1].strip("[]"), int(parts[2])), ANSWER_S).close()
        return client(address, timeout=ANSWER_S, set_as_default=False)
    except (OSError, TimeoutError, OverflowError) as error:
        why = f": {error.strerror}" if isinstance(error, OSError) and error.strerror else ""
        raise ClusterError(f"no Dask scheduler answers at {address}{why}; {ADVICE}") from None


def _check(client: Any, address: str, folders: Sequence[str], say: Say) -> None:
    """Refuse workers that would give other results, and say who they are."""
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except TimeoutError:
        raise ClusterError(
            f"the scheduler at {address} has no workers; start some with: dask worker {address} "
            "--nthreads 1"
        ) from None
    found = client.run(_look, list(folders), on_error="return")
    for worker, what in sorted(found.items()):
        if isinstance(what, BaseException):
            said = str(what).splitlines()[0] if str(what) else type(what).__name__
            raise ClusterError(
                f"the worker {worker} cannot run this program ({said}); install the same version "
                "there, with its [train] extra"
            )
        theirs, missing = what
        if other := version.differences(version.own(), theirs):
            raise ClusterError(
                f"the worker {worker} runs another version: {other}; install one everywhere, and "
                "restart the workers"
            )
        if missing:
            raise ClusterError(
                f"the worker {worker} has no folder {missing[0]}; share it at that place on every "
                "machine, or simulate"
            )
    workers = client.scheduler_info(n_workers=-1)["workers"].values()
    many = "s" if len(found) > 1 else ""
    say(f"{address}: {len(found)} worker{many} of this version")
    if any(worker["nthreads"] > 1 for worker in workers):
        say("some workers have several threads, of which one trains: start them with --nthreads 1")


def _look(folders: list[str]) -> tuple[dict[str, str], list[str]]:
    """Return which version a worker runs, and which folders it does not see."""
    return version.own(), [folder for folder in folders if not Path(folder).exists()]


def _answers(client: Any, orders: Sequence[str], say: Say) -> Iterator[str]:
    names = [json.loads(order)["name"] for order in orders]
    done: queue.SimpleQueue[Any] = queue.SimpleQueue()
    futures = {}
    for name, order in zip(names, orders, strict=True):
        future = client.submit(perform, order, key=f"orbtouch-{name}", pure=False)
        futures[future.key] = (name, future)
        future.add_done_callback(done.put)
    left, waited = set(futures), 0.0
    try:
        while left:
            try:
                future = done.get(timeout=LOOK_S)
            except queue.Empty:
                waited = _look_around(client, waited, say)
                continue
            waited = 0.0
            if future.key in left:
                left.discard(future.key)
                yield _answer(futures[future.key][0], future)
    finally:
        with suppress(Exception):
            client.cancel([futures[key][1] for key in left], force=True)


def _answer(name: str, future: Any) -> str:
    """Return what a job that is over came to."""
    if future.status == "finished":
        return str(future.result(timeout=ANSWER_S))
    if future.status in ("cancelled", "lost"):
        raise GoneError("the scheduler is gone, or has begun anew")
    error = future.exception(timeout=ANSWER_S)
    if type(error).__name__ == "KilledWorker":
        said = "every worker that tried it died (out of memory?)"
    else:
        said = f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"
    return json.dumps({"name": name, "failed": said, "where": "", "seconds": 0.0, "cpu_s": 0.0})


def _look_around(client: Any, waited: float, say: Say) -> float:
    """Return for how long nobody has been there to work, and say so once."""
    if client.status == "running":
        with suppress(Exception):
            if client.scheduler_info()["workers"]:
                return 0.0
        if not waited:
            say("the cluster has no workers left; waiting for one (Ctrl-C ends this)")
    elif waited >= GONE_S or client.status in ("closing", "closed"):
        raise GoneError("the scheduler is gone")
    elif not waited:
        say("the scheduler does not answer; waiting for it")
    return waited + LOOK_S
