"""`host --phone`: a phone's page, served while the program runs."""

import sys
from contextlib import ExitStack
from typing import Final

from host.app.application import OrbApp
from host.phone import PORT, open_phone
from host.targets import Target

HELP: Final = (
    "serve a page on this address of this machine, ADDRESS or ADDRESS:PORT, with which a phone "
    f"touches the virtual orb (docs/play.md; default port: {PORT})"
)


def begin(words: str | None, target: Target, stack: ExitStack) -> None:
    """Serve the page and show its code if the option was given; the stack ends the server."""
    stack.callback(_end, target)  # the window may start one, too
    if words is None:
        return
    target.phone = open_phone(words)
    if isinstance(target, OrbApp):
        target.show_phone()
    else:
        from host.phone import qr  # in here: an optional extra

        qr.code(target.phone.url).print_ascii(out=sys.stderr, invert=True)


def _end(target: Target) -> None:
    if target.phone:
        target.phone.close()
