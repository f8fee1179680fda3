"""Programs that are killed between any two calls of the system with which they write files."""

import io
import itertools
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from typing import Any, Final

_CALLS: Final = ("open", "mkdir", "stat", "unlink", "rmdir", "link", "rename", "replace", "fsync")
_FORK: Final = multiprocessing.get_context("fork")


def at_each_call(work: Callable[[], object], prepare: Callable[[], object]) -> Iterator[int]:
    """Do `prepare` here and `work` in a child that is killed before its call 0, 1, 2 ...

    Yield the number after each killed child, and end after the first that was not killed.
    A write is two calls, each of half of the bytes. Needs fork.
    """
    for last in itertools.count():
        prepare()
        child = _FORK.Process(target=_until, args=(work, last))
        child.start()
        child.join()
        if child.exitcode == 0:
            return
        assert child.exitcode == -signal.SIGKILL, f"exit status {child.exitcode}"
        yield last


def _until(work: Callable[[], object], last: int) -> None:
    """Do the work, and kill this process before a call."""
    numbers = itertools.count()

    def tick() -> None:
        if next(numbers) == last:
            os.kill(os.getpid(), signal.SIGKILL)

    def ticking(call: Callable[..., Any]) -> Callable[..., Any]:
        def counted(*args: Any, **options: Any) -> Any:
            tick()
            return call(*args, **options)

        return counted

    class Halved(io.FileIO):
        def write(self, data: Any) -> int:
            half = memoryview(data)[: (len(data) + 1) // 2]
            tick()
            return super().write(half)  # who writes does so again with what is left

    plain = io.open

    def opened(file: Any, mode: str = "r", buffering: int = -1, *text: Any) -> Any:
        tick()
        if not set(mode) & set("wax+"):
            return plain(file, mode, buffering, *text)
        raw = Halved(file, mode.replace("b", ""))
        if buffering == 0:
            return raw
        buffered = io.BufferedRandom(raw) if "+" in mode else io.BufferedWriter(raw)
        return buffered if "b" in mode else io.TextIOWrapper(buffered, *text)

    for name in _CALLS:
        setattr(os, name, ticking(getattr(os, name)))
    io.open = opened  # type: ignore[assignment]
    os.fdopen = opened  # type: ignore[assignment]
    work()
