"""Bluetooth checks: a row each, with what to do about it."""

from __future__ import annotations

import asyncio
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Final

from controller.diagnostics.report import Row, Verdict
from controller.errors import how_to_install
from controller.links.bluetooth import bluez
from controller.links.bluetooth.bluez import (
    SERIAL_PORT_UUID,
    SERVICE_UUID,
    BluetoothError,
    Bus,
    Objects,
    Properties,
    adapters,
    bonded,
    devices,
)

OLDEST: Final = (5, 50)  # what has been seen to work is 5.66; ServiceRecord and Bonded are older
_GOOD, _DOUBTFUL, _FAULT, _UNKNOWN = (
    Verdict.GOOD, Verdict.DOUBTFUL, Verdict.FAULT, Verdict.UNKNOWN
)  # fmt: skip


def rows() -> list[Row]:
    """Look at everything, and return what was found; nothing is changed, and nothing raises."""
    if sys.platform != "linux":
        return [Row("Bluetooth", _UNKNOWN, f"{sys.platform} has no BlueZ", "", "no_linux")]
    found = list(blocked(Path("/sys/class/rfkill")))
    if not bluez.available():
        advice = how_to_install("bluetooth")
        return [*found, Row("dbus-fast", _FAULT, "not installed", advice, "no_dbus_fast")]
    try:
        return found + asyncio.run(_ask())
    except BluetoothError as error:
        return [*found, Row("BlueZ", _FAULT, "not reachable", str(error), "no_bluez")]


async def _ask() -> list[Row]:
    """Look at what BlueZ says."""
    with closing(await Bus.connect()) as bus:
        if not await bus.running():
            advice = "sudo apt install bluez; sudo systemctl enable --now bluetooth"
            return [Row("BlueZ", _FAULT, "bluetoothd is not running", advice, "no_bluez")]
        try:
            objects = await bus.objects()
        except BluetoothError as error:
            return [Row("permission", _FAULT, "BlueZ does not answer this user", str(error),
                        "no_permission")]  # fmt: skip
        return [version(_version()), *judge(objects), plugin(_command_line())]


def blocked(folder: Path) -> Iterator[Row]:
    """Yield the kernel's switches that block Bluetooth; `folder` has one with files for each."""
    for switch in sorted(folder.glob("rfkill*")):
        try:
            kind, soft, hard = (
                (switch / name).read_text().strip() for name in ("type", "soft", "hard")
            )
        except OSError:
            continue
        if kind == "bluetooth" and hard == "1":
            advice = "move the switch, or press the key, that turns Bluetooth off"
            yield Row(switch.name, _FAULT, "blocked by a switch", advice, "blocked")
        elif kind == "bluetooth" and soft == "1":
            yield Row(switch.name, _FAULT, "blocked", "rfkill unblock bluetooth", "blocked")


def version(found: str) -> Row:
    """Judge a BlueZ that runs and answers by its version, such as "5.66"; "" if it is unknown."""
    words = f"{found or 'unknown version'}, running, and answers this user"
    try:
        old = tuple(int(part) for part in found.split(".")) < OLDEST
    except ValueError:
        return Row("BlueZ", _UNKNOWN, words)
    if old:
        advice = "update the system: 5.66 is what was tried"
        return Row("BlueZ", _DOUBTFUL, f"{found} is old", advice, "old_bluez")
    return Row("BlueZ", _GOOD, words)


def plugin(command_line: str) -> Row:
    """Say whether BlueZ's input plugin is in the way of classic HID; "": who knows."""
    if not command_line:
        return Row("input plugin", _UNKNOWN, "bluetoothd's options cannot be read")
    off = any(option in command_line for option in ("--noplugin=input", "--noplugin=*", "-P input"))
    return Row("input plugin", _GOOD, "switched off: classic HID can be offered, too" if off else
               "on, as usual: HID over GATT and RFCOMM can be offered; classic HID (hid:classic) "
               "needs bluetoothd --noplugin=input")  # fmt: skip


def _version() -> str:
    """Return BlueZ's version as bluetoothctl says it; "" if it does not."""
    program = shutil.which("bluetoothctl")
    if not program:
        return ""
    done = subprocess.run(
        [program, "--version"], capture_output=True, text=True, check=False, timeout=10
    )
    return (done.stdout.split() or [""])[-1]


def _command_line() -> str:
    """Return how bluetoothd was started; "" if that cannot be read."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if (folder / "comm").read_text().strip() == "bluetoothd":
                return (folder / "cmdline").read_text().replace("\0", " ").strip()
        except OSError:
            continue
    return ""


def judge(objects: Objects) -> list[Row]:
    """Judge adapters, what is registered with them, and bonds."""
    found = adapters(objects)
    if not found:
        advice = "plug one in, or wake the built-in one: sudo systemctl restart hciuart bluetooth"
        return [Row("adapter", _FAULT, "there is none", advice, "no_adapter")]
    result: list[Row] = []
    for path, adapter in found.items():
        result += _adapter(path.rpartition("/")[2], adapter)
        result.append(_bonds(path.rpartition("/")[2], devices(objects, path)))
    return result


def _adapter(name: str, adapter: Properties) -> Iterator[Row]:
    where = f"{adapter.get('Address', 'no address')}, called {adapter.get('Alias', '')!r}"
    if not adapter.get("Powered"):
        yield Row(f"adapter {name}", _FAULT, f"{where}, is off", "bluetoothctl power on", "off")
        return
    yield Row(f"adapter {name}", _GOOD, f"{where}, on")
    uuids = [str(uuid).lower() for uuid in adapter.get("UUIDs", ())]
    if SERVICE_UUID in uuids:
        yield Row(f"service {name}", _GOOD, "the orb waits for hosts: its service is registered")
    else:
        advice = "start it: sudo systemctl start orbtouch, or controller --link rfcomm:"
        yield Row(f"service {name}", _DOUBTFUL, "no controller has registered one", advice,
                  "no_service")  # fmt: skip
        if SERIAL_PORT_UUID in uuids:
            advice = "hosts may take it for the orb; end it (ModemManager, blueman, a tutorial's)"
            yield Row(f"ports {name}", _DOUBTFUL, "another program offers a serial port", advice,
                      "other_serial_port")  # fmt: skip
    if adapter.get("Discoverable") and not adapter.get("DiscoverableTimeout"):
        advice = "bluetoothctl discoverable off"
        yield Row(f"window {name}", _DOUBTFUL, "anybody can find it, without end", advice,
                  "always_discoverable")  # fmt: skip


def _bonds(name: str, known: dict[str, Properties]) -> Row:
    hosts = [device for device in known.values() if bonded(device)]
    if not hosts:
        return Row(f"bonds {name}", _DOUBTFUL, "no host is paired", "controller pair", "no_bond")
    told = ", ".join(f"{host.get('Alias', '')} {host['Address']}" for host in hosts)
    shy = [host for host in hosts if not host.get("Trusted")]
    if shy:
        advice = f"bluetoothctl trust {shy[0]['Address']}"
        return Row(f"bonds {name}", _DOUBTFUL, f"{told}: not trusted", advice, "not_trusted")
    return Row(f"bonds {name}", _GOOD, told)
