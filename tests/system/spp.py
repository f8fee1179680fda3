"""Parts of the serial cases: a waiting orb, a pairing, a demo game."""

from __future__ import annotations

import json
import re
import threading
from typing import Any

from .guest import CaseError, Guest, Process
from .input import SerialDesktop

SEED = "7"
SECONDS = "12"


def orb(guest: Guest) -> tuple[Process, str]:
    """Start a virtual orb that waits on the second adapter; return it and the URL it tells."""
    link = f"rfcomm:{guest.addresses[1]}"
    words = ["--sensor", "virtual", "--seed", SEED, "--link", link]
    process = guest.python("controller", *words)
    line = process.expect('"listening"')
    return process, json.loads(line)["listening"]


def pair(guest: Guest) -> str:
    """Pair hci0 with the orb on hci1 as two people would; return the digits."""
    window = guest.python("controller", "pair", "--adapter", "hci1", name="controller-pair")
    window.expect("waiting for a host")
    settings = SerialDesktop(guest)
    thread = threading.Thread(target=settings.pair_with_digits)
    thread.start()
    asked = digits(guest, window, "is it the same")
    window.say("y")
    thread.join()
    if settings.shown != [asked]:
        raise CaseError(f"the two sides show {settings.shown} and {asked}")
    _paired(window, settings)
    return asked


def pair_quickly(guest: Guest) -> None:
    """Pair both adapters with nobody looking."""
    window = guest.python("controller", "pair", "--yes", "--adapter", "hci1", name="window")
    window.expect("waiting for a host")
    settings = SerialDesktop(guest)
    settings.find()
    settings.pair()
    _paired(window, settings)


def _paired(window: Process, settings: SerialDesktop) -> None:
    settings.close()
    window.expect("paired with")
    if window.wait():
        raise CaseError("pairing did not end well")


def digits(guest: Guest, process: Process, question: str) -> str:
    """Return the six digits of a question that has no end of line yet."""
    found = guest.until(
        lambda: re.search(r"shows (\d{6}); " + re.escape(question), process.heard), question
    )
    return str(found[1])


def game(guest: Guest, link: str | None) -> dict[str, Any]:
    """Play a demo game, over a link or with an orb of its own; return its verdict without bytes."""
    words = ["--demo", "--headless", "--seed", SEED, "--seconds", SECONDS, "--json"]
    process = guest.python("host", *words, *(["--link", link] if link else []), name="host-demo")
    if process.wait():
        raise CaseError(f"host ended badly: {process.lines[-3:]}")
    verdict: dict[str, Any] = json.loads(process.lines[-1])
    del verdict["link_bytes"]
    return verdict


def told(verdict: dict[str, Any]) -> str:
    """Return a game in a few words."""
    return (
        f"{len(verdict['commands'])} commands, {verdict['hits']} of {verdict['intended']} "
        f"gestures understood, {verdict['pieces']} pieces"
    )


def round_trips(guest: Guest, link: str) -> list[float]:
    """Return how long grants took over a link."""
    process = guest.python(f"{__package__}.play", link, name="play")
    if process.wait():
        raise CaseError(f"play ended badly: {process.lines[-3:]}")
    return list(json.loads(process.lines[-1])["seconds"])
