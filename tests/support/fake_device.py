"""A small orb for tests: a real process with a real session and link, and nothing to feel.

    python tests/support/fake_device.py listen://127.0.0.1:0 [--scripted]

It waits for a host, then sends Telemetry at 50 Hz, and the command "drop" with every tenth frame,
whoever is there. Under granted time it begins anew with each host, steps by 0.1 s of that time, and
answers every grant. With --scripted it obeys lines of its standard input instead:

    hold NAME    send the command NAME, and say that it is held until ...
    let go       nothing is held any more
    tap NAME     both at once

and prints "hello" when a host has come, and "done" when it has sent a line. It ends with its
standard input.
"""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from controller.links import open_link
from controller.links.base import Link
from controller.shared.protocol import messages

REAL_STEP_MS = 20
GRANTED_STEP_MS = 100
PICTURE, SHARES = bytes([128] * 25), (1.0, 0.0, 0.0, 0.0, 0.0)


def welcome(*, virtual: bool = True, nonce: int = 7) -> messages.Welcome:
    """Return what the small orb says of itself."""
    return messages.Welcome(
        *(messages.VERSION, nonce, "virtual-1", "OrbTouch", virtual, 5, 5, 10.0, 10.0, 100, 300),
        labels=("null", "press", "pinch", "twist_cw", "twist_ccw"),
        commands=messages.COMMANDS,
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
                if isinstance(request, messages.Hello):
                    if request.granted or self.granted or not self.met:
                        self.granted, self.frame, self.t_ms = request.granted, 0, 0
                        start = time.monotonic()
                    self.met = True
                elif isinstance(request, messages.Bye):
                    self.granted = False
                elif isinstance(request, messages.Grant):
                    while self.t_ms + GRANTED_STEP_MS <= request.until_ms:
                        self.step(GRANTED_STEP_MS)
                    self.link.send(messages.Granted(request.until_ms), request.until_ms)
                elif isinstance(request, messages.Contacts):
                    pressed = ("down",) if request.contacts else ()
                    self.link.send(messages.State(pressed), self.t_ms)
                elif isinstance(request, messages.Perform):
                    truth = messages.GroundTruth(
                        request.number, request.label, self.t_ms, self.t_ms
                    )
                    self.link.send(truth, self.t_ms)
            if not self.granted and time.monotonic() - start >= (self.t_ms + REAL_STEP_MS) / 1000:
                self.step(REAL_STEP_MS)

    def step(self, step_ms: int) -> None:
        self.frame += 1
        self.t_ms += step_ms
        felt = messages.Telemetry(self.frame, PICTURE, SHARES, None, "", True, 10.0)
        self.link.send(felt, self.t_ms)
        if self.frame % 10 == 0:
            command = messages.Command("drop", "pinch", 0.9, None, self.frame)
            self.link.send(command, self.t_ms)


def script(link: Link, lines: queue.SimpleQueue[str]) -> None:
    """Do what the lines say, once a host is there."""
    start_s, frame, held, greeted = time.monotonic(), 0, "", False
    while True:
        t_ms = round((time.monotonic() - start_s) * 1000)
        link.wait(max((frame + 1) * REAL_STEP_MS - t_ms, 0) / 1000)
        for request in link.poll():
            if isinstance(request, messages.Hello | messages.Bye):
                greeted, held = isinstance(request, messages.Hello), ""
                if greeted:
                    print("hello", flush=True)
        while greeted and not lines.empty():
            what, _, name = lines.get().partition(" ")
            if what != "let":
                link.send(messages.Command(name, "press", 0.9, None, frame), t_ms)
            held = name if what == "hold" else ""
            link.send(messages.State((held,) if held else ()), t_ms)
            print("done", flush=True)
        if t_ms >= (frame + 1) * REAL_STEP_MS:
            frame += 1
            felt = messages.Telemetry(
                frame, PICTURE, SHARES, None, "press" if held else "", True, 50.0
            )
            link.send(felt, t_ms)


def main() -> None:
    url, lines = sys.argv[1], queue.SimpleQueue[str]()
    threading.Thread(target=read, args=(lines,), daemon=True).start()
    nonce = int.from_bytes(os.urandom(4), "little")
    link = open_link(url, welcome(nonce=nonce), token=os.environ.get("ORBTOUCH_TOKEN", ""))
    print(json.dumps({"listening": getattr(link, "url", url)}), flush=True)
    if "--scripted" in sys.argv:
        script(link, lines)
    Loop(link).run()


def read(lines: queue.SimpleQueue[str]) -> None:
    """Pass the standard input's lines on, and end the program with it."""
    for line in sys.stdin:
        lines.put(line.strip())
    os._exit(0)


if __name__ == "__main__":
    main()
