"""Server of the phone's page and its WebSocket, on a thread of its own.

There is one path, a random token; everything else is answered by 404 without a body. The first
page that connects gets a key, with which it may connect again; other pages are refused.
"""

import asyncio
import contextlib
import html
import logging
import queue
import secrets
import socket
import threading
from collections.abc import Callable, Coroutine
from functools import partial
from importlib.resources import files
from typing import Any, Final

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.server import ServerProtocol

from host.phone import messages
from host.phone.messages import Finger, PhoneMessageError, View

SILENCE_S: Final = 0.5  # a page with fingers down repeats them every 0.1 s; then they are lifted
HELLO_S: Final = 5.0  # for a request, and for the first message
PING_S: Final = 5.0  # between two probes of a silent connection, and for the answer
MAX_CONNECTIONS: Final = 8  # at once, of whatever kind
TAKEN, ENDED, MALFORMED = 4001, 4002, 4003  # WebSocket closing codes, known to the page
START_S: Final = 5.0

_SILENT: Final = logging.getLogger(__name__)  # else strangers could fill the terminal
_SILENT.disabled = True


class PhoneServer:
    """The page on one address, for one phone.

    Attributes:
        fingers: On the phone's dome now; () while it is away.
        connected: Whether the phone is there.
        refused: Number of other phones that were turned away since the code was made.
    """

    def __init__(self, listener: socket.socket) -> None:
        """Serve on a listening socket, which is closed with the server."""
        self.fingers: tuple[Finger, ...] = ()
        address, port = listener.getsockname()[:2]
        name = f"[{address}]" if ":" in address else address
        self._netloc = name if port == 80 else f"{name}:{port}"
        self._page = (files("assets") / "host" / "phone.html").read_text("utf-8")
        self._view = View()
        self._phone: ServerConnection | None = None
        self._open: set[ServerConnection] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        self._over, self._changed = asyncio.Event(), asyncio.Event()
        self._begin()
        started: queue.SimpleQueue[asyncio.AbstractEventLoop] = queue.SimpleQueue()
        self._thread = threading.Thread(
            target=lambda: asyncio.run(self._serve(listener, started)), name="phone", daemon=True
        )
        self._thread.start()
        self._loop = started.get(timeout=START_S)

    @property
    def url(self) -> str:
        """Where the page is; whoever knows it may be the first to connect."""
        return f"http://{self._netloc}/{self._token}"

    @property
    def connected(self) -> bool:
        """Whether the phone is there."""
        return self._phone is not None

    def show(self, view: View) -> None:
        """Show the phone a view, if it is another one."""
        if view != self._view:
            self._view = view
            self._call(self._changed.set)

    def renew(self) -> None:
        """Turn the phone away, and wait for the first page with a new token."""
        self._call(self._begin)

    def close(self) -> None:
        """Turn the phone away, and end."""
        self._call(self._over.set)
        self._thread.join(START_S)

    def _call(self, what: Callable[[], object]) -> None:
        """Run a function on the server's thread, unless that has ended."""
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(what)

    # -- on the server's thread ------------------------------------------------------------

    def _begin(self) -> None:
        """Wait for a first page, with a new token."""
        self._token, self._key, self.refused = secrets.token_urlsafe(32), "", 0
        self._end_phone()

    async def _serve(
        self, listener: socket.socket, started: queue.SimpleQueue[asyncio.AbstractEventLoop]
    ) -> None:
        async with serve(
            self._talk,
            sock=listener,
            process_request=self._answer,
            create_connection=partial(_Connection, self._open),
            compression=None,
            server_header=None,
            max_size=messages.MAX_BYTES,
            max_queue=8,
            open_timeout=HELLO_S,
            close_timeout=1.0,
            ping_interval=PING_S,
            ping_timeout=PING_S,
            logger=_SILENT,
        ) as server:
            started.put(asyncio.get_running_loop())
            await self._over.wait()
            server.close(code=ENDED)

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the page or a refusal; None where a WebSocket is to be opened."""
        path = request.path.encode(errors="replace")
        known = secrets.compare_digest(path, f"/{self._token}".encode())
        meant = request.headers.get_all("Host") == [self._netloc]  # no other name leads here
        if not (known and meant and request.method == "GET"):
            return _nothing()
        if "Upgrade" not in request.headers:
            return self._served()
        ours = request.headers.get_all("Origin") == [f"http://{self._netloc}"]
        return None if ours else _nothing()

    def _served(self) -> Response:
        nonce = secrets.token_urlsafe(16)
        words = html.escape(View(self._view.words).json())
        page = self._page.replace("{nonce}", nonce).replace("{view}", words).encode()
        policy = (
            f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; "
            f"connect-src ws://{self._netloc}; base-uri 'none'; form-action 'none'; "
            "frame-ancestors 'none'"
        )
        return _response(
            200,
            "OK",
            page,
            {
                "Content-Type": "text/html; charset=utf-8",
                "Content-Security-Policy": policy,
                "Cache-Control": "no-store",
                "X-Content-Type-Options": "nosniff",
                "Referrer-Policy": "no-referrer",
                "Cross-Origin-Resource-Policy": "same-origin",
            },
        )

    async def _talk(self, connection: ServerConnection) -> None:
        """Take what a page sends, until it is gone; its fingers end with it."""
        try:
            async with asyncio.timeout(HELLO_S):
                key = messages.key(await connection.recv())
            if not self._admit(key):
                self.refused += 1
                await connection.close(TAKEN)
                return
            self._end_phone()
            self._phone = connection
            self._spawn(self._tell(connection))
            await self._follow(connection)
        except PhoneMessageError:
            await connection.close(MALFORMED)
        except (ConnectionClosed, TimeoutError):
            pass
        finally:
            if self._phone is connection:
                self._phone, self.fingers = None, ()

    def _admit(self, key: str) -> bool:
        """Return whether a page may be the skin: the first one, or the same again."""
        if self._key:
            return secrets.compare_digest(key.encode(errors="replace"), self._key.encode())
        self._key = secrets.token_urlsafe(32)
        return True

    async def _follow(self, connection: ServerConnection) -> None:
        """Keep `fingers` as the page says; lift them when it falls silent."""
        limit = messages.RateLimit(messages.RATE_HZ, messages.BURST)
        while True:
            try:
                async with asyncio.timeout(SILENCE_S if self.fingers else None):
                    text = await connection.recv()
            except TimeoutError:
                self.fingers = ()
                continue
            if not limit.take(self._loop.time()):
                raise PhoneMessageError("too many messages")
            found = messages.fingers(text)
            if self._phone is connection:
                self.fingers = found

    async def _tell(self, connection: ServerConnection) -> None:
        """Send the view whenever it is another one; a slow page gets the latest."""
        with contextlib.suppress(ConnectionClosed):
            while self._phone is connection:
                self._changed.clear()
                await connection.send(self._view.json(key=self._key))
                await self._changed.wait()

    def _end_phone(self) -> None:
        phone, self._phone, self.fingers = self._phone, None, ()
        self._changed.set()
        if phone is not None:
            self._spawn(phone.close(ENDED))

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = self._loop.create_task(work)
        self._tasks.add(task)  # the loop itself keeps no reference
        task.add_done_callback(self._tasks.discard)


class _Connection(ServerConnection):
    """One of a bounded number of connections; its refusals have no body."""

    def __init__(
        self, among: set[ServerConnection], protocol: ServerProtocol, *rest: Any, **options: Any
    ) -> None:
        super().__init__(protocol, *rest, **options)
        protocol.reject = lambda status, text: _nothing()  # type: ignore[method-assign]
        self._among = among

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._among.add(self)
        if len(self._among) > MAX_CONNECTIONS:
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._among.discard(self)
        super().connection_lost(exc)


def _nothing() -> Response:
    return _response(404, "Not Found", b"", {})


def _response(status: int, reason: str, body: bytes, headers: dict[str, str]) -> Response:
    usual = {"Content-Length": str(len(body)), "Connection": "close"}
    return Response(status, reason, Headers({**usual, **headers}), body)
