"""Links: one module for each URL scheme, found by name. For `runtime` and `diagnostics`."""

from __future__ import annotations

import importlib
import importlib.util
import re
from typing import Any, Final

from controller.links.base import Access, Link, LinkAwayError, LinkError
from controller.protocol.codec import ProtocolError
from controller.protocol.messages import Welcome

__all__ = [
    "PRINT",
    "Access",
    "Link",
    "LinkAwayError",
    "LinkError",
    "module_of",
    "open_link",
    "split",
]

PRINT: Final = "-"  # the link that prints commands
_JOINT: Final = re.compile(r"\+(?=[a-z]+:)")  # a plus elsewhere belongs to its URL


def open_link(
    url: str, welcome: Welcome, *, token: str = "", key: bytes = b"", exposed: bool = False
) -> Link:
    """Open a link.

    Args:
        url: "-" prints commands; "listen://127.0.0.1:PORT" waits for a host (0: any free port, see
            its `url`); anything else is the name of a port, or a URL that pyserial knows;
            "rfcomm:+hid:" opens both.
        welcome: The description of the device.
        token: What a host has to know; "" lets every host in.
        key: What every frame is sealed with, on both ends; b"": frames are not sealed.
        exposed: Let other machines in, although there is no key.

    Raises:
        LinkError: It cannot be opened.
    """
    if not url:
        raise LinkError("--link names no port; leave it out to have commands printed")
    try:
        link: Link = module_of(url).create(url, welcome, Access(token, key, exposed))
    except ProtocolError as error:  # this Welcome, before any host has asked for it
        raise LinkError(f"{error}; use fewer or shorter labels and commands") from None
    return link


def module_of(url: str) -> Any:
    """Return the module that opens a URL: the one with its scheme's name, or `serial_port`."""
    scheme = "stdout" if url == PRINT else url.partition(":")[0] if ":" in url else ""
    if len(split(url)) > 1:
        scheme = "multi"
    if scheme.isidentifier() and importlib.util.find_spec(f"{__name__}.{scheme}"):
        module = importlib.import_module(f"{__name__}.{scheme}")
        if hasattr(module, "create"):
            return module
    return importlib.import_module(f"{__name__}.serial_port")


def split(url: str) -> list[str]:
    """Return the links that a URL names: one, or several with a plus in between."""
    return _JOINT.split(url)
