"""Thread that registers services with BlueZ, again whenever bluetoothd or the adapter returns.

A registration lasts until bluetoothd, the adapter or the bus is lost. Then the connection to the
bus is closed, which removes it from BlueZ.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any, Final

from controller.links.base import Link
from controller.shared.bluetooth.bluez import (
    ADAPTER,
    DEVICE,
    BluetoothError,
    Bus,
    Properties,
)

if TYPE_CHECKING:
    from controller.shared.bluetooth.pairing_agent import PairingAgent

RETRY_S: Final = 2.0  # between two attempts while something is missing
START_S: Final = 15.0  # for the first attempt: bluetoothd may be about to start

log = logging.getLogger(__name__)


class Registration(ABC):
    """A service to register with BlueZ. All methods run on the thread's loop."""

    @abstractmethod
    async def begin(self, bus: Bus, adapter: str) -> None:
        """Register over a new connection, on a powered adapter, or raise BluetoothError."""

    @abstractmethod
    async def end(self) -> None:
        """Release the bus, which may be lost already."""


class RegistrationThread:
    """An asyncio loop on its own thread, which keeps a service registered.

    Attributes:
        state: "ready", or a sentence about what is missing.
    """

    def __init__(self, service: Registration, adapter: str = "") -> None:
        """Prepare to register a service on an adapter (hci0, or its address; "": the first)."""
        self.state = "starting"
        self._service = service
        self._name = adapter
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="bluetooth", daemon=True)
        self._first: concurrent.futures.Future[None] = concurrent.futures.Future()
        self._closing = asyncio.Event()
        self._agent: PairingAgent | None = None
        self._adapter = ""
        self._off = False  # the adapter was switched off on purpose

    def start(self) -> None:
        """Start the thread, and wait for the first registration; BluetoothError ends it."""
        self._thread.start()
        try:
            self._first.result(timeout=START_S)
        except TimeoutError:
            self.close()
            raise BluetoothError(f"BlueZ did not answer within {START_S:g} s") from None
        except BluetoothError:
            self.close()
            raise

    def pair(self, seconds: int) -> None:
        """Open the pairing window, without waiting; no effect while BlueZ is not running."""
        self.submit(self._pair(seconds))

    def submit(self, task: Coroutine[Any, Any, Any]) -> None:
        """Run a task on the loop, without waiting; a BluetoothError is logged."""
        asyncio.run_coroutine_threadsafe(logged(task), self._loop)

    def close(self) -> None:
        """Unregister the service, and end the thread."""
        if self._thread.is_alive():
            with contextlib.suppress(RuntimeError):  # the loop has just ended
                self._loop.call_soon_threadsafe(self._closing.set)
            self._thread.join()

    # --- on the thread ---

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._keep_registered())
        except BaseException as error:
            self.state = "the Bluetooth thread has died"
            log.exception("the Bluetooth thread has died")
            if not self._first.done():
                self._first.set_exception(error)
        finally:
            self._loop.close()

    async def _keep_registered(self) -> None:
        while not self._closing.is_set():
            try:
                bus = await Bus.connect()
                try:
                    await self._serve(bus)
                finally:
                    if self._agent is not None:
                        await self._agent.unregister()
                    self._agent, self._adapter = None, ""
                    await self._service.end()
                    bus.close()
            except BluetoothError as error:
                self._missing(error)
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._closing.wait(), RETRY_S)

    async def _serve(self, bus: Bus) -> None:
        """Register agent and service, and return when BlueZ, the adapter or the bus is lost."""
        adapter = await bus.adapter(self._name)
        over = asyncio.Event()

        def follow(path: str, interface: str, changes: Properties | None) -> None:
            ours = path == adapter and interface == ADAPTER
            lost = path == "" or (ours and changes is None)  # BlueZ itself is path ""
            off = ours and changes is not None and changes.get("Powered") is False
            self._off = self._off or off
            if lost or off:
                over.set()
            host = path.startswith(adapter + "/") and interface == DEVICE
            if host and changes and changes.get("Paired") and self._agent and self._agent.open:
                self.submit(bus.set(path, DEVICE, "Trusted", "b", True))

        bus.listen(follow)
        await self._power(bus, adapter)
        await self._register(bus, adapter)
        self.state = "ready"
        if not self._first.done():
            self._first.set_result(None)
        log.info("Bluetooth is ready on %s", adapter.rpartition("/")[2])
        ends = [
            asyncio.create_task(each) for each in (over.wait(), bus.lost(), self._closing.wait())
        ]
        await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
        for task in ends:
            task.cancel()
        if not self._closing.is_set():
            self.state = "Bluetooth was lost"
            log.warning("Bluetooth on %s was lost; waiting for it", adapter.rpartition("/")[2])

    async def _power(self, bus: Bus, adapter: str) -> None:
        """Switch the adapter on, unless it was switched off on purpose."""
        if await bus.get(adapter, ADAPTER, "Powered"):
            self._off = False
        elif self._off:
            raise BluetoothError("the adapter was switched off; bluetoothctl power on")
        await bus.switch_on(adapter)

    async def _register(self, bus: Bus, adapter: str) -> None:
        from controller.shared.bluetooth.pairing_agent import NO_SCREEN, PairingAgent

        self._agent = agent = PairingAgent(bus)
        await agent.register(NO_SCREEN)
        await agent.close_window(adapter)
        await self._service.begin(bus, adapter)
        self._adapter = adapter

    async def _pair(self, seconds: int) -> None:
        if self._agent is not None and self._adapter:
            await self._agent.open_window(self._adapter, seconds)

    def _missing(self, error: BluetoothError) -> None:
        """Log an error that prevents the registration, once."""
        if not self._first.done():
            self._first.set_exception(error)
            self._closing.set()
        elif self.state != str(error):
            log.warning("Bluetooth is not ready: %s", error)
        self.state = str(error)


async def logged(task: Coroutine[Any, Any, Any]) -> None:
    """Run a task; a BluetoothError is logged."""
    try:
        await task
    except BluetoothError as error:
        log.warning("Bluetooth: %s", error)


class BluetoothLink(Link):
    """A link whose service a registration thread keeps registered."""

    _registration: RegistrationThread

    @property
    def state(self) -> str:
        """Return "ready", or a sentence about what is missing."""
        return self._registration.state

    def pair(self, seconds: int) -> None:
        """Open the pairing window, without waiting."""
        self._registration.pair(seconds)
