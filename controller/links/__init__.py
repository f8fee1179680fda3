"""Links to hosts: one module for each URL scheme, found by name."""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any, Final

from controller.links.base import Access, Link, LinkError
from controller.shared import plugins
from controller.shared.protocol.codec import ProtocolError
from controller.shared.protocol.messages import Welcome

# Schemes of pyserial's URLs, and names of ports without one.
_SERIAL: Final = ("", "socket", "rfc2217", "loop", "spy", "alt", "hwgrep", "cp2110")
PRINT: Final = "-"  # the link that prints commands


def open_link(url: str, welcome: Welcome, *, token: str = "", key: bytes = b"") -> Link:
    """Open a link; LinkError if it cannot be opened.

    Args:
        url: "-" prints commands; "listen://127.0.0.1:PORT" waits for a host (0: any free port, see
            its `url`); anything else is the name of a port, or a pyserial URL.
        welcome: The description of the device.
        token: Shared secret of the hosts; "" accepts every host.
        key: Key that authenticates every frame, on both ends; b"": no authentication.
    """
    if not url:
        raise LinkError("--link names no port; leave it out to have commands printed")
    try:
        link: Link = module_of(url).create(url, welcome, Access(token, key))
    except ProtocolError as error:  # the Welcome does not fit in a packet
        raise LinkError(f"{error}; use fewer or shorter labels and commands") from None
    return link


def module_of(url: str) -> Any:
    """Return the module that opens a URL: that of its scheme, or `serial_port`."""
    scheme = "stdout" if url == PRINT else url.partition(":")[0] if ":" in url else ""
    if scheme.isidentifier() and importlib.util.find_spec(f"{__name__}.{scheme}"):
        module = importlib.import_module(f"{__name__}.{scheme}")
        if hasattr(module, "create"):
            return module
    elif scheme not in _SERIAL and (found := plugins.find("links", scheme)) is not None:
        return found
    return importlib.import_module(f"{__name__}.serial_port")
