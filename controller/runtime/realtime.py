"""Low jitter of a frame: garbage collection between frames, and real-time scheduling."""

import gc
import logging
import os
from collections.abc import Callable
from typing import Final

import numpy as np

PRIORITY: Final = 10  # of SCHED_FIFO; kernel threads have 50 and more
COLLECT_S: Final = 5.0  # between two collections
_SLACK_S: Final = 0.02  # least idle time; a collection of young objects takes less than 1 ms

Schedule = Callable[[int, int, "os.sched_param"], None]
_SCHEDULE: Final[Schedule | None] = getattr(os, "sched_setscheduler", None)

_log = logging.getLogger("controller")


class IdleCollector:
    """Garbage collection in the idle time between frames only."""

    def __init__(self) -> None:
        """Freeze all present objects, and switch automatic collection off."""
        gc.collect()
        gc.freeze()
        gc.disable()
        self._collected_s = 0.0

    def idle(self, now_s: float, left_s: float) -> None:
        """Collect, if it is due and the next frame is far enough away."""
        if left_s >= _SLACK_S and now_s - self._collected_s >= COLLECT_S:
            self._collected_s = now_s
            gc.collect(1)

    def close(self) -> None:
        """Switch automatic collection on again."""
        gc.enable()
        gc.unfreeze()


def reserve() -> None:
    """Make NumPy's BLAS allocate its memory now: 32 MiB of addresses, once.

    It allocates at its first product, which would be during a frame, and ends the process if that
    fails.
    """
    square = np.ones((64, 64))
    np.matmul(square, square)


def real_time(schedule: Schedule | None = _SCHEDULE) -> bool:
    """Request real-time scheduling of this thread; return whether it was granted."""
    if schedule is None:
        _log.warning("this system has no real-time scheduling; continuing without")
        return False
    try:
        schedule(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError as error:
        _log.warning(
            "no real-time scheduling (%s): allow it with `ulimit -r %d`, or LimitRTPRIO= in the "
            "service's unit; continuing without",
            error.strerror,
            PRIORITY,
        )
        return False
    return True
