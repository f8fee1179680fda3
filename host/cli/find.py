"""host find: list the orbs that are there, and those that were."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Final

from controller.shared.arguments import Parser
from controller.shared.errors import complain, one_line
from controller.shared.protocol import psk
from host.cli import add_option, warn
from host.connection import discovery
from host.connection.device_store import DeviceStore, KnownDevice

_TITLES: Final = ("device", "name", "kind", "port", "seen")  # of the columns of the list


def main(argv: list[str]) -> int:
    """List devices; return 0 if one is there, 1 if none is, 2 for wrong usage."""
    options = _parser().parse_args(argv)
    memory = DeviceStore(warn=warn)
    ports = discovery.candidates(memory, everything=options.all)
    if options.ports:
        ports = {url: ports.get(url, "") for url in options.ports}
    if options.key is not None:
        try:
            psk.read(Path(options.key))  # so that an error in it is reported once
        except psk.KeyFileError as error:
            return complain("host", error, 2)
        ports = dict.fromkeys(ports, options.key)
    answers = discovery.ask_all(ports, deadline_s=discovery.DEADLINE_S)
    discovery.note(memory, answers)
    found = [_row(device) for device in discovery.listing(answers, memory.devices)]
    if options.json:
        told = [asdict(answer) for answer in answers]
        print(json.dumps({"devices": found, "answers": told}))
    else:
        _print(found)
    for line in discovery.remarks(answers):
        warn(line)
    if not ports:
        warn(_NOTHING)
    return 0 if any(row["seen"] == discovery.NOW for row in found) else 1


def _row(device: KnownDevice) -> dict[str, str]:
    kind = "virtual" if device.virtual else "orb"
    cells = device.device_id, device.name, kind, device.port, device.seen
    return dict(zip(_TITLES, cells, strict=True))


def _print(found: list[dict[str, str]]) -> None:
    if not found:
        return
    titles = (*_TITLES[:-1], "last seen")
    table = [titles, *(tuple(map(one_line, row.values())) for row in found)]
    widths = [max(len(row[column]) for row in table) for column in range(len(_TITLES))]
    for row in table:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        print("  ".join(cells).rstrip())


_NOTHING: Final = (
    "no port looks like an orb's; plug it in or pair it, name its port (host find PORT), or let "
    "every serial port be opened (host find --all)"
)


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="host find",
        description="List orbs by their identity. Asked are the ports where one was before, those "
        "whose USB descriptor says that they may be one, and bonded ones.",
        epilog="Play with one of them, wherever it is plugged in: host --device NAME",
    )
    add = partial(add_option, parser)
    add("ports PORT", "ask these ports or URLs, and no others", nargs="*")
    add("--all", "open every serial port; each is sent our Hello")
    add("--key FILE", "the key that the orbs ask for (default: the remembered one)")
    add("--json", "print one line of JSON")
    return parser
