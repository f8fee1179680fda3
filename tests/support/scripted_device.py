"""A device for tests that is scripted line by line on its standard input.

    python tests/support/scripted_device.py listen://127.0.0.1:0

    hold NAME    send the command NAME, and say that it is held until ...
    let go       nothing is held any more
    tap NAME     both at once

It prints where it listens, "hello" when a host has come, and "done" when it has sent a line. It
sends Telemetry at 50 Hz, and ends with its standard input.
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
from controller.protocol.messages import Bye, Command, Hello, State, Telemetry
from tests.support.fake_device import welcome

STEP_MS = 20
PICTURE, SHARES = bytes([128] * 25), (1.0, 0.0, 0.0, 0.0, 0.0)


def main() -> None:
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=read, args=(lines,), daemon=True).start()
    link = open_link(sys.argv[1], welcome())
    print(json.dumps({"listening": getattr(link, "url", sys.argv[1])}), flush=True)
    start_s, frame, held, greeted = time.monotonic(), 0, "", False
    while True:
        t_ms = round((time.monotonic() - start_s) * 1000)
        link.wait(max((frame + 1) * STEP_MS - t_ms, 0) / 1000)
        for request in link.poll():
            if isinstance(request, Hello | Bye):
                greeted, held = isinstance(request, Hello), ""
                if greeted:
                    print("hello", flush=True)
        while greeted and not lines.empty():
            what, _, name = lines.get().partition(" ")
            if what != "let":
                link.send(Command(name, "press", 0.9, None, frame), t_ms)
            held = name if what == "hold" else ""
            link.send(State((held,) if held else ()), t_ms)
            print("done", flush=True)
        if t_ms >= (frame + 1) * STEP_MS:
            frame += 1
            felt = Telemetry(frame, PICTURE, SHARES, None, "press" if held else "", True, 50.0)
            link.send(felt, t_ms)


def read(lines: queue.SimpleQueue[str]) -> None:
    for line in sys.stdin:
        lines.put(line.strip())
    os._exit(0)


if __name__ == "__main__":
    main()
