"""Yes-no prompt at the terminal for an asyncio program."""

from __future__ import annotations

import asyncio
import sys
import threading


class Prompt:
    """Prompt on the standard output; a daemon thread reads the standard input."""

    def __init__(self) -> None:
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
        """Return whether the user confirms a pairing; False at the end of the input."""
        while not self._lines.empty():  # lines typed before the prompt
            if self._lines.get_nowait() is None:
                return False
        question = f"{host} shows {digits}; is it the same there?" if digits else f"let {host} in?"
        print(f"{question} [y/n] ", end="", flush=True)
        answer = await self._lines.get()
        print(flush=True)
        return (answer or "").strip().lower() in ("y", "yes")
