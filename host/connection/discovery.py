"""Discovery of orbs by their identity, whatever port they are behind.

Opened are only ports where an orb has been before, those whose USB descriptor says that they may
be one, and those of bonded Bluetooth devices; any other when the user asks for it. Ports are listed
and asked on threads with a deadline, because listing, opening and closing one can hang for longer
than a user waits; Windows' list stalls on Bluetooth ports whose device is away.
"""

from __future__ import annotations

import asyncio
import logging
import queue
import secrets
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, TypeVar

from serial.tools import list_ports

from controller.shared.bluetooth import bluez
from controller.shared.bluetooth.bluez import (
    ALIAS,
    SERVICE_UUID,
    BluetoothError,
    Bus,
    bonded,
    devices,
)
from controller.shared.protocol import psk
from controller.shared.protocol.auth import NONCE
from controller.shared.protocol.host_session import HostSession
from controller.shared.protocol.link_events import Connected, Received, Refused
from controller.shared.protocol.messages import SILENCE_MS
from host.connection.device_store import DeviceStore, KnownDevice
from host.connection.transport import LinkError, Transport, open_transport

DEADLINE_S: Final = 8.0  # for ports to open, and 2 s
LIST_S: Final = 5.0  # for the list; then there is none
BLUEZ_S: Final = 2.0  # for BlueZ to answer
NOW: Final = "now"  # when a device was seen that has just answered
PRODUCT: Final = "orbtouch"  # in a USB descriptor of ours, in any case
# A Raspberry Pi's own USB port, when it is set up as a serial device: as one, or among others.
USB: Final = ((0x0525, 0xA4A7), (0x1D6B, 0x0104))
_BONDED: Final = ("BTHENUM", "/dev/rfcomm")  # Windows' hardware id; Linux's name of a bound channel

log = logging.getLogger(__name__)

Result = TypeVar("Result")
Ports = dict[str, str]  # names or URLs, with the file of the key of the orb there; "": none
Outcome = Literal["orb", "refused", "foreign", "closed", "stuck"]


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer of a port.

    Outcomes: "orb", a device, named below; "refused", one that would not talk to us; "foreign",
    something else, or nothing; "closed", it does not open; "stuck", it hangs.
    """

    url: str
    outcome: Outcome
    why: str = ""  # one sentence, if it is no orb
    device_id: str = ""
    name: str = ""
    virtual: bool = False


# --- the ports there are ---


def candidates(memory: DeviceStore, *, everything: bool = False) -> Ports:
    """Return the ports to ask, remembered ones first; with `everything`, all there are."""
    ports = {known.port: known.key for known in memory.devices if known.port}
    found = _by_deadline([lambda: listed(everything=everything)], LIST_S)[0] or []
    return {**ports, **{url: "" for url in found if url not in ports}}


def listed(*, everything: bool = False) -> list[str]:
    """Return serial ports that may be an orb's, or everything; and orbs that BlueZ has paired."""
    entries = list_ports.comports()
    return [port.device for port in entries if everything or may_be_orb(port)] + paired()


def may_be_orb(entry: Any) -> bool:
    """Return whether a `serial.tools.list_ports_common.ListPortInfo` describes an orb's port."""
    words = f"{entry.manufacturer} {entry.product} {entry.description}".lower()
    bound = entry.device.startswith(_BONDED) or str(entry.hwid).startswith(_BONDED)
    return PRODUCT in words or (entry.vid, entry.pid) in USB or bound


def paired() -> list[str]:
    """Return the URLs of orbs that BlueZ has paired; none where there is no BlueZ."""

    async def objects() -> bluez.Objects:
        with closing(await Bus.connect()) as bus:
            return await bus.objects()

    try:
        found = asyncio.run(asyncio.wait_for(objects(), BLUEZ_S)) if bluez.available() else {}
    except (BluetoothError, TimeoutError):
        return []
    return [
        f"rfcomm://{device['Address']}"
        for device in devices(found).values()
        if bonded(device)
        and (SERVICE_UUID in device.get("UUIDs", ()) or device.get("Alias") == ALIAS)
    ]


def _by_deadline(
    calls: Sequence[Callable[[], Result]],
    seconds: float,
    each: Callable[[Result], object] = lambda result: None,
) -> list[Result | None]:
    """Call functions at once, on threads; return their results, None for those that hang.

    `each` is called with every result as it comes.
    """
    done: queue.SimpleQueue[tuple[int, Result]] = queue.SimpleQueue()
    for number, call in enumerate(calls):

        def run(number: int = number, call: Callable[[], Result] = call) -> None:
            done.put((number, call()))

        threading.Thread(target=run, daemon=True).start()
    results: list[Result | None] = [None] * len(calls)
    end_s = time.monotonic() + seconds
    try:
        for _ in calls:
            number, result = done.get(timeout=max(end_s - time.monotonic(), 0.0))
            results[number] = result
            each(result)
    except queue.Empty:
        pass
    return results


# --- asking them ---


def ask_all(
    ports: Ports,
    *,
    deadline_s: float = DEADLINE_S,
    each: Callable[[Answer], object] = lambda answer: None,
) -> list[Answer]:
    """Ask every port once, all by one deadline; return the answers in that order.

    `each` is called with every answer as it comes.
    """
    calls: list[Callable[[], Answer]] = [partial(ask, url, key) for url, key in ports.items()]
    answers = _by_deadline(calls, deadline_s, each)
    return [
        answer or Answer(url, "stuck", f"{url} hangs for longer than {deadline_s:g} s")
        for url, answer in zip(ports, answers, strict=True)
    ]


def ask(url: str, key: str = "") -> Answer:
    """Open a port, send Hello, wait for the answer, and send Bye; `key` is the file of a key."""
    try:
        secret = psk.read(Path(key)) if key else b""
        transport = open_transport(url)
    except (OSError, psk.KeyFileError) as error:
        return Answer(url, "closed", str(error))
    try:
        return converse(transport, url, secret)
    except OSError as error:
        return Answer(url, "foreign", f"{url} was cut off: {error}")
    finally:
        transport.close()


def converse(
    transport: Transport, url: str, key: bytes = b"", clock: Callable[[], float] = time.monotonic
) -> Answer:
    """Ask over an open port; it takes 2 s at most, however much is said there."""

    def now_ms() -> int:
        return round(clock() * 1000)

    began_ms = now_ms()
    sequence, nonce = secrets.randbelow(0x10000), secrets.token_bytes(NONCE)
    session = HostSession(url, sequence, began_ms, key=key, nonce=nonce)
    news: list[Received] = []
    while not news:
        transport.write(bytes(session.output))
        session.output.clear()
        data = transport.read(session.wait_ms(now_ms()) / 1000)
        news = session.receive(data, now_ms()) if data else session.tick(now_ms())
    match news[0]:
        case Connected(welcome=welcome):
            session.close("the host was only looking who is there", now_ms())
            transport.write(bytes(session.output))
            if not welcome.device_id:
                return Answer(url, "foreign", f"{url} answers, but says no identity")
            return Answer(url, "orb", "", welcome.device_id, welcome.name, welcome.virtual)
        case Refused(reason=reason):
            early = now_ms() - began_ms < SILENCE_MS  # else it is our own impatience that speaks
            return Answer(url, "refused" if early else "foreign", reason)
        case other:
            return Answer(url, "foreign", f"{url}: {other}")


# --- what they say ---


def note(memory: DeviceStore, answers: list[Answer]) -> None:
    """Remember where devices are; one that two ports claim to be stays where it was."""
    for answer in answers:
        if answer.outcome == "orb" and len(claiming(answers, answer.device_id)) == 1:
            told = {"name": answer.name, "virtual": answer.virtual, "port": answer.url}
            memory.remember(answer.device_id, **told, seen=now())


def listing(answers: list[Answer], known: list[KnownDevice]) -> list[KnownDevice]:
    """Return the devices that have answered, seen `NOW`, and then those only remembered."""
    keys = {device.device_id: device.key for device in known}
    here = [
        KnownDevice(a.device_id, a.name, a.virtual, a.url, NOW, key=keys.get(a.device_id, ""))
        for a in answers
        if a.outcome == "orb"
    ]
    present = {device.device_id for device in here}
    return here + [device for device in known if device.device_id not in present]


def now() -> str:
    """Return the time, as the device store writes it."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def claiming(answers: list[Answer], device_id: str) -> list[str]:
    """Return the ports that claim to be a device's."""
    return [a.url for a in answers if a.outcome == "orb" and a.device_id == device_id]


def remarks(answers: list[Answer]) -> list[str]:
    """Return a sentence for every port that is no orb, and for identities that are there twice."""
    lines = [answer.why for answer in answers if answer.outcome != "orb"]
    for device_id in dict.fromkeys(a.device_id for a in answers if a.outcome == "orb"):
        claims = claiming(answers, device_id)
        if len(claims) > 1:
            lines.append(
                f"{len(claims)} ports say that they are {device_id}: {', '.join(claims)}; "
                "name the one that you mean with --link"
            )
    return lines


class DevicePort:
    """Opens the port of one device: pass `open` to a Receiver, and subscribe `on_received` to it.

    Its `url` is where the device was last.
    """

    def __init__(self, words: str, memory: DeviceStore, key: str = "", *, at: str = "") -> None:
        """Look for a device by its identity or name; LinkError if it is nowhere, or means several.

        `key` is the file with its key; "": the one that is remembered, if any. With `at`, its port,
        `words` are its identity, and it is looked for only when `open` does not find it there.
        """
        self._memory, self._key = memory, key
        self.device_id, self.url = words, at
        if at:
            return
        answer = self._seek(words)
        self.device_id, self.url = answer.device_id, answer.url

    def open(self) -> Transport:
        """Open the port where it was last, or look for it again; LinkError if it is nowhere."""
        try:
            return open_transport(self.url)
        except LinkError as error:
            log.info("%s; looking for %s", error, self.device_id)
            self.url = self._seek(self.device_id).url
            return open_transport(self.url)

    def on_received(self, received: Sequence[Received]) -> None:
        """Raise LinkError if another device is behind the port now."""
        for news in received:
            if isinstance(news, Connected) and news.welcome.device_id != self.device_id:
                raise LinkError(
                    f"at {self.url} is now {news.welcome.device_id}, not {self.device_id}; "
                    "start again, and it is looked for on the other ports"
                )

    def _seek(self, words: str) -> Answer:
        known = self._memory.named(words)
        # Where it was first: if it is there, no other port need be touched.
        first = [device.port for device in known if device.port]
        key = self._key or next((device.key for device in known), "")
        answers = ask_all(dict.fromkeys(first, key))
        if not _matching(answers, words):
            others = [url for url in candidates(self._memory) if url not in first]
            answers += ask_all(dict.fromkeys(others, key))
        note(self._memory, answers)
        found = _matching(answers, words)
        if len(found) == 1:
            return found[0]
        if found:
            places = ", ".join(f"{a.device_id} at {a.url}" for a in found)
            raise LinkError(f"{words!r} is not one device: {places}; use --link")
        here = ", ".join(a.device_id for a in answers if a.outcome == "orb") or "no orb"
        why = "".join(f" ({a.why})" for a in answers if a.url in first[:1])
        raise LinkError(
            f"{words!r} is not there, found {here}{why}; see host find, or name its port with "
            "--link"
        )


def _matching(answers: list[Answer], words: str) -> list[Answer]:
    here = [answer for answer in answers if answer.outcome == "orb"]
    exact = [answer for answer in here if answer.device_id == words]
    return exact or [answer for answer in here if answer.name == words]
