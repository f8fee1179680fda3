"""The command line: which command is meant, and nothing imported but what it needs."""

import gc
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Final

# What has a command line of its own: its module, whose `main` runs it.
COMMANDS: Final = {
    "install": "controller.shelf.install",
    "key": "controller.key",
    "models": "controller.shelf.models",
    "recordings": "controller.recordings.command",
    "rollback": "controller.shelf.rollback",
    "teach": "controller.teaching.command",
    "pair": "controller.bluetooth.pair",
    "service": "controller.service.unit",
    "status": "controller.service.status",
    "doctor": "controller.doctor.command",
    "calibrate": "controller.calibrate",
}
RUN: Final = "controller.run"  # without a command


def main(argv: Sequence[str] | None = None) -> int:
    """Run `controller` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    words = sys.argv[1:] if argv is None else list(argv)
    named = words[:1] and words[0] in COMMANDS
    # Our matrices are small: NumPy's threads would wait for each other five times as long.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Modules are here to stay: to look for garbage among them took a sixth of the start.
    gc.disable()
    try:
        command = import_module(COMMANDS[words[0]] if named else RUN)
        gc.freeze()
        gc.enable()
        status: int = command.main(words[1:] if named else words)
    finally:
        gc.enable()
        gc.unfreeze()
    return status


if __name__ == "__main__":
    sys.exit(main())
