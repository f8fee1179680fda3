"""Storage of the hosts of the last run, and the charge of the device's battery."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import re
from pathlib import Path
from typing import Final

from controller.config import MAX_BYTES, parse_json
from controller.files import atomic_write, read_bytes, state_folder
from controller.links.bluetooth.hid.host_selection import StoredHosts

FULL: Final = 100  # percent; also without a battery
SUPPLIES: Final = Path("/sys/class/power_supply")  # Linux: ABI/testing/sysfs-class-power
_ADDRESS: Final = re.compile(r"([0-9A-F]{2}:){5}[0-9A-F]{2}")

log = logging.getLogger(__name__)


def place() -> Path:
    """Return the path of the stored hosts; a systemd service has its own state folder."""
    folder = os.environ.get("STATE_DIRECTORY", "").partition(":")[0]
    state = Path(folder) if folder else state_folder()
    return state / "hid-hosts.json"


def recall(path: Path) -> StoredHosts:
    """Return the hosts of the last run; none if the file is missing or damaged."""
    try:
        found = parse_json(read_bytes(path, MAX_BYTES))
        hosts, wanted = tuple(found["hosts"]), found["wanted"]
    except FileNotFoundError:
        return StoredHosts()
    except (OSError, ValueError, KeyError, TypeError) as error:
        log.warning("cannot read %s, so no host is known: %s", path, error)
        return StoredHosts()
    known = [host for host in hosts if is_address(host)]
    return StoredHosts(tuple(dict.fromkeys(known)), wanted if wanted in known else "")


def remember(path: Path, known: StoredHosts) -> None:
    """Store the hosts for the next run; a failing disk only causes a warning."""
    try:
        atomic_write(path, json.dumps({"hosts": known.hosts, "wanted": known.wanted}).encode())
    except OSError as error:
        log.warning("cannot write %s, so the next run will not know its hosts: %s", path, error)


def is_address(text: object) -> bool:
    """Return whether this is a Bluetooth address in BlueZ's notation."""
    return isinstance(text, str) and _ADDRESS.fullmatch(text) is not None


def charge(supplies: Path = SUPPLIES) -> int:
    """Return the battery's charge in percent; `FULL` without one."""
    for supply in sorted(supplies.glob("*")):
        with contextlib.suppress(OSError, ValueError):
            if (supply / "type").read_text().strip() == "Battery":
                return min(max(int((supply / "capacity").read_text()), 0), FULL)
    return FULL
