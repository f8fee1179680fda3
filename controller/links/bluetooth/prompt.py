"""Questions at the terminal, beside a running asyncio loop."""

from __future__ import annotations

import asyncio
import sys
import threading


class Prompt:
    """Questions on the standard output, and answers from the standard input."""

    def __init__(self) -> None:
        """Begin to listen; a thread of its own waits for lines, and ends with the program."""
        self._lines: asyncio.Queue[str | None] = asyncio.Queue()
        self._loop = asyncio.get_running_loop()
        threading.Thread(target=self._read, name="console", daemon=True).start()

    def _read(self) -> None:
        line = "-"
        while line:
            try:
                line = sys.stdin.readline() if sys.stdin else ""
            except (OSError, ValueError):  # it was closed
                line = ""
            try:
                self._loop.call_soon_threadsafe(self._lines.put_nowait, line or None)
            except RuntimeError:  # the loop has ended
                return

    async def confirm(self, host: str, digits: str) -> bool:
        """Ask whether both sides show the same digits; the end of the input is a no."""
        while not self._lines.empty():  # typed before the question: no answer to it
            if self._lines.get_nowait() is None:
                return False
        what = f"{host} shows {digits}; is it the same there?" if digits else f"let {host} in?"
        print(f"{what} [y/n] ", end="", flush=True)
        answer = await self._lines.get()
        print(flush=True)
        return (answer or "").strip().lower() in ("y", "yes")
