"""Server of the phone's page and its WebSocket, on a thread of its own.

There is one path, a random token; everything else is answered by 404 without a body. The first
page that connects gets a key, with which it may connect again; other pages are refused.
"""

import asyncio
import base64
import contextlib
import html
import json
import logging
import secrets
import socket
import threading
from functools import partial
from importlib.resources import files
from typing import Any, Final

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.protocol import State
from websockets.server import ServerProtocol

from controller.shared.protocol.messages import Contact
from host.phone import page
from host.ui.pointer_input import DomeArea
from tetris.kit import theme

TURN_S: Final = 0.03  # in which a new view is sent
SILENCE_S: Final = 0.5  # a page with fingers down repeats them every 0.1 s; then they are lifted
REQUEST_S: Final = 1.0  # for a request
WAIT_S: Final = 5.0  # for a first message, an answer to a ping
END_S: Final = 0.5  # that closing takes at most
RATE_HZ: Final = 200  # messages of a page; it sends one a picture, at most 120
MAX_BYTES: Final = 1024  # of a message; ten fingers take 400
MAX_CONNECTIONS: Final = 8  # at once, of whatever kind
MAX_WAITING: Final = 2  # of one address, that have not asked for anything yet
TAKEN, ENDED, MALFORMED = 4001, 4002, 4003  # WebSocket closing codes, known to the page

_POLICY: Final = (
    "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; img-src data:; "
    "font-src data:; connect-src ws://{netloc}; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
_SILENT: Final = logging.getLogger(__name__)  # else strangers could fill the terminal
_SILENT.disabled = True
_NOTHING: Final = Response(
    404, "Not Found", Headers({"Content-Length": "0", "Connection": "close"}), b""
)


class PhoneServer:
    """The page on one address, for one phone.

    Attributes:
        url: Where the page is; the first to open it there becomes the skin.
        view: What the page shows, of `page.view`; empty until it is known.
        pad: The dome that its fingers are on.
        contacts: These fingers; () while it is away.
        phone: Its connection; None while it is away.
        refused: Whether another phone was turned away.
    """

    def __init__(self, listener: socket.socket) -> None:
        self.view: dict[str, Any] = {}
        self.pad, self.refused = DomeArea(), False
        self.contacts: tuple[Contact, ...] = ()
        self.phone: ServerConnection | None = None
        address, port = listener.getsockname()[:2]
        name = f"[{address}]" if ":" in address else address
        self._netloc = name if port == 80 else f"{name}:{port}"
        self._path, self._key = f"/{secrets.token_urlsafe(32)}", ""
        self.url = f"http://{self._netloc}{self._path}"
        font = base64.b64encode(theme.font_file()).decode()
        text = (files("assets") / "host" / "phone.html").read_text("utf-8")
        self._page = text.replace("{font}", font)
        self._loop, self._over = asyncio.new_event_loop(), asyncio.Event()
        self._thread = threading.Thread(target=self._run, args=(listener,), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Turn the phone away, and end; at once but for strangers that hold a connection."""
        with contextlib.suppress(RuntimeError):  # closed already
            self._loop.call_soon_threadsafe(self._over.set)
        self._thread.join(END_S)

    # -- on the server's thread ------------------------------------------------------------

    def _run(self, listener: socket.socket) -> None:
        self._loop.run_until_complete(self._serve(listener))
        self._loop.close()

    async def _serve(self, listener: socket.socket) -> None:
        connect: Any = partial(_Connection, present=[])
        async with serve(
            self._talk,
            sock=listener,
            process_request=self._answer,
            create_connection=connect,
            compression=None,
            server_header=None,
            logger=_SILENT,
            max_size=MAX_BYTES,
            open_timeout=REQUEST_S,
            close_timeout=1.0,
            ping_interval=WAIT_S,
            ping_timeout=WAIT_S,
        ) as server:
            await self._over.wait()
            server.close(code=ENDED)

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the page or a refusal; None where a WebSocket is to be opened."""
        path, ours = request.path.encode(errors="replace"), f"http://{self._netloc}"
        known = secrets.compare_digest(path, self._path.encode())
        named = request.headers.get_all("Host") == [self._netloc]  # against DNS rebinding
        if not (known and named and request.method == "GET"):
            return _NOTHING
        if "Upgrade" in request.headers:
            return None if request.headers.get_all("Origin") == [ours] else _NOTHING
        nonce, words = secrets.token_urlsafe(16), json.dumps(self.view.get("words", {}))
        body = self._page.replace("{nonce}", nonce).replace("{words}", html.escape(words)).encode()
        headers = {
            "Content-Type": "text/html; charset=utf-8",
            "Content-Length": str(len(body)),
            "Content-Security-Policy": _POLICY.format(nonce=nonce, netloc=self._netloc),
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Connection": "close",
        }
        return Response(200, "OK", Headers(headers), body)

    async def _talk(self, connection: ServerConnection) -> None:
        """Take what a page sends, until it is gone; its fingers end with it."""
        try:
            async with asyncio.timeout(WAIT_S):
                key = page.value(await connection.recv())
            if self._admitted(key):
                self.phone, self.contacts = connection, ()
                await self._follow(connection)
                await connection.close(ENDED)
            else:
                self.refused = True
                await connection.close(TAKEN)
        except ValueError:
            if self.phone is connection:
                self.contacts = ()  # closing may take seconds
            await connection.close(MALFORMED)
        except (ConnectionClosed, TimeoutError):
            pass
        finally:
            if self.phone is connection:
                self.phone, self.contacts = None, ()

    def _admitted(self, key: object) -> bool:
        """Return whether a page may be the skin: the first one, or the same again."""
        if not isinstance(key, str):
            raise ValueError("the first message must be a key")
        if self._key:
            return secrets.compare_digest(key.encode(errors="replace"), self._key.encode())
        self._key = secrets.token_urlsafe(32)
        return True

    async def _follow(self, connection: ServerConnection) -> None:
        """Keep `contacts` and the page in step, until the phone has another connection."""
        shown: dict[str, Any] = {}
        heard_s, second, count = 0.0, 0, 0
        while self.phone is connection:
            if shown != self.view:
                shown = self.view
                await connection.send(json.dumps({**shown, "key": self._key}))
            try:
                async with asyncio.timeout(TURN_S):
                    text = await connection.recv()
            except TimeoutError:
                if self._loop.time() - heard_s > SILENCE_S:
                    self.contacts = ()
                continue
            heard_s = self._loop.time()
            second, count = int(heard_s), count + 1 if second == int(heard_s) else 1
            if count > RATE_HZ:
                raise ValueError("too many messages")
            self.contacts = page.contacts(text, self.pad)


class _Connection(ServerConnection):
    """One of a bounded number of connections; its refusals have no body."""

    def __init__(
        self, protocol: ServerProtocol, *rest: Any, present: list["_Connection"], **options: Any
    ) -> None:
        super().__init__(protocol, *rest, **options)
        protocol.reject = lambda status, text: _NOTHING  # type: ignore[method-assign]
        self._present = present  # the connections of the server, oldest first

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Make room: idle connections go first, the oldest ones, so that they keep nobody out."""
        super().connection_made(transport)
        self._present.append(self)
        waiting = [one for one in self._present if one.state is State.CONNECTING]
        near = [one for one in waiting if one.remote_address[0] == self.remote_address[0]]
        if len(near) > MAX_WAITING:
            near[0].end()
        elif len(self._present) > MAX_CONNECTIONS:
            waiting[0].end()

    def connection_lost(self, exc: Exception | None) -> None:
        """Give up the place."""
        super().connection_lost(exc)
        self.end()

    def end(self) -> None:
        """Close at once, without a word."""
        if self in self._present:
            self._present.remove(self)
            self.transport.abort()
