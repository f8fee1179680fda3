"""Base class of byte-stream links: an I/O thread, and a session for each peer.

The thread sleeps in `select` and queues requests for the control loop. Messages are written on the
loop's thread as far as the stream accepts them without blocking; the I/O thread writes the rest.
"""

from __future__ import annotations

import contextlib
import logging
import selectors
import socket
import threading
import time
from dataclasses import replace
from functools import partial

from controller.links.base import Access, Link, LogLimit
from controller.shared.ports import Stream
from controller.shared.protocol.device_session import DeviceSession
from controller.shared.protocol.messages import SILENCE_MS, Bye, Command, Hello, Message, Welcome
from controller.shared.protocol.packets import encode
from controller.shared.protocol.retransmit import RetransmitQueue
from controller.shared.request_queue import RequestQueue

REQUESTS = 4096  # limit of queued requests; a host that exceeds it is disconnected
CHUNK = 16 * 1024  # bytes per read
TICK_S = 0.05  # greatest delay of a heartbeat, seconds
LINGER_MS = 500  # greatest time for pending output when the link closes

log = logging.getLogger(__name__)


class Peer:
    """The peer at the other end of a stream, without a session since `since_ms`."""

    def __init__(self, stream: Stream, session: DeviceSession, since_ms: int) -> None:
        self.stream = stream
        self.session = session
        self.since_ms = since_ms

    def flush(self) -> None:
        """Write as much output as the stream accepts; raise OSError if it is lost."""
        output = self.session.output
        while output:
            try:
                sent = self.stream.send(bytes(output[:CHUNK]))
            except BlockingIOError:
                return
            del output[:sent]


class StreamLink(Link):
    """A link over byte streams; subclasses accept the peers.

    Attributes:
        dropped: Number of messages not sent, without commands, which `outbox` counts.
        outbox: Unacknowledged commands, and the number of lost ones.
        patient: Whether a peer may stay without a session; else it is disconnected after 2 s.
    """

    dropped = 0
    patient = False

    def __init__(self, welcome: Welcome, access: Access) -> None:
        """Prepare the link for `start`; ProtocolError if the Welcome does not fit in a packet."""
        encode(welcome, session=0, sequence=0, t_ms=0)  # raises before the first Hello
        self.outbox = RetransmitQueue()
        self._welcome, self._access = welcome, access
        self.authenticated = self.authenticated or bool(access.key or access.token)
        self._number = welcome.boot_nonce & 0xFFFF  # of the newest session
        self._lock = threading.Lock()  # guards peers and sessions
        self._peers: list[Peer] = []
        self._host: Peer | None = None  # the one peer with a session
        self._replaced: list[Peer] = []  # old streams of a host that has reconnected
        self._log_limit = LogLimit()
        self._requests: RequestQueue[tuple[int, Message]] = RequestQueue()
        self._polled = 0  # session of the latest Hello that `poll` returned; 0: none
        self._closing = False
        self._failure: BaseException | None = None
        self._wake_reader, self._wake_writer = socket.socketpair()
        self._wake_reader.setblocking(False)
        self._wake_writer.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._wake_reader, selectors.EVENT_READ, self._woken)
        self._thread = threading.Thread(target=self._run, name="link", daemon=True)
        self._start_ns = time.monotonic_ns()
        self._loop_ms: int | None = None  # the latest sign of the control loop

    def start(self) -> None:
        """Start the I/O thread."""
        self._thread.start()

    # --- on the loop's thread ---

    @property
    def connected(self) -> bool:
        """Whether the host of the latest Hello that `poll` returned is still connected."""
        host = self._host
        return host is not None and host.session.number == self._polled

    def send(self, message: Message, t_ms: int) -> None:
        """Send to the host of the latest Hello that `poll` returned; drop it without that host.

        A command is kept for a moment, in case the same host reconnects.
        """
        with self._lock:
            host = self._host
            if host is None and isinstance(message, Command):
                self.outbox.put(message, t_ms, self._now_ms())
                return
            if host is None or not self._is_for(host, message):
                self.dropped += 1
                return
            before = host.session.dropped
            host.session.send(message, t_ms, self._now_ms())
            self.dropped += host.session.dropped - before
            # The I/O thread detects a lost stream.
            with contextlib.suppress(OSError):
                host.flush()
            pending = bool(host.session.output)
        if pending:
            self._wake()

    def _is_for(self, host: Peer, message: Message) -> bool:
        """Return whether a message is for this host; a command is also for a resumed session."""
        session = host.session
        return session.number == self._polled or (session.resumed and isinstance(message, Command))

    def poll(self) -> list[Message]:
        """Return the host's new requests, oldest first."""
        if self._failure:
            raise RuntimeError("the link's thread has died") from self._failure
        self._loop_ms = self._now_ms()
        requests = self._requests.take()
        for number, request in requests:
            if isinstance(request, Hello | Bye):
                self._polled = number if isinstance(request, Hello) else 0
        return [request for _, request in requests]

    def wait(self, timeout_s: float) -> None:
        """Return when `poll` has requests, or after the timeout."""
        self._requests.wait(timeout_s)

    def renew(self, welcome: Welcome, reason: str) -> None:
        """Replace the description of the device; unless "", the host gets the reason."""
        if not reason:  # the numbers of its commands go on, too
            welcome = replace(welcome, boot_nonce=self._welcome.boot_nonce)
        encode(welcome, session=0, sequence=0, t_ms=0)
        with self._lock:
            self._welcome = welcome
            for peer in self._peers:
                self._forward(peer, peer.session.renew(welcome, reason, self._now_ms()))
        self._wake()

    def close(self) -> None:
        """Send Bye to the host, close everything, and end the thread."""
        if not self._closing:
            self._closing = True
            self._wake()
        self._thread.join()

    def _wake(self) -> None:
        """Wake the I/O thread."""
        with contextlib.suppress(OSError):  # full: a wake-up is pending; or the thread has ended
            self._wake_writer.send(b"!")

    # --- on the I/O thread ---

    def _run(self) -> None:
        ticked_ms = 0
        try:
            while not self._closing:
                for key, events in self._selector.select(self._pause_s()):
                    key.data(events)
                now_ms = self._now_ms()
                if now_ms - ticked_ms >= TICK_S * 1000 or now_ms >= self._release_ms() > ticked_ms:
                    ticked_ms = now_ms
                    self._tick(now_ms)
        except BaseException as error:
            self._failure = error
            log.exception("the link's thread has died")
        finally:
            self._shut()

    def _release_ms(self) -> int:
        """Return when the host's session releases what a silent control loop holds."""
        host, loop_ms = self._host, self._loop_ms
        return 0 if host is None or loop_ms is None else host.session.release_ms(loop_ms)

    def _pause_s(self) -> float:
        """Return the seconds until the next tick."""
        left_s = (self._release_ms() - self._now_ms()) / 1000
        return min(left_s, TICK_S) if left_s > 0.0 else TICK_S

    def _attach(self, stream: Stream) -> None:
        """Start a session with a new peer."""
        access = self._access
        session = DeviceSession(
            self._welcome, token=access.token, key=access.key, outbox=self.outbox
        )
        peer = Peer(stream, session, self._now_ms())
        self._selector.register(stream, selectors.EVENT_READ, partial(self._serve, peer))
        with self._lock:
            self._peers.append(peer)

    def _detach(self, peer: Peer, reason: str) -> None:
        """Close a peer; queue Bye if it was the host."""
        with self._lock:
            self._peers.remove(peer)
            self._forward(peer, peer.session.end(reason))
        self._selector.unregister(peer.stream)
        peer.stream.close()

    def _serve(self, peer: Peer, events: int) -> None:
        """Read available bytes from a peer, and write pending output."""
        if peer not in self._peers:
            return  # detached by another event of this round
        try:
            if events & selectors.EVENT_READ:
                data = peer.stream.recv(CHUNK)
                if not data:
                    raise ConnectionResetError("the other end closed it")
                with self._lock:
                    self._receive(peer, data)
                while self._replaced:
                    self._detach(self._replaced.pop(), "the host has connected again")
            with self._lock:
                peer.flush()
        except BlockingIOError:
            return
        except OSError as error:
            self._detach(peer, f"the link was lost: {error}")
            return
        # Select for writing only while there is pending output.
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if peer.session.output else 0)
        key = self._selector.get_key(peer.stream)
        if key.events != wanted:
            self._selector.modify(peer.stream, wanted, key.data)

    def _receive(self, peer: Peer, data: bytes) -> None:
        """Decode a peer's bytes in its session, and queue the requests."""
        session = peer.session
        taken = self._host not in (None, peer)
        session.taken_by = self.outbox.host if taken else 0
        if session.state == "waiting":
            session.number = self._number  # session numbers are unique
        self._forward(peer, session.receive(data, self._now_ms()))
        self._number = session.number or self._number
        if session.refused:
            self._log(f"a host was refused: {session.refused}", logging.WARNING)
            session.refused = ""
        if len(self._requests) > REQUESTS:
            raise ConnectionAbortedError("the host sends faster than the orb can follow")

    def _forward(self, peer: Peer, requests: list[Message]) -> None:
        """Queue requests for the loop, and update the host."""
        for request in requests:
            if isinstance(request, Hello):
                if self._host not in (None, peer):
                    self._replaced += filter(None, (self._host,))
                self._host = peer
                self._log(f"host {request.host!r} connected, session {peer.session.number}")
            elif isinstance(request, Bye):
                if peer is not self._host:
                    continue  # its host has reconnected already, by another stream
                self._host = None
                self._log(f"host gone: {request.reason}")
            self._requests.put((peer.session.number, request))

    def _log(self, line: str, level: int = logging.INFO) -> None:
        """Log a line, at a limited rate."""
        if self._log_limit.lets(line):
            log.log(level, "%s", line)

    def _tick(self, now_ms: int) -> None:
        """Send heartbeats, and detach silent hosts and peers without a session."""
        for peer in tuple(self._peers):
            with self._lock:
                self._forward(peer, peer.session.tick(now_ms, self._loop_ms))
            if peer.session.live:
                peer.since_ms = now_ms
            if self.patient or now_ms - peer.since_ms <= SILENCE_MS:
                self._serve(peer, 0)
            else:
                self._detach(peer, "no session")

    def _woken(self, events: int) -> None:
        """Write pending output after a wake-up."""
        with contextlib.suppress(BlockingIOError):
            self._wake_reader.recv(CHUNK)
        for peer in tuple(self._peers):
            self._serve(peer, 0)

    def _shut(self) -> None:
        """Send Bye to the host, and close all streams."""
        host = self._host
        if host is not None:
            with self._lock, contextlib.suppress(OSError):
                now_ms = self._now_ms()
                host.session.send(Bye("the orb was switched off"), now_ms, now_ms)
                host.flush()
            self._linger(host)
        for peer in tuple(self._peers):
            self._detach(peer, "the orb was switched off")
        self._selector.close()
        self._wake_reader.close()
        self._wake_writer.close()

    def _linger(self, host: Peer) -> None:
        """Wait a moment until the host has read the output.

        Closing a socket with unread input resets the connection, and the last output is lost; so
        wait for the host to close first. Serial ports have neither end nor reset.
        """
        end_ms = self._now_ms() + LINGER_MS
        with selectors.DefaultSelector() as selector, contextlib.suppress(OSError):
            selector.register(host.stream, selectors.EVENT_READ | selectors.EVENT_WRITE)
            while (left_ms := end_ms - self._now_ms()) > 0:
                for _, events in selector.select(left_ms / 1000):
                    if events & selectors.EVENT_READ and not host.stream.recv(CHUNK):
                        return
                    host.flush()
                if not host.session.output:
                    if self.patient:
                        return
                    selector.modify(host.stream, selectors.EVENT_READ)

    def _now_ms(self) -> int:
        return (time.monotonic_ns() - self._start_ns) // 1_000_000
