"""A small orb for tests: a real process with a real session and link, and nothing to feel.

    python tests/support/fake_device.py listen://127.0.0.1:0 [--silent]

It waits for a host, then sends Telemetry at 50 Hz, and the command "drop" with every tenth frame,
whoever is there. Under granted time it begins anew with each host, steps by 0.1 s of that time, and
answers every grant. It ends with its standard input.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from controller.links import Link, open_link
from controller.protocol.messages import (
    COMMANDS,
    VERSION,
    Bye,
    Command,
    Contacts,
    Grant,
    Granted,
    GroundTruth,
    Hello,
    Perform,
    State,
    Telemetry,
    Welcome,
)

REAL_STEP_MS = 20
GRANTED_STEP_MS = 100


def welcome(*, virtual: bool = True, nonce: int = 7) -> Welcome:
    """Return what the small orb says of itself."""
    return Welcome(
        version=VERSION,
        boot_nonce=nonce,
        device_id="virtual-1",
        name="OrbTouch",
        virtual=virtual,
        rows=5,
        columns=5,
        pitch_mm=10.0,
        rate_hz=10.0,
        heartbeat_ms=100,
        deadman_ms=300,
        labels=("null", "press", "pinch", "twist_cw", "twist_ccw"),
        commands=COMMANDS,
    )


class Loop:
    """Frames and commands, paced by the clock or by grants."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.granted = False
        self.met = False
        self.frame = 0
        self.t_ms = 0

    def run(self) -> None:
        start = time.monotonic()
        while True:
            due_s = start + (self.t_ms + REAL_STEP_MS) / 1000 - time.monotonic()
            self.link.wait(60.0 if self.granted else max(due_s, 0.0))
            for request in self.link.poll():
                if isinstance(request, Hello):
                    if request.granted or self.granted or not self.met:
                        self.granted, self.frame, self.t_ms = request.granted, 0, 0
                        start = time.monotonic()
                    self.met = True
                elif isinstance(request, Bye):
                    self.granted = False
                elif isinstance(request, Grant):
                    while self.t_ms + GRANTED_STEP_MS <= request.until_ms:
                        self.step(GRANTED_STEP_MS)
                    self.link.send(Granted(request.until_ms), request.until_ms)
                elif isinstance(request, Contacts):
                    pressed = ("down",) if request.contacts else ()
                    self.link.send(State(pressed), self.t_ms)
                elif isinstance(request, Perform):
                    truth = GroundTruth(request.number, request.label, self.t_ms, self.t_ms)
                    self.link.send(truth, self.t_ms)
            if not self.granted and time.monotonic() - start >= (self.t_ms + REAL_STEP_MS) / 1000:
                self.step(REAL_STEP_MS)

    def step(self, step_ms: int) -> None:
        self.frame += 1
        self.t_ms += step_ms
        shares = (1.0, 0.0, 0.0, 0.0, 0.0)
        telemetry = Telemetry(self.frame, bytes([128] * 25), shares, None, "", True, 10.0)
        self.link.send(telemetry, self.t_ms)
        if self.frame % 10 == 0:
            command = Command("drop", "pinch", 0.9, None, self.frame)
            self.link.send(command, self.t_ms)


def main() -> None:
    url = sys.argv[1]
    threading.Thread(target=end_with_standard_input, daemon=True).start()
    nonce = int.from_bytes(os.urandom(4), "little")
    link = open_link(url, welcome(nonce=nonce), token=os.environ.get("ORBTOUCH_TOKEN", ""))
    print(json.dumps({"listening": getattr(link, "url", url)}), flush=True)
    Loop(link).run()


def end_with_standard_input() -> None:
    sys.stdin.buffer.read()
    os._exit(0)


if __name__ == "__main__":
    main()
