"""HID over GATT: a desktop with nothing of ours takes the orb for a gamepad and a keyboard."""

from pathlib import Path

from ..guest import Guest
from ..hid import play
from ..input import Desktop

MAIN = Path("/etc/bluetooth/main.conf")


def run(guest: Guest) -> None:
    """Pair, press, come back five times, be seen by a game, and leave nothing down."""
    # As docs/hid.md advises for an orb: else a host may pair over classic Bluetooth, where there is
    # no such service, and is told of bluetoothd's own PnP id. One bluetoothd serves both ends here.
    MAIN.write_text("[General]\nControllerMode = le\nDeviceID = false\n")
    try:
        guest.radio()
        play(guest, Desktop(guest), "hid:hci1", "HID over GATT")
    finally:
        MAIN.unlink()
