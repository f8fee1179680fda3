"""Link thread behind `poll()`: connects, receives, keeps alive, and connects again.

    receiver = Receiver(lambda: open_transport("/dev/ttyACM0"))
    receiver.connect()  # or start(), to keep trying from the first
    while playing:
        for news in receiver.poll(): ...

What arrives crosses to the program's thread through a bounded queue; what the program sends goes
out on its own thread, as far as the port takes it without waiting.
"""

from __future__ import annotations

import contextlib
import logging
import random
import secrets
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from controller.shared.errors import count
from controller.shared.protocol.auth import NONCE
from controller.shared.protocol.host_session import HostSession
from controller.shared.protocol.link_events import Connected as Connected
from controller.shared.protocol.link_events import Delivered as Delivered
from controller.shared.protocol.link_events import Lost as Lost
from controller.shared.protocol.link_events import Missed as Missed
from controller.shared.protocol.link_events import Received as Received
from controller.shared.protocol.link_events import Refused as Refused
from controller.shared.protocol.link_events import Stale as Stale
from controller.shared.protocol.link_events import pause_s
from controller.shared.protocol.messages import Command, ContactState, Message, Welcome
from controller.shared.protocol.retransmit import SessionHistory
from controller.shared.request_queue import RequestQueue
from host.connection.transport import LinkError as LinkError
from host.connection.transport import Transport

INBOX = 65_536  # news that may wait for `poll`; a program that lets more wait has hung
LATE_MS = 500  # commands and contacts that waited longer for `poll` are dropped
CONNECT_S = 30.0  # for the first connection: an orb of our own needs seconds to start

log = logging.getLogger(__name__)

Listener = Callable[[Sequence[Received]], None]  # takes items, oldest first, without waiting


def ever_connected(received: Sequence[Received], before: bool) -> bool:
    """Return whether there was a connection, now or `before`.

    LinkError if the first one failed; later ones are tried again and again.
    """
    for item in received:
        if isinstance(item, Refused) and not before:
            raise LinkError(item.reason)
        before = before or isinstance(item, Connected | Lost)  # Lost: another orb was chosen
    return before


class _Way(NamedTuple):
    open: Callable[[], Transport]
    token: str
    key: bytes


class Receiver:
    """A link that reconnects by itself.

    Attributes:
        state: "connecting" at first; "live"; "stale" when nothing came for 300 ms; "lost" from the
            loss to the next Connected.
        past: What is known of the device's commands, across connections.
        bytes_received, bytes_sent: Over the port, across connections.
    """

    def __init__(
        self,
        open_transport: Callable[[], Transport],
        *,
        token: str = "",
        granted: bool = False,
        key: bytes = b"",
    ) -> None:
        """Prepare; `connect` or `start` begins.

        Args:
            open_transport: Opens the port, within seconds, or raises OSError whose text is a
                sentence for the user. Called on the thread, for every attempt.
            token: The one-time token of the device.
            granted: Whether we shall own the device's clock, see `Grant`.
            key: What every frame is sealed with, on both ends; b"": frames are not sealed.
        """
        self.state = "connecting"
        self.bytes_received = self.bytes_sent = 0
        self._listeners: list[tuple[Listener, type]] = []
        self._way = _Way(open_transport, token, key)
        self._granted = granted
        self.past = SessionHistory(host_nonce=secrets.randbits(32) or 1)
        self._inbox: RequestQueue[tuple[int, Received]] = RequestQueue()
        self._lock = threading.Lock()  # guards session and transport
        self._session: HostSession | None = None
        self._transport: Transport | None = None
        self._closing = threading.Event()
        self._hurry = threading.Event()  # ends the pause before the next attempt
        self._failure: BaseException | None = None
        self._refusal = ""  # the last one reported, which is not repeated
        self._thread = threading.Thread(target=self._run, name="receiver", daemon=True)

    @property
    def clock_offset_ms(self) -> int | None:
        """The device's time, as its messages carry it, minus our monotonic clock; None: unknown."""
        with self._lock:
            return None if self._session is None else self._session.clock_offset_ms

    def subscribe(self, listener: Listener, kind: type = object) -> None:
        """Pass what `poll` returns to a listener first, if an item is of this kind."""
        self._listeners.append((listener, kind))

    def start(self) -> None:
        """Begin to connect, and keep trying."""
        self._thread.start()

    def connect(self, timeout_s: float = CONNECT_S) -> Welcome:
        """Begin, and wait for the outcome of the first attempt; `poll` returns it again.

        LinkError if it failed; the receiver is closed.
        """
        self.start()
        match self._inbox.wait(timeout_s):
            case (_, Connected(welcome=welcome)):
                return welcome
            case (_, Refused(reason=reason)):
                outcome = reason
            case _:
                outcome = f"the orb did not answer within {timeout_s:g} s; restart it"
        self.close()
        self._raise_failure()
        raise LinkError(outcome)

    def reopen(
        self, open_transport: Callable[[], Transport], *, token: str = "", key: bytes = b""
    ) -> None:
        """Leave the device, and connect to another one; `poll` returns Lost first.

        The arguments are those of the constructor. An attempt under way is thrown away.
        """
        with self._lock:
            self._way = way = _Way(open_transport, token, key)
            self.past = SessionHistory(host_nonce=secrets.randbits(32) or 1)
            self._refusal = ""
            if self._transport is not None:
                self._transport.wake()
        self._tell([Lost("another orb was chosen")], way)
        self._hurry.set()

    def poll(self) -> list[Received]:
        """Return what is new, oldest first, without waiting."""
        self._raise_failure()
        oldest_ms = 0 if self._granted else _now_ms() - LATE_MS
        received: list[Received] = []
        for arrived_ms, news in self._inbox.take():
            message = news.message if isinstance(news, Delivered) else None
            late = arrived_ms < oldest_ms
            if late and isinstance(message, Command):
                with self._lock:
                    self.past.missed += 1
                received.append(Missed(1))
            elif not (late and isinstance(message, ContactState) and message.fingers):
                received.append(news)
        for listener, kind in self._listeners:
            if any(isinstance(item, kind) for item in received):
                listener(received)
        return received

    def send(self, message: Message) -> bool:
        """Send without waiting; return False if no session is live, and it is dropped.

        ProtocolError if the wire cannot carry it.
        """
        with self._lock:
            session, transport = self._session, self._transport
            if session is None or transport is None or not session.send(message, _now_ms()):
                return False
            # If the port has gone, the thread notices, too, and reports it.
            with contextlib.suppress(OSError):
                self._flush(session, transport)
                return True
            return False

    def wait(self, timeout_s: float) -> None:
        """Return when there is something to poll, or after the timeout."""
        self._inbox.wait(timeout_s)

    def close(self) -> None:
        """Send Bye, and end the thread."""
        self._closing.set()
        self._hurry.set()
        with self._lock:
            if self._transport is not None:
                self._transport.wake()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)  # an opening port may hold it; it ends with the program

    def _raise_failure(self) -> None:
        """Raise the error that ended the thread, if any: a fault of ours, to be seen and mended."""
        if self._failure:
            raise RuntimeError("the receiver's thread has died") from self._failure

    # --- the thread's side ---

    def _run(self) -> None:
        failures = 0
        try:
            while not self._closing.is_set():
                failures = 0 if self._attempt() else failures + 1
                seconds = pause_s(failures, random.random())
                # Also until the program listens again.
                while not self._hurry.wait(seconds) and len(self._inbox) > INBOX // 2:
                    pass
                self._hurry.clear()
        except BaseException as error:
            self._failure = error  # for the program's own thread, which raises it
            self._tell([Lost("the receiver's thread has died")], self._way)

    def _attempt(self) -> bool:
        """Connect, and talk while it lasts; return whether there was a connection."""
        way = self._way
        try:
            transport = way.open()
        except OSError as error:
            self._tell([Refused(str(error))], way)
            return False
        return self._converse(transport, way)

    def _converse(self, transport: Transport, way: _Way) -> bool:
        """Talk over an open port until it is over; return whether there was a connection."""
        with self._lock:
            session = HostSession(
                transport.name,
                secrets.randbelow(0x10000),
                _now_ms(),
                token=way.token,
                granted=self._granted,
                key=way.key,
                nonce=secrets.token_bytes(NONCE),
                past=self.past if way is self._way else None,
            )
            self._session, self._transport = session, transport
        try:
            self._listen(session, transport, way)
        except OSError as error:
            log.info("%s: %s", transport.name, error)
            cut = str(error) if isinstance(error, LinkError) else f"{transport.name} was cut off"
            with self._lock:
                news = session.cut(cut)
            self._tell(news, way)
        finally:
            with self._lock:
                self._session = self._transport = None
            self._part(session, transport)
        return session.welcomed

    def _listen(self, session: HostSession, transport: Transport, way: _Way) -> None:
        """Read, answer and report, until the session is over, or `close` or `reopen` is called."""
        while session.state != "over" and not self._closing.is_set() and way is self._way:
            with self._lock:
                self._flush(session, transport)
                wait_ms = session.wait_ms(_now_ms())
            data = transport.read(wait_ms / 1000)
            self.bytes_received += len(data)
            with self._lock:
                now_ms = _now_ms()
                news = session.receive(data, now_ms) if data else session.tick(now_ms)
            self._tell(news, way)
            if session.state in ("live", "stale"):
                self.state = session.state
            if len(self._inbox) > INBOX:
                with self._lock:
                    news = session.cut("the program did not listen to the orb any more")
                self._tell(news, way)

    def _part(self, session: HostSession, transport: Transport) -> None:
        """Send Bye if a session is live, and close the port."""
        with contextlib.suppress(OSError):
            session.close("the host was closed", _now_ms())
            self._flush(session, transport)
        with contextlib.suppress(OSError):
            transport.close()

    def _flush(self, session: HostSession, transport: Transport) -> None:
        if session.output:
            self.bytes_sent += len(session.output)
            transport.write(bytes(session.output))
            session.output.clear()

    def _tell(self, news: Iterable[Received], way: _Way) -> None:
        """Queue news for `poll` unless another way was taken since; log what changes."""
        for item in news if way is self._way else ():
            if isinstance(item, Connected):
                log.info("connected to %s, %s", item.welcome.name, item.welcome.device_id)
                self._refusal = ""
            elif isinstance(item, Lost):
                self.state = "lost"
                log.warning("link lost: %s", item.reason)
            elif isinstance(item, Missed):
                log.warning("%s never came, or too late", count(item.count, "command"))
            elif isinstance(item, Refused):
                if item.reason == self._refusal:
                    continue
                self._refusal = item.reason
                log.warning("no link: %s", item.reason)
            self._inbox.put((_now_ms(), item))


def _now_ms() -> int:
    return time.monotonic_ns() // 1_000_000
