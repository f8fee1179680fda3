"""HID over GATT: a desktop with nothing of ours takes the orb for a gamepad and a keyboard."""

from ..guest import Guest
from ..hid import look


def run(guest: Guest) -> None:
    """Pair, press, come back five times, and leave nothing down."""
    guest.radio()
    look(guest, "hid:hci1", "le")
