"""Keys and buttons pressed over Bluetooth, read by evdev, and released when either side dies."""

import select
import signal
import sys
import time
from pathlib import Path
from typing import Any

import evdev
from evdev import ecodes

from ..guest import CaseError, Guest, Process
from ..spp import pair_quickly

MAPPINGS = {
    "keyboard": '[everywhere]\nmenu = { arm = true }\n[profile.game]\n'
                'down = { key = "down", mode = "hold" }\ndrop = "space"\n',
    "gamepad": '[everywhere]\nmenu = { arm = true }\n[profile.game]\n'
               'down = { pad = "a", mode = "hold" }\ndrop = { pad = "b" }\n',
}  # fmt: skip
HELD = {"keyboard": ecodes.KEY_DOWN, "gamepad": ecodes.BTN_SOUTH}
LOST_S = 3.0  # a key that has not come by then does not come
RELEASE_S = 1.5  # the dead man's 0.3 s, and what a machine emulated in software adds


def run(guest: Guest) -> None:
    """Hold a key, kill either side, and see it go up; for the keyboard and for the pad."""
    guest.radio()
    pair_quickly(guest)
    for kind in MAPPINGS:
        for victim in ("orb", "host"):
            one(guest, kind, victim)


def one(guest: Guest, kind: str, victim: str) -> None:
    """Hold something down, kill the victim, and wait for it to be let go."""
    near, far = guest.addresses
    device = "tests/support/fake_device.py"
    orb = guest.start("orb", [sys.executable, device, f"rfcomm:{far}", "--scripted"])
    orb.expect('"listening"')
    keys = Path(f"/tmp/{kind}.toml")
    keys.write_text(MAPPINGS[kind])
    words = ["--target", kind, "--headless", "--backend", "uinput", "--mapping", str(keys)]
    host = guest.python("host", *words, "--link", f"rfcomm://{far}?local={near}")
    orb.expect("hello")
    device = guest.until(lambda: find(f"OrbTouch {kind}"), f"an input device for the {kind}")
    tell(orb, "tap menu")
    host.expect("armed by the orb")
    if kind == "keyboard" and victim == "orb":
        seconds = [pressed(orb, device) for _ in range(100)]
        arrived = [each for each in seconds if each is not None]
        # The test orb looks every 20 ms at what it is told.
        guest.measured("orb told to key event in /dev/input (20 ms pace, RFCOMM, uinput)", arrived)
    hold(guest, orb, device, HELD[kind])
    (orb if victim == "orb" else host).end(signal.SIGKILL)
    start_s = time.monotonic()
    while held(device, HELD[kind]):
        if time.monotonic() - start_s > RELEASE_S:
            raise CaseError(f"{kind}: still down {RELEASE_S} s after the {victim} was killed")
        time.sleep(0.002)
    guest.saw(f"{kind}: let go {time.monotonic() - start_s:.2f} s after SIGKILL of the {victim}")
    for process in (host, orb):
        process.end(signal.SIGKILL)
    guest.until(lambda: find(f"OrbTouch {kind}") is None, "the device to vanish")


def hold(guest: Guest, orb: Process, device: Any, code: int) -> None:
    """Hold something down; a busy machine may need to be armed again, see `pressed`."""
    for _ in range(5):
        tell(orb, "hold down")
        end_s = time.monotonic() + LOST_S
        while time.monotonic() < end_s:
            if code in device.active_keys():
                return
            time.sleep(0.01)
        tell(orb, "let go")
        tell(orb, "tap menu")
    raise CaseError("the key did not go down")


def pressed(orb: Process, device: Any) -> float | None:
    """Return the seconds from telling the orb to the key's event; None: it never came."""
    start_s = time.time()  # the kernel's clock for input events, too
    tell(orb, "tap drop")
    seconds: float | None = None
    while select.select([device], [], [], LOST_S)[0]:
        for event in device.read():
            if event.type == ecodes.EV_KEY and event.code == ecodes.KEY_SPACE:
                if event.value == 1:
                    seconds = float(event.timestamp()) - start_s
                elif event.value == 0 and seconds is not None:
                    return seconds
    tell(orb, "tap menu")
    return None


def tell(orb: Process, line: str) -> None:
    """Tell the orb what to do, and wait until it has."""
    orb.say(line)
    orb.expect("done")


def find(name: str) -> Any:
    """Return the input device of a name, or None."""
    for path in evdev.list_devices():
        try:
            device = evdev.InputDevice(path)
        except OSError:
            continue
        if device.name == name:
            return device
    return None


def held(device: Any, code: int) -> bool:
    """Return whether a key is down; one whose device has gone is not."""
    try:
        return code in device.active_keys()
    except (OSError, SystemError):  # evdev's C code says either when the device has gone
        return False
