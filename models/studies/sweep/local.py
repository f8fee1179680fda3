"""Jobs on this machine's cores, through joblib: a process of one thread for each."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Final

from models import processes
from models.studies.sweep.perform import perform

DEATHS: Final = 3  # in a row without a finished job between them

Say = Callable[[str], None]


def run(orders: Sequence[str], workers: int, say: Say) -> Iterator[str]:
    """Yield the answer to each order, as they come; one whose process keeps dying has none.

    Args:
        orders: What `perform` takes.
        workers: Processes.
        say: Takes lines about what happens to them.
    """
    processes.spare()
    if workers == 1 or len(orders) == 1:
        yield from map(perform, orders)
        return
    yield from _processes(orders, workers, say)


def _processes(orders: Sequence[str], workers: int, say: Say) -> Iterator[str]:
    from joblib import Parallel, delayed, parallel_config
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    left = dict(enumerate(orders))
    deaths = 0
    try:
        while left and deaths < DEATHS:
            call = [delayed(_numbered)(number, order) for number, order in left.items()]
            try:
                with parallel_config("loky", n_jobs=workers, inner_max_num_threads=1):
                    with processes.deaf():
                        each = Parallel(return_as="generator_unordered", batch_size=1)(call)
                    for number, answer in each:
                        del left[number]
                        deaths = 0
                        yield answer
            except TerminatedWorkerError:
                deaths += 1
                say(f"a process died (out of memory?); begun again: {len(left)}")
    finally:
        with suppress(Exception):  # nothing of ours stays behind
            get_reusable_executor().shutdown(wait=True, kill_workers=True)


def _numbered(number: int, order: str) -> tuple[int, str]:
    return number, perform(order)
