"""Keep the machine out of the step: no garbage collection in it, and, if asked for, real time."""

import gc
import logging
import os
from collections.abc import Callable
from typing import Final

import numpy as np

PRIORITY: Final = 10  # of SCHED_FIFO; the kernel's own threads have 50 and more
SWEEP_S: Final = 5.0  # between two collections
_SLACK_S: Final = 0.02  # a collection of young objects takes less than 1 ms; there is room for 20

Schedule = Callable[[int, int, "os.sched_param"], None]
_SCHEDULE: Final[Schedule | None] = getattr(os, "sched_setscheduler", None)

_log = logging.getLogger("controller")


class IdleCollector:
    """Collects garbage when there is time for it, and never otherwise."""

    def __init__(self) -> None:
        """Take everything that exists for permanent, and switch automatic collection off."""
        gc.collect()
        gc.freeze()
        gc.disable()
        self._swept_s = 0.0

    def idle(self, now_s: float, left_s: float) -> None:
        """Collect, if it is due and the next frame is far enough away."""
        if left_s >= _SLACK_S and now_s - self._swept_s >= SWEEP_S:
            self._swept_s = now_s
            gc.collect(1)

    def close(self) -> None:
        """Let Python collect by itself again."""
        gc.enable()
        gc.unfreeze()


def reserve() -> None:
    """Let what multiplies matrices for NumPy ask for its memory: 32 MiB of addresses, once.

    It does so at its first product, which would be in the middle of a step, and where they are not
    to be had it does not raise but ends the process.
    """
    square = np.ones((64, 64))
    np.matmul(square, square)


def real_time(schedule: Schedule | None = _SCHEDULE) -> bool:
    """Ask for real-time scheduling of this thread, and return whether it was granted."""
    if schedule is None:
        _log.warning("this system has no real-time scheduling for us; going on without")
        return False
    try:
        schedule(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError as error:
        _log.warning(
            "no real-time scheduling (%s): allow it with `ulimit -r %d`, or LimitRTPRIO= in the "
            "service's unit; going on without",
            error.strerror,
            PRIORITY,
        )
        return False
    return True
