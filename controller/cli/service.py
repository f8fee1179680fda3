"""`controller service` and `status`: the systemd unit, and the state of service and loop."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from contextlib import closing
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from controller.arguments import Parser
from controller.config import MAX_BYTES, parse_json
from controller.errors import count, how_to_install
from controller.files import read_bytes
from controller.links.bluetooth import bluez
from controller.links.bluetooth.bluez import BluetoothError, Bus, Objects, adapters, bonded, devices
from controller.runtime.latency import status_folders

NAME: Final = "orbtouch.service"
# Groups that may use Bluetooth over D-Bus, pins and converter, on Debian and Raspberry Pi OS.
GROUPS: Final = ("bluetooth", "gpio", "spi")
PROPERTIES: Final = ("LoadState", "ActiveState", "SubState", "StatusText", "NRestarts", "MainPID",
                "ActiveEnterTimestamp")  # fmt: skip


def main(argv: Sequence[str]) -> int:
    """Print the unit, and how to install it; return 0."""
    parser = Parser(
        prog="controller service",
        description="Print a systemd unit that runs this controller: it starts with the machine, "
        "and again after a crash or a hang.",
        epilog=f"controller service | sudo tee /etc/systemd/system/{NAME}; "
        f"sudo systemctl enable --now {NAME}",
    )
    parser.add_argument(
        "options",
        nargs="*",
        metavar="-- OPTION",
        help="options of the controller, after two dashes (default: --link rfcomm:)",
    )
    options = parser.parse_args(argv)
    print(unit(command(), options.options or ["--link", "rfcomm:"]), end="")
    return 0


def unit(program: Sequence[str], options: Sequence[str]) -> str:
    """Return the unit that runs a program, the command of the controller, with options."""
    text = files("controller.runtime").joinpath(NAME).read_text(encoding="utf-8")
    words = " ".join(_quoted(word) for word in (*program, *options))
    text = text.replace("@COMMAND@", words).replace("@GROUPS@", " ".join(_groups()))
    return text.replace("SupplementaryGroups=\n", "")


def command() -> list[str]:
    """Return the command of this installation."""
    beside = Path(sys.executable).parent / "controller"
    found = str(beside) if beside.exists() else shutil.which("controller")
    return [found] if found else [sys.executable, "-m", "controller"]


def _groups() -> list[str]:
    """Return the groups that exist: systemd refuses a unit with a missing one."""
    try:
        import grp
    except ImportError:  # a system without systemd
        return list(GROUPS)
    there = {entry.gr_name for entry in grp.getgrall()}
    return [name for name in GROUPS if name in there]


def _quoted(word: str) -> str:
    """Return a word quoted for a systemd unit."""
    word = word.replace("\\", "\\\\").replace("%", "%%").replace("$", "$$").replace('"', '\\"')
    return f'"{word}"' if not word or any(letter.isspace() for letter in word) else word


# --- status ---------------------------------------------------------------------------------------


def status(argv: Sequence[str]) -> int:
    """Print the state of the device; return 0 if it runs, as a service or not, 1 if not."""
    parser = Parser(
        prog="controller status",
        description="Show whether the device's service runs, which hosts are paired and connected, "
        "and the latency of its frames.",
    )
    parser.add_argument("--json", action="store_true", help="as one line of JSON")
    options = parser.parse_args(argv)
    service = read_service()
    try:
        radio = read_radio(asyncio.run(_objects()))
    except BluetoothError as error:
        radio = {"problem": str(error)}
    running = read_running()
    if options.json:
        print(json.dumps({"service": service, "bluetooth": radio, "running": running}))
    else:
        lines = [*service_lines(service), *radio_lines(radio), *running_lines(running)]
        print("\n".join(lines))
    return 0 if service.get("ActiveState") == "active" or running else 1


def read_running() -> dict[str, Any]:
    """Return the status of a running controller, the service's first; {} if none runs."""
    for folder in status_folders():
        try:
            found = parse_json(read_bytes(folder / "status.json", MAX_BYTES))
            running_lines(found)  # raises for another program's file
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if isinstance(found, dict) and _runs(found.get("pid")):
            return found
    return {}


def _runs(pid: object) -> bool:
    """Return whether there is such a process, of any user."""
    if not isinstance(pid, int) or pid <= 0:
        return False
    try:
        os.kill(pid, 0)
    except PermissionError:
        return True
    except (OSError, OverflowError):
        return False
    return True


def running_lines(running: dict[str, Any]) -> list[str]:
    """Return the latency of its frames as lines."""
    if not running:
        return ["loop       no controller runs"]
    period_ms = running["period_ms"]
    lines = [
        f"loop       {running['device']}, bundle {running['bundle'][:8]} on {running['engine']}, "
        f"link {running['link']}",
        f"           {count(running['frames'], 'frame')}, {running['missed']} missed",
        f"{'':11}{'hop':12}{'p50':>9}{'p95':>9}{'p99':>9}  ms",
    ]
    for hop, *spans in running["hops"]:
        lines.append(f"{'':11}{hop:12}" + "".join(f"{span:9.3f}" for span in spans))
        if hop == "all":
            left = period_ms - spans[-1]
            lines.append(f"{'':11}{left:.1f} of {period_ms:g} ms are idle in 99 of 100 frames")
    return lines


def read_service() -> dict[str, str]:
    """Return the service's properties in systemd; {} where there is no systemd."""
    if not shutil.which("systemctl"):
        return {}
    command = ["systemctl", "show", NAME, f"--property={','.join(PROPERTIES)}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=10)
    return parse(done.stdout)


def parse(text: str) -> dict[str, str]:
    """Return NAME=VALUE lines as a dict."""
    pairs = (line.partition("=") for line in text.splitlines() if "=" in line)
    return {name: value for name, _, value in pairs}


def service_lines(service: dict[str, str]) -> list[str]:
    """Return the service's state as lines."""
    if not service:
        return ["service    not checked: systemd does not run here"]
    if service.get("LoadState") != "loaded":
        return [f"service    not installed: controller service --help, then {NAME}"]
    state = f"{service['ActiveState']} ({service['SubState']})"
    if since := service.get("ActiveEnterTimestamp"):
        state += f" since {since}"
    lines = [f"service    {state}, restarted {count(int(service.get('NRestarts') or 0), 'time')}"]
    if text := service.get("StatusText"):
        lines.append(f"           {text}")
    return lines


async def _objects() -> Objects:
    if not bluez.available():
        raise BluetoothError(f"not checked: {how_to_install('bluetooth')}")
    with closing(await Bus.connect()) as bus:
        if not await bus.running():
            raise BluetoothError(
                "the Bluetooth service is not running; sudo systemctl enable --now bluetooth"
            )
        return await bus.objects()


def read_radio(objects: Objects) -> dict[str, Any]:
    """Return adapters and bonded hosts from BlueZ's objects."""
    return {
        "adapters": [
            {
                "name": path.rpartition("/")[2],
                "address": adapter["Address"],
                "on": adapter["Powered"],
                "pairing": adapter["Discoverable"],
                "hosts": [
                    {
                        "name": device.get("Alias", ""),
                        "address": device["Address"],
                        "connected": device.get("Connected", False),
                    }
                    for device in devices(objects, path).values()
                    if bonded(device)
                ],
            }
            for path, adapter in adapters(objects).items()
        ]
    }


def radio_lines(radio: dict[str, Any]) -> list[str]:
    """Return adapters and hosts as lines."""
    if "problem" in radio:
        return [f"bluetooth  {radio['problem']}"]
    if not radio["adapters"]:
        return ["bluetooth  there is no adapter"]
    lines = []
    for adapter in radio["adapters"]:
        state = "on" if adapter["on"] else "off"
        if adapter["pairing"]:
            state += ", can be found and paired with now"
        lines.append(f"bluetooth  {adapter['name']} {adapter['address']}, {state}")
        for host in adapter["hosts"]:
            state = "connected" if host["connected"] else "not connected"
            lines.append(f"           {host['name']} {host['address']}, paired, {state}")
        if not adapter["hosts"]:
            lines.append("           no host is paired: controller pair")
    return lines
