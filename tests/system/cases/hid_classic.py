"""Classic HID: refused beside the input plugin, then a gamepad and a keyboard for the kernel."""

from controller.links.base import LinkError

from ..guest import CaseError, Guest
from ..hid import orb, play
from ..input import ClassicDesktop

URL = "hid:classic,hci1"


def run(guest: Guest) -> None:
    """Pair, press, come back five times, be seen by a game, and leave nothing down."""
    guest.radio()
    guest.run("hciconfig", "hci1", "class", "0x002508")  # as Class = in main.conf does
    try:
        orb(URL).close()
    except LinkError as error:
        guest.saw(f"beside the input plugin: {error}")
    else:
        raise CaseError("bluetoothd's input plugin did not hold the channels")
    guest.bluez_off()
    guest.bluez_on("--noplugin=input")
    play(guest, ClassicDesktop(guest), URL, "classic HID")
