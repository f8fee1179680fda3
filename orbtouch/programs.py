"""Entry points of the five commands: each first makes sure that its packages are ours.

Ctrl+C ends the process at once, without a word, before a command has begun and after it has ended.
"""

# Before Ctrl+C is handled, nothing is imported that Python has not: it would print a trace.
import _signal  # type: ignore[import-not-found]
import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

PACKAGES = ("controller", "host", "models", "tetris")
_USAGE, _INTERRUPTED = 2, 130  # as controller.shared.errors, which may be another one's here


def foreign(root: "Path") -> str:
    """Return a sentence on a package of one of our names that is not in `root`; "" if all are."""
    from importlib.util import find_spec
    from pathlib import Path

    for name in PACKAGES:
        spec = find_spec(name)
        if spec is None:
            return f"the package {name!r} of OrbTouch is missing; install it again"
        places = [Path(place).resolve() for place in spec.submodule_search_locations or ()]
        if places != [root / name]:
            where = places[0] if places else spec.origin
            return (
                f"the package {name!r} that Python finds is not OrbTouch's but another, {where}; "
                "install OrbTouch in an environment of its own (python3 -m venv), and start it "
                f"in a folder without a {name!r} of its own"
            )
    return ""


def _program(name: str) -> "Callable[[], int]":
    def main() -> int:
        ours = _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler  # not under nohup
        if ours:
            _signal.signal(_signal.SIGINT, _end)
        from importlib import import_module
        from pathlib import Path

        if problem := foreign(Path(__file__).resolve().parents[1]):
            print(f"{name}: {problem}", file=sys.stderr)
            return _USAGE
        run = import_module(f"{name}.__main__").main
        if ours:
            _signal.signal(_signal.SIGINT, _signal.default_int_handler)
        try:
            status: int = run()
        finally:
            if ours:
                _signal.signal(_signal.SIGINT, _end)
        return status

    return main


def _end(number: int, frame: object) -> None:
    os._exit(_INTERRUPTED)


controller, host, models, tetris, orbtouch = map(_program, (*PACKAGES, "orbtouch"))
