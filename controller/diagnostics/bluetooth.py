"""Bluetooth checks: a row each, with what to do about it."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Iterator
from contextlib import closing

from controller.diagnostics.report import Row, Verdict
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

_GOOD, _DOUBTFUL, _FAULT = Verdict.GOOD, Verdict.DOUBTFUL, Verdict.FAULT


def rows() -> list[Row]:
    """Look at adapters, services and bonds; nothing is changed, and nothing raises."""
    if sys.platform != "linux":
        return [Row("Bluetooth", Verdict.UNKNOWN, f"{sys.platform} has no BlueZ", "", "no_linux")]
    try:
        return asyncio.run(_ask())
    except BluetoothError as error:
        found, _, advice = str(error).partition("; ")
        return [Row("BlueZ", _FAULT, found, advice, "no_bluez")]


async def _ask() -> list[Row]:
    with closing(await Bus.connect()) as bus:
        await bus.adapter()  # BluetoothError says which of daemon, permission and adapter lacks
        return judge(await bus.objects())


def judge(objects: Objects) -> list[Row]:
    """Judge adapters, what is registered with them, and bonds."""
    result: list[Row] = []
    for path, adapter in adapters(objects).items():
        result += _adapter(path.rpartition("/")[2], adapter)
        result.append(_bonds(path.rpartition("/")[2], devices(objects, path)))
    return result


def _adapter(name: str, adapter: Properties) -> Iterator[Row]:
    where = f"{adapter.get('Address', 'no address')}, called {adapter.get('Alias', '')!r}"
    if not adapter.get("Powered"):
        advice = "rfkill unblock bluetooth; bluetoothctl power on"
        yield Row(f"adapter {name}", _FAULT, f"{where}, is off", advice, "off")
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
