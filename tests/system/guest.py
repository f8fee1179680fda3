"""Inside the virtual machine: run cases one after the other, each in a process of its own.

    python3 -m tests.system.guest CASE ...     every case, cleaning up after each
    python3 -m tests.system.guest --one CASE   this case, here

A case is a module of `tests.system.cases` with `run(guest)`; it fails by raising.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from tests.support.processes import LineProcess

OUT: Final = Path("/out")


def _patience() -> float:
    """Return how much longer everything may take than on an idle machine."""
    with contextlib.suppress(OSError, ValueError):
        return float((OUT / "patience").read_text())
    return 1.0


PATIENCE: Final = _patience()
CASE_S: Final = 120.0 * PATIENCE
ANSWER_S: Final = 60.0 * PATIENCE  # for anything that is waited for, unless told otherwise
LIBEXEC: Final = "/usr/libexec/bluetooth/bluetoothd"


class CaseError(AssertionError):
    """Something in a case was not as it should be."""


class Process(LineProcess):
    """A process whose output is kept line by line, and can be waited for."""

    def __init__(self, name: str, command: Sequence[str], env: dict[str, str] | None) -> None:
        self.name = name
        self.lines: list[str] = []
        self.heard = ""  # all of it, also a question that ends no line
        self._news = threading.Condition()
        self._seen = 0
        given = {**os.environ, **(env or {})}
        super().__init__(command, stderr=subprocess.STDOUT, env=given)
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        while data := os.read(self.process.stdout.fileno(), 65536):
            text = data.decode(errors="replace")
            for line in filter(None, text.splitlines()):
                print(f"[{_uptime():7.2f} {self.name}] {line}", flush=True)
            with self._news:
                self.heard += text
                self.lines = self.heard.splitlines()
                self._news.notify_all()
        with self._news:
            self._news.notify_all()

    def expect(self, text: str, timeout_s: float = ANSWER_S) -> str:
        """Return the next line, ended or not, that holds `text`; lines before are passed over."""
        end_s = time.monotonic() + timeout_s
        with self._news:
            while True:
                while self._seen < len(self.lines):
                    line = self.lines[self._seen]
                    self._seen += 1
                    if text in line:
                        return line
                left_s = end_s - time.monotonic()
                if left_s <= 0 or not self._thread.is_alive():
                    ended = f", ended with {self.process.poll()}" if left_s > 0 else ""
                    tail = " | ".join(self.lines[-5:])
                    raise CaseError(f"{self.name} did not say {text!r}{ended}: {tail}")
                self._news.wait(min(left_s, 0.5))

    def end(self, number: int = signal.SIGTERM, timeout_s: float = ANSWER_S) -> int:
        """Send a signal, and return the exit status."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        return self.wait(timeout_s)

    def wait(self, timeout_s: float = ANSWER_S) -> int:
        """Return the exit status when it has ended by itself."""
        try:
            status = self.process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            raise CaseError(f"{self.name} did not end within {timeout_s:g} s") from None
        self._thread.join(timeout_s)
        return status


class Guest:
    """What a case works with."""

    def __init__(self, name: str = "") -> None:
        self.name = name
        self._start_s = time.monotonic()
        self.addresses: list[str] = []  # of the two adapters, hci0 and hci1, once the radio is on
        self.found: list[str] = []  # what was seen, for the table
        self.rows: list[dict[str, Any]] = []  # what was measured, likewise
        self.processes: list[Process] = []
        self._radio: dict[str, Process] = {}

    # --- processes ---

    def start(
        self, name: str, command: Sequence[str], env: dict[str, str] | None = None
    ) -> Process:
        """Start a process; it is killed at the end of the case."""
        process = Process(name, command, env)
        self.processes.append(process)
        return process

    def python(self, module: str, *arguments: str, name: str = "") -> Process:
        """Start one of our programs, such as controller or host."""
        return self.start(name or module, [sys.executable, "-m", module, *arguments])

    def run(self, *command: str, timeout_s: float = ANSWER_S) -> str:
        """Run a command to its end and return its output; a failure is the case's."""
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=timeout_s
        )
        print(f"$ {' '.join(command)}\n{done.stdout}{done.stderr}", flush=True)
        if done.returncode:
            raise CaseError(f"{command[0]} failed with {done.returncode}: {done.stderr.strip()}")
        return done.stdout

    # --- the radio ---

    def radio(self, *bluetoothd: str) -> None:
        """Start two linked adapters, the bus and BlueZ, with further options of bluetoothd."""
        self.adapters_on()
        self.bus_on()
        self.bluez_on(*bluetoothd)

    def adapters_on(self) -> None:
        """Start btvirt, again if the kernel gave up on one of its controllers."""
        for _ in range(4):
            process = self._radio["btvirt"] = self.start("btvirt", ["btvirt", "-l2"])
            end_s = time.monotonic() + 12.0
            while time.monotonic() < end_s:
                found = _addresses()
                if len(found) >= 2:
                    self.addresses = found[:2]
                    return
                time.sleep(0.25)
            process.end(signal.SIGKILL)
            time.sleep(0.5)
        raise CaseError("btvirt's controllers did not come up")

    def adapters_off(self) -> None:
        self._radio.pop("btvirt").end(signal.SIGKILL)
        self.until(lambda: not _addresses(), "the adapters to vanish", pause_s=0.3)

    def bus_on(self) -> None:
        command = ["dbus-daemon", "--system", "--nofork", "--nopidfile", "--print-address"]
        self._radio["bus"] = self.start("dbus", command)
        self._radio["bus"].expect("unix:")

    def bluez_on(self, *options: str) -> None:
        """Start bluetoothd and wait until it has taken both adapters."""
        self._radio["bluez"] = self.start("bluetoothd", [LIBEXEC, "-n", *options])
        self.until(lambda: len(self._known()) >= 2, "bluetoothd to know both", pause_s=0.3)

    def bluez_off(self, number: int = signal.SIGTERM) -> None:
        self._radio.pop("bluez").end(number)

    def _known(self) -> list[str]:
        done = subprocess.run(
            ["busctl", "--system", "tree", "--list", "org.bluez"]
            if Path("/usr/bin/busctl").exists()
            else ["dbus-send", "--system", "--print-reply", "--dest=org.bluez", "/",
                  "org.freedesktop.DBus.ObjectManager.GetManagedObjects"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        return [f"hci{n}" for n in range(2) if f"/org/bluez/hci{n}" in done.stdout]

    # --- waiting, seeing, measuring ---

    def until(self, condition: Any, what: str, *, pause_s: float = 0.02) -> Any:
        """Return the first true value of a condition; fail when patience ends."""
        end_s = time.monotonic() + ANSWER_S
        while time.monotonic() < end_s:
            if value := condition():
                return value
            time.sleep(pause_s)
        raise CaseError(f"waited {ANSWER_S:g} s for {what}")

    def check(self, condition: object, what: str) -> None:
        """Take down what is true; fail if it is not."""
        if not condition:
            raise CaseError(f"not so: {what}")
        self.saw(what)

    def saw(self, what: str) -> None:
        print(f"*** {what}", flush=True)
        self.found.append(what)
        self.write(ok=False)

    def measured(self, what: str, seconds: Iterable[float]) -> None:
        """Take down how long something took, time after time."""
        sorted_ms = sorted(1000 * each for each in seconds)
        n = len(sorted_ms)
        row = {
            "what": what,
            "n": n,
            "p50_ms": round(sorted_ms[n // 2], 3),
            "p99_ms": round(sorted_ms[min(n - 1, int(n * 0.99))], 3),
        }
        print(f"*** {row}", flush=True)
        self.rows.append(row)
        self.write(ok=False)

    def write(self, *, ok: bool) -> None:
        """Write what is known so far, so that a case which is ended leaves that."""
        seconds = round(time.monotonic() - self._start_s, 1)
        said = {"ok": ok, "seconds": seconds, "found": self.found, "rows": self.rows}
        (OUT / f"{self.name}.json").write_text(json.dumps(said))

    def close(self) -> None:
        """Kill what the case has started, the newest first."""
        for process in reversed(self.processes):
            if process.process.poll() is None:
                process.process.kill()
                process.process.wait()


def _addresses() -> list[str]:
    """Return the addresses of the adapters that the kernel has brought to life."""
    done = subprocess.run(["hciconfig"], capture_output=True, text=True, check=False)
    lines = (line.split() for line in done.stdout.splitlines() if "BD Address:" in line)
    found = sorted((words[2] for words in lines), key=lambda address: address)
    return [address for address in found if address != "00:00:00:00:00:00"]


def _uptime() -> float:
    return float(Path("/proc/uptime").read_text().split()[0])


def _one(name: str) -> int:
    """Run a case here, and write what came of it."""
    guest, ok = Guest(name), False
    try:
        importlib.import_module(f"{__package__}.cases.{name}").run(guest)
        ok = True
    except Exception as error:
        traceback.print_exc()
        guest.found.append(f"{type(error).__name__}: {error}")
    finally:
        guest.close()
    guest.write(ok=ok)
    return 0 if ok else 1


def _all(names: Sequence[str]) -> None:
    for name in names:
        with (OUT / f"{name}.log").open("wb") as log:
            case = subprocess.Popen(
                [sys.executable, "-m", f"{__package__}.guest", "--one", name],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                status: object = case.wait(CASE_S)
            except subprocess.TimeoutExpired:
                status = f"ended after {CASE_S:g} s"
            with contextlib.suppress(ProcessLookupError):
                os.killpg(case.pid, signal.SIGKILL)  # and whatever it left behind
            case.wait()
        print(f"case {name}: {status}, at {_uptime():.1f} s", flush=True)
        _tidy()


def _tidy() -> None:
    """Forget bonds and sockets, so that every case begins alike."""
    subprocess.run("rm -rf /var/lib/bluetooth/* /run/dbus/*", shell=True, check=False)
    end_s = time.monotonic() + 10.0
    while _addresses() and time.monotonic() < end_s:
        time.sleep(0.1)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        sys.exit(_one(sys.argv[2]))
    _all(sys.argv[1:])
