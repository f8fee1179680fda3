"""HID over GATT: a desktop with nothing of ours takes the orb for a gamepad and a keyboard."""

from pathlib import Path

from ..guest import Guest
from ..hid import come_back, game, killed, measure, orb, pair, tap, there
from ..input import Desktop

MAIN = Path("/etc/bluetooth/main.conf")
URL, WHAT = "hid:hci1", "HID over GATT"


def run(guest: Guest) -> None:
    """Pair, press, come back five times, be seen by a game, and leave nothing down."""
    # As docs/hid.md advises for an orb: else a host may pair over classic Bluetooth, where there is
    # no such service, and is told of bluetoothd's own PnP id. One bluetoothd serves both ends here.
    MAIN.write_text("[General]\nControllerMode = le\nDeviceID = false\n")
    try:
        _play(guest)
    finally:
        MAIN.unlink()


def _play(guest: Guest) -> None:
    guest.radio()
    link, desktop = orb(URL), Desktop(guest)
    pair(guest, link, desktop)
    pad = there(guest, link, desktop)["pad"]
    tap(link, pad)
    measure(guest, link, pad, WHAT)
    game(guest, link)
    come_back(guest, link, desktop, WHAT)
    link.close()
    guest.until(lambda: not desktop.inputs(), "the input devices to go with the orb")
    link = orb(URL)
    tap(link, there(guest, link, desktop)["pad"])
    guest.saw("back after a new start of the orb")
    link.close()
    guest.until(lambda: not desktop.inputs(), "the input devices to go with the orb")
    killed(guest, desktop, URL, WHAT)
    desktop.close()
