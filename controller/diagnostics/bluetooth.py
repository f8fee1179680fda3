"""Bluetooth checks: a row each, with what to do about it."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from controller.diagnostics.report import Row, Verdict
from controller.shared.bluetooth import bluez
from controller.shared.bluetooth.bluez import (
    SERVICE_UUID,
    BluetoothError,
    Bus,
    Objects,
    Properties,
    adapters,
    bonded,
    devices,
)
from controller.shared.errors import how_to_install

_GOOD, _DOUBTFUL, _FAULT = Verdict.GOOD, Verdict.DOUBTFUL, Verdict.FAULT


def rows() -> list[Row]:
    """Look at everything, and return what was found; nothing is changed, and nothing raises."""
    if sys.platform != "linux":
        return [Row("Bluetooth", Verdict.UNKNOWN, f"{sys.platform} has no BlueZ", "", "no_linux")]
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
            found = "BlueZ does not answer this user"
            return [Row("permission", _FAULT, found, str(error), "no_permission")]
        return judge(objects)


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
        found = "no controller has registered one"
        yield Row(f"service {name}", _DOUBTFUL, found, advice, "no_service")


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
