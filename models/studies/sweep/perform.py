"""One job, wherever it runs: a text in, a text out. What goes wrong comes back as a sentence."""

import contextlib
import io
import json
import os
import platform
import threading
import time
import traceback
from pathlib import Path
from typing import Any

from models.studies.sweep import version

# PyTorch's random numbers are the process's: of two jobs in threads of one, one waits.
_ALONE = threading.Lock()


def perform(order: str) -> str:
    """Train what an order says.

    Args:
        order: JSON: "name", "job" and "version" of the program that sent it.

    Returns:
        JSON: "name"; "result", or "failed" (a sentence); "where"; "seconds" and "cpu_s".
    """
    asked = json.loads(order)
    with _ALONE, contextlib.redirect_stderr(io.StringIO()):
        began, cpu = time.monotonic(), time.thread_time()
        outcome = _outcome(asked)
        spent = {"seconds": time.monotonic() - began, "cpu_s": time.thread_time() - cpu}
    where = f"{platform.node()} {os.getpid()}"
    return json.dumps({"name": asked["name"], **outcome, "where": where, **spent})


def _outcome(asked: dict[str, Any]) -> dict[str, Any]:
    other = version.differences(asked["version"], version.own())
    if other:
        return {
            "failed": f"{platform.node()} runs another version: {other}; install one everywhere"
        }
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # before PyTorch wakes up
    try:
        from models.studies.sweep import training

        return {"result": training.train(asked["job"])}
    except (ValueError, OSError) as error:
        return {"failed": " ".join(str(error).split())}
    except Exception as error:  # one of many: the others shall go on
        frame = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(frame.filename).name}, line {frame.lineno}"
        said = " ".join(str(error).split())[:300]
        return {"failed": f"{type(error).__name__} in {place}: {said}"}
