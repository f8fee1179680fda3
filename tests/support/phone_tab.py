"""The phone's page as far as the server sees it: a WebSocket with a key."""

import json
from contextlib import AbstractContextManager
from typing import Any

from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from tests.support.waiting import PATIENCE_S


def opened(url: str, origin: str | None = "") -> AbstractContextManager[ClientConnection]:
    """Open the WebSocket of a page's address, from the page's own origin or another."""
    own = url.rpartition("/")[0] if origin == "" else origin
    socket: AbstractContextManager[ClientConnection] = connect(
        f"ws{url.removeprefix('http')}", origin=None if own is None else Origin(own)
    )
    return socket


def join(tab: ClientConnection, key: str = "") -> dict[str, Any]:
    """Send a page's first message; return the first view."""
    tab.send(json.dumps(key))
    view: dict[str, Any] = json.loads(tab.recv(PATIENCE_S))
    return view
