"""Classic HID: refused beside the input plugin, then a gamepad and a keyboard for the kernel."""

from controller.links import LinkError

from ..guest import CaseError, Guest
from ..hid import come_back, game, killed, measure, orb, pair, tap, there
from ..input import ClassicDesktop

URL, WHAT = "hid:classic,hci1", "classic HID"


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
    link, desktop = orb(URL), ClassicDesktop(guest)
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
