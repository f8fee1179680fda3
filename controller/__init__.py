"""The device: from capacitance to command."""

import _signal  # type: ignore[import-not-found]  # `signal` itself imports for 10 ms
import os

__version__ = "0.1.0"  # of the whole program; pyproject.toml reads it here


class importing:  # noqa: N801 (it reads like a function: with importing():)
    """Exits at once, with status 130 and without a traceback, on Ctrl+C inside its context.

    A KeyboardInterrupt is no use there: what imports a module in C turns it into an ImportError.
    """

    def __enter__(self) -> None:
        """Replace Python's own handler; another, or none as under nohup, stays."""
        self._ours = _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler
        if self._ours:
            _signal.signal(_signal.SIGINT, lambda number, frame: os._exit(130))

    def __exit__(self, *problem: object) -> None:
        """Put Python's own handler back."""
        if self._ours:
            _signal.signal(_signal.SIGINT, _signal.default_int_handler)
