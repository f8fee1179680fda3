"""Keys and buttons that an orb presses over Bluetooth, seen by evdev, and let go whoever dies."""

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
    orb = guest.start("orb", [sys.executable, "tests/played_device.py", f"rfcomm:{far}"])
    orb.expect('"listening"', 60.0)
    keys = Path(f"/tmp/{kind}.toml")
    keys.write_text(MAPPINGS[kind])
    words = ["--target", kind, "--headless", "--backend", "uinput", "--keys", str(keys)]
    host = guest.python("host", *words, "--link", f"rfcomm://{far}?local={near}")
    orb.expect("hello", 60.0)
    device = guest.until(lambda: find(f"OrbTouch {kind}"), f"an input device for the {kind}")
    tell(orb, "tap menu")
    host.expect("armed by the orb")
    if kind == "keyboard" and victim == "orb":
        guest.measured("orb's program to key event in /dev/input (RFCOMM, uinput)",
                       [pressed(orb, device) for _ in range(100)])  # fmt: skip
    tell(orb, "hold down")
    guest.until(lambda: HELD[kind] in device.active_keys(), "the key to go down")
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


def pressed(orb: Process, device: Any) -> float:
    """Return the seconds from telling the orb to the key's event; it is up again afterwards."""
    start_s = time.monotonic()
    orb.say("tap drop")
    seconds = 0.0
    for event in device.read_loop():
        if event.type == ecodes.EV_KEY and event.code == ecodes.KEY_SPACE:
            if event.value == 1:
                seconds = time.monotonic() - start_s
            elif event.value == 0:
                return seconds
    raise CaseError("the device has gone")


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
    except OSError:
        return False
