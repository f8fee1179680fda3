"""Pool of processes with one thread each, which end with their parent."""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Hashable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Final, TypeVar

Key = TypeVar("Key", bound=Hashable)
Result = TypeVar("Result")

# What libraries ask for how many threads they may take.
THREADS: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def deaf() -> Iterator[None]:
    """Let processes that begin in here never get Ctrl-C; ours comes afterwards."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def completed(
    jobs: Mapping[Key, Callable[[], Result]], workers: int
) -> Iterator[tuple[Key, Result, float]]:
    """Run jobs that can be pickled, and yield key, result and the seconds left as each is done.

    One worker is this process; more are processes of one thread each, which end with it at once.
    """
    begun = time.monotonic()
    for done, (key, result) in enumerate(_results(jobs, min(workers, len(jobs))), 1):
        yield key, result, (time.monotonic() - begun) / done * (len(jobs) - done)


def _results(
    jobs: Mapping[Key, Callable[[], Result]], workers: int
) -> Iterator[tuple[Key, Result]]:
    if workers < 2:
        yield from ((key, job()) for key, job in jobs.items())
        return
    for variable in THREADS:  # unless the environment has another number
        os.environ.setdefault(variable, "1")
    context = multiprocessing.get_context("spawn")
    made = ProcessPoolExecutor(workers, mp_context=context, initializer=_serve)
    try:
        with deaf():
            waiting = {made.submit(job): key for key, job in jobs.items()}
        yield from ((waiting[done], done.result()) for done in as_completed(waiting))
    except BaseException:
        made.shutdown(wait=False, cancel_futures=True)
        for child in multiprocessing.active_children():
            child.terminate()  # nothing that it does is worth waiting for
        raise
    made.shutdown()


def _serve() -> None:
    """Prepare a process: Ctrl-C is its parent's, and it does not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow, daemon=True).start()


def _follow() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
