"""A host that is not paired: it cannot find the orb, and is refused where it knows the address."""

import socket

from ..guest import Guest
from ..spp import orb


def run(guest: Guest) -> None:
    """Try as a guest who knows the address, with our host and with a bare socket."""
    guest.radio()
    near, far = guest.addresses
    controller, url = orb(guest)
    found = guest.run("hcitool", "-i", "hci0", "scan", "--flush")
    guest.check(far not in found, "an orb that nobody asked to pair is not found by inquiry")
    # The orb answers no call at all while it has no bond; make it answer, as one with a bond does.
    guest.run("hciconfig", "hci1", "piscan")
    host = guest.python("host", "--demo", "--headless", "--seconds", "5", "--link",
                        f"{url}?local={near}")  # fmt: skip
    guest.check(host.wait() == 1, f"host is refused: {host.lines[-1].removeprefix('host: ')}")
    bare = socket.socket(31, socket.SOCK_STREAM, 3)  # asks for no encryption
    bare.settimeout(20.0)
    bare.bind((near, 0))
    try:
        bare.connect((far, 22))
        bare.sendall(b"\0")
        answer = bare.recv(100)
    except OSError as error:
        answer = b""
        guest.saw(f"a bare socket is refused: {error}")
    finally:
        bare.close()
    guest.check(not answer, "and hears nothing")
    guest.check(controller.end() == 0, "the orb ended well")
