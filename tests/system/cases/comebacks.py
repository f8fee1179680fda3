"""The daemon restarts, the adapter is pulled and put back, the orb dies: the host comes back."""

import signal
import time

from ..guest import Guest, Process
from ..spp import orb, pair_quickly


def run(guest: Guest) -> None:
    """Break the link in every way that there is, and see it mend."""
    guest.radio()
    near, far = guest.addresses
    pair_quickly(guest)
    controller, _ = orb(guest)
    url = f"rfcomm://{far}?local={near}"
    host = guest.python("host", "--target", "keyboard", "--backend=print", "--headless",
                        "--verbose", "--link", url, name="host")  # fmt: skip
    host.expect("connected to")
    guest.until(lambda: "session" in controller.heard, "the orb to know its host")

    for how, number in (("restarted", signal.SIGTERM), ("killed", signal.SIGKILL)):
        guest.bluez_off(number)
        guest.bluez_on()
        controller.expect("Bluetooth is ready")
        back(guest, host, f"bluetoothd {how}")

    guest.adapters_off()
    host.expect("link lost")
    controller.expect("lost")
    start_s = time.monotonic()
    guest.adapters_on()
    controller.expect("Bluetooth is ready")
    host.expect("connected to")
    guest.saw(f"adapters pulled and brought back: connected {time.monotonic() - start_s:.1f} s "
              "after they were plugged in")  # fmt: skip

    seconds = []
    for _ in range(5):
        controller.end(signal.SIGKILL)
        host.expect("link lost")
        start_s = time.monotonic()
        controller, _ = orb(guest)
        ready_s = time.monotonic()
        host.expect("connected to")
        seconds.append(time.monotonic() - ready_s)
    guest.measured("RFCOMM: host connected again after the orb's program is ready", seconds)
    guest.saw("the orb's program killed and started 5 times: the host came back 5 times")
    guest.check(host.end() in (0, 143, -15), "host ended well")
    guest.check(controller.end() == 0, "the orb ended well")


def back(guest: Guest, host: Process, what: str) -> None:
    """See that the host is connected after something has happened, lost in between or not."""
    time.sleep(2.0)  # long enough for a loss to be noticed
    lost = host.heard.count("link lost")
    guest.until(lambda: host.heard.count("connected to") > host.heard.count("link lost"),
                f"the host to be connected after {what}")  # fmt: skip
    guest.saw(f"{what}: the host is connected (lost so far: {lost} times)")
