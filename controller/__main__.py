"""The command line: dispatch to a command, and import nothing but what it needs."""

import gc
import os
import sys
from collections.abc import Sequence
from importlib import import_module

from controller.commands import COMMANDS, RUN
from controller.console import USAGE, complain, importing, run


def main(argv: Sequence[str] | None = None) -> int:
    """Run `controller` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    words = sys.argv[1:] if argv is None else list(argv)
    name = words[0] if words and not words[0].startswith("-") else None
    if name is not None and name not in COMMANDS:
        return complain("controller", _unknown(name), USAGE)
    module = RUN if name is None else COMMANDS[name][0]
    # Our matrices are small: NumPy's threads would wait for each other five times as long.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Modules are here to stay: to look for garbage among them took a sixth of the start.
    gc.disable()
    try:
        with importing():
            command = import_module(module)
        gc.freeze()
        gc.enable()
        return run("controller", lambda: command.main(words if name is None else words[1:]))
    finally:
        gc.enable()
        gc.unfreeze()


def _unknown(name: str) -> str:
    """Return what to say of a command that does not exist."""
    from difflib import get_close_matches

    near = get_close_matches(name, COMMANDS, 1)
    advice = f"did you mean `controller {near[0]}`?" if near else f"there are {', '.join(COMMANDS)}"
    return f"there is no command {name!r}; {advice}"


if __name__ == "__main__":
    sys.exit(main())
