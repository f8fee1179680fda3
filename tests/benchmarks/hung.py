"""A sensor that hangs during a hold: when the host is told that nothing is held, and SIGTERM.

Each case is a real `controller` (tests/support/hanging_orb.py) and the host's own receiver over
TCP, a pty, or the RFCOMM link on a local socket; or a host that reads the reports of HID and USB.
"""

import json
import os
import queue
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack, suppress
from itertools import cycle
from pathlib import Path
from typing import Final

from controller.shared.protocol.link_events import Delivered, Lost
from controller.shared.protocol.messages import Heartbeat, State
from host.connection.receiver import Receiver
from host.connection.transport import open_transport
from tests.benchmarks.results import Results, command_line, say
from tests.support import ROOT
from tests.support.serial_cable import Cable

GOAL_S: Final = 0.31  # three frames of 10 Hz, and the way to the host
END_GOAL_S: Final = 2.0
PATIENCE_S: Final = 40.0
GRID: Final = "rows = 5\ncolumns = 5\n"
Events = queue.Queue[tuple[str, float]]
SENSORS: Final = ("virtual", "emulated", "lines", "mpr121", "replay", "drum")
LINKS: Final = ("tcp", "pty", "rfcomm", "hid", "usb")
KEYS: Final = ("hid", "usb")  # links without packets


def options(sensor: str, folder: Path, stack: ExitStack) -> list[str]:
    """Return the options of a sensor."""
    if sensor == "replay":
        return ["--replay", str(ROOT / "assets" / "demo.npz")]
    wiring = folder / "mine.toml"
    if sensor == "lines":
        wiring.write_text(f'port = "tcp:127.0.0.1:{_printer(stack)}"\nrate_hz = 40.0\n{GRID}')
    elif sensor == "mpr121":
        wiring.write_text(f"{GRID}addresses = [0x5A, 0x5B, 0x5C]\n")
    else:
        return ["--sensor", sensor]
    return ["--sensor", f"{sensor}:wiring={wiring}"]


def _printer(stack: ExitStack) -> int:
    """Return the port of a board that prints lines of an untouched sensor."""
    listener = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
    over = threading.Event()
    stack.callback(over.set)

    def run() -> None:
        line = b",".join([b"40.0"] * 25) + b"\n"
        try:
            connection, _ = listener.accept()
            while not over.wait(1 / 40):
                connection.sendall(line)
        except OSError:
            return

    threading.Thread(target=run, daemon=True).start()
    return int(listener.getsockname()[1])


def case(sensor: str, link: str) -> tuple[float, float]:
    """Return the seconds from the hang to the release at the host, and from SIGTERM to the end."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        url, far = f"{link}:", ""
        if link == "tcp":
            url = "listen://127.0.0.1:0"
        elif link == "pty":
            cable = Cable()
            stack.callback(cable.close)
            url, far = cable.ends
        command = [sys.executable, "-m", "tests.support.hanging_orb", "--link", url]
        process = stack.enter_context(
            subprocess.Popen(
                [*command, *options(sensor, folder, stack)], stdout=subprocess.PIPE,
                stderr=subprocess.PIPE, text=True, env={**os.environ, "HOME": str(folder)},
            )
        )  # fmt: skip
        stack.callback(process.kill)
        assert process.stdout is not None
        events: Events = queue.Queue()
        threading.Thread(target=_listen, args=(process, events), daemon=True).start()
        if link == "tcp":
            port = json.loads(process.stdout.readline())["listening"].rpartition(":")[2]
            far = f"socket://127.0.0.1:{port}"
        elif link == "rfcomm":
            far = f"socket://127.0.0.1:{_at(events, 'listens'):.0f}"
        if link in KEYS:
            _at(events, "held")
            hung_s = _at(events, "hangs")
            released_s = _at(events, "released") - hung_s
        else:
            released_s = _released_s(far, events)
        began_s = time.monotonic()
        process.send_signal(signal.SIGTERM)
        process.wait(PATIENCE_S)
        return released_s, time.monotonic() - began_s


def _listen(process: subprocess.Popen[str], events: Events) -> None:
    """Pass what the orb prints on, as event and number."""
    assert process.stderr is not None
    for line in process.stderr:
        name, _, number = line.partition(" at ")
        with suppress(ValueError):
            events.put((name, float(number)))


def _at(events: Events, name: str) -> float:
    """Return the number of the next event of a name; queue.Empty after PATIENCE_S."""
    while True:
        event, number = events.get(timeout=PATIENCE_S)
        if event == name:
            return number


def _released_s(far: str, events: Events) -> float:
    """Return the seconds from the hang to the message that releases what was held."""
    receiver = Receiver(lambda: open_transport(far))
    receiver.start()
    held, end_s = False, time.monotonic() + PATIENCE_S
    try:
        while time.monotonic() < end_s:
            receiver.wait(0.05)
            for item in receiver.poll():
                now_s = time.monotonic()
                message = item.message if isinstance(item, Delivered) else None
                if isinstance(message, State | Heartbeat):
                    if held and not message.pressed:
                        return now_s - _at(events, "hangs")
                    held = bool(message.pressed)
                if isinstance(item, Lost) and held:
                    return now_s - _at(events, "hangs")
    finally:
        receiver.close()
    raise TimeoutError("it is still held" if held else "nothing was held")


class Lateness:
    """How late the scheduler wakes a thread that sleeps for a hundredth of a second."""

    def __init__(self) -> None:
        self._worst_s = 0.0
        threading.Thread(target=self._watch, daemon=True).start()

    def take_s(self) -> float:
        """Return the greatest lateness since the last call."""
        worst_s, self._worst_s = self._worst_s, 0.0
        return worst_s

    def _watch(self) -> None:
        while True:
            due_s = time.monotonic() + 0.01
            time.sleep(0.01)
            self._worst_s = max(self._worst_s, time.monotonic() - due_s)


def main() -> None:
    """Run all pairs of sensor and link again and again, and print the worst."""
    parser = command_line(__doc__, runs=100)
    arguments, results = parser.parse_args(), Results("hung")
    pairs = cycle([(sensor, link) for link in LINKS for sensor in SENSORS])
    released: list[float] = []
    ended: list[float] = []
    lateness = Lateness()
    for number, (sensor, link) in zip(range(arguments.runs), pairs, strict=False):
        release_s, end_s = case(sensor, link)
        released.append(release_s)
        ended.append(end_s)
        late_ms, load = 1000 * lateness.take_s(), os.getloadavg()[0]
        say(
            f"{number + 1} of {arguments.runs}: {sensor} over {link}: released after "
            f"{1000 * release_s:.0f} ms, ended after {end_s:.2f} s; "
            f"scheduler late by {late_ms:.0f} ms, load {load:.1f}"
        )
    late = sum(seconds > GOAL_S for seconds in released)
    results.note("released_late", late, f"of {len(released)}", goal=0)
    results.spread("released_after_s", released, "s", goal=GOAL_S)
    results.note("ended_late", sum(s > END_GOAL_S for s in ended), f"of {len(ended)}", goal=0)
    results.spread("sigterm_to_end_s", ended, "s", goal=END_GOAL_S)
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
