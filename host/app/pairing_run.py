"""A pairing with a Bluetooth orb on a thread of its own, with its messages and questions."""

import asyncio
import contextlib
import sys
import threading
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Final

from controller.shared.bluetooth import bluez
from controller.shared.errors import how_to_install
from host.connection import pairing
from host.connection.pairing import BY_SYSTEM, Confirm, Tell

Pair = Callable[[Tell, Confirm], Awaitable[str]]
CANCELLED: Final = "cancelled"


def lack() -> str:
    """Return why this system cannot pair from here; "": it can."""
    if sys.platform in BY_SYSTEM:
        return BY_SYSTEM[sys.platform]
    return "" if bluez.available() else f"pairing needs dbus-fast; {how_to_install('bluetooth')}"


class PairingRun:
    """One pairing.

    Attributes:
        lines: What it has said, oldest first.
        question: Name and six digits of an orb that wait for `answer`; None: no question.
        url: Of the orb, once it is paired; "" before.
        over: Whether it has ended.
    """

    def __init__(self, pair: Pair = pairing.pair) -> None:
        self.lines: list[str] = []
        self.question: tuple[str, str] | None = None
        self.url, self.over = "", False
        self._pair = pair
        self._loop: asyncio.AbstractEventLoop | None = None
        self._task: asyncio.Task[str] | None = None
        self._answer: asyncio.Future[bool] | None = None

    def start(self) -> None:
        """Begin on a thread."""
        threading.Thread(target=self.run, name="pairing", daemon=True).start()

    def run(self) -> None:
        """Pair, until it is done, fails or is cancelled."""
        if problem := lack():
            self.lines += problem.splitlines()
        else:
            try:
                self.url = asyncio.run(self._main())
            except asyncio.CancelledError:
                self.lines.append(CANCELLED)
            except (bluez.BluetoothError, OSError) as error:
                self.lines.append(str(error))
        self.over, self.question = True, None

    async def _main(self) -> str:
        self._loop = asyncio.get_running_loop()
        self._task = asyncio.ensure_future(self._pair(self.lines.append, self._confirm))
        return await self._task

    async def _confirm(self, orb: str, digits: str) -> bool:
        self._answer = asyncio.get_running_loop().create_future()
        self.question = orb, digits
        return await self._answer

    def answer(self, same: bool) -> None:
        """Answer the question whether the digits are the same."""
        answer, self.question = self._answer, None
        if answer is not None:
            self._call(partial(answer.set_result, same))

    def cancel(self) -> None:
        """End it; nothing once it is over."""
        task = self._task
        if task is not None and not self.over:
            self._call(task.cancel)

    def _call(self, function: Callable[[], object]) -> None:
        if self._loop is not None:
            with contextlib.suppress(RuntimeError):  # it has just ended
                self._loop.call_soon_threadsafe(function)
