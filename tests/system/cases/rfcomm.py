"""A whole game over kernel RFCOMM: paired with digits, found by SDP, and played two ways."""

from ..guest import Guest
from ..spp import game, orb, pair, round_trips, told


def run(guest: Guest) -> None:
    """Pair, look the service up, and play the same game every way there is."""
    guest.radio()
    near, far = guest.addresses
    reference = game(guest, None)
    guest.saw(f"over TCP: {told(reference)}")
    controller, url = orb(guest)
    guest.check(url == f"rfcomm://{far}:22", f"the orb waits at {url}")

    guest.saw(f"paired; both sides showed {pair(guest)}")
    records = guest.run("sdptool", "browse", far)
    guest.check("6f726274" in records and '"Serial Port" (0x1101)' in records,
                "SDP (BlueZ's sdptool): our UUID and Serial Port (0x1101)")  # fmt: skip
    guest.check("Channel: 22" in records, "on channel 22")

    ways = {"URL": f"rfcomm://{far}?local={near}", "tty": "/dev/rfcomm0"}
    guest.run("rfcomm", "-i", "hci0", "bind", "0", far, "22")
    for way, link in ways.items():
        guest.check(game(guest, link) == reference, f"the same game over RFCOMM by {way}")
    for way, link in ways.items():
        guest.measured(f"host to controller and back, RFCOMM by {way}", round_trips(guest, link))
    guest.run("rfcomm", "release", "0")
    guest.check(controller.end() == 0, "the orb ended well")
