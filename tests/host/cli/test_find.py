"""host find: devices by their identity, among ports that are stuck, lie, or are somebody else's."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import json
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from controller.links import open_link
from controller.shared.protocol import psk
from host.cli import find
from host.connection import discovery
from host.connection.device_store import DeviceStore
from host.connection.discovery import Answer, DevicePort
from host.connection.receiver import Connected
from host.connection.transport import LinkError, _Polled, open_transport
from tests.support.fake_device import welcome
from tests.support.pytest_types import Capture, Patch
from tests.support.serial_cable import Cable


def orb_welcome(device_id: str, name: str = "OrbTouch"):  # type: ignore[no-untyped-def]
    return dataclasses.replace(welcome(virtual=False), device_id=device_id, name=name)


@pytest.fixture
def desk() -> Iterator[Desk]:
    with contextlib.ExitStack() as stack:
        yield Desk(stack)


class Desk:
    """Devices at the end of cables; `plug` says which is at which."""

    def __init__(self, stack: contextlib.ExitStack) -> None:
        self._stack = stack

    def plug(self, device_id: str, name: str = "OrbTouch", key: bytes = b"") -> str:
        """Put a device behind a new port, and return the port."""
        cable = Cable()
        self._stack.callback(cable.close)
        link = open_link(cable.ends[0], orb_welcome(device_id, name), key=key)
        self._stack.callback(link.close)
        return cable.ends[1]


@pytest.fixture
def memory(tmp_path: Path, monkeypatch: Patch) -> DeviceStore:
    """The devices known here, on a system that lists no ports."""
    path = tmp_path / "devices.toml"
    monkeypatch.setattr("host.connection.device_store.default_path", lambda: path)
    monkeypatch.setattr(discovery, "listed", lambda everything: [])
    return DeviceStore()


def hurried() -> float:
    """A clock that runs ahead, so that nobody waits for what will not come."""
    return next(_TICKS) * 0.3


_TICKS = itertools.count()


def test_device_says_who_it_is(desk: Desk) -> None:
    port = desk.plug("orb-1", "Blue")
    assert discovery.ask(port) == Answer(port, "orb", "", "orb-1", "Blue", False)
    assert discovery.ask(port).outcome == "orb"  # it was let go properly


def test_device_with_garbage_before_its_answer_is_still_found(desk: Desk) -> None:
    cable = Cable()
    device = os.open(cable.ends[0], os.O_RDWR | os.O_NOCTTY)
    os.write(device, b"boot: \x11\x22 login:\r\n\0\x05junk")
    os.close(device)
    link = open_link(cable.ends[0], orb_welcome("orb-1"))
    assert discovery.ask(cable.ends[1]).device_id == "orb-1"
    link.close()
    cable.close()


def test_foreign_device_that_talks_garbage_is_said_to_be_none() -> None:
    cable = Cable()
    device = os.open(cable.ends[0], os.O_RDWR | os.O_NOCTTY)
    transport = open_transport(cable.ends[1])
    os.write(device, b"$GPGGA,092750.000,5321.6802,N*76\r\n" * 20)
    assert transport.read(10.0)  # it is on its way
    os.write(device, b"$GPGSV,3,3,11,29,09,301,24\r\n\0" * 20)
    answer = discovery.converse(transport, "the receiver", clock=hurried)
    assert answer.outcome == "foreign"
    assert "not the OrbTouch protocol" in answer.why
    transport.close()
    os.close(device)
    cable.close()


def test_orb_with_a_key_is_found_with_it(desk: Desk, memory: DeviceStore, tmp_path: Path) -> None:
    file = tmp_path / "orb.key"
    port = desk.plug("orb-1", key=psk.read_or_make(file))
    refused = discovery.ask(port)
    assert (refused.outcome, refused.device_id) == ("refused", "")
    assert "key" in refused.why
    assert discovery.ask(port, str(file)).device_id == "orb-1"
    memory.remember("orb-1", port=port, key=str(file))
    assert DevicePort("orb-1", memory).device_id == "orb-1"  # with the remembered one
    assert "cannot read the key" in discovery.ask(port, str(tmp_path / "none")).why


class Mute(_Polled):
    """A port behind which nobody is."""

    name = "mute"

    def __init__(self) -> None:
        pass

    def read(self, timeout_s: float) -> bytes:
        return b""

    def write(self, data: bytes) -> None:
        pass

    def wake(self) -> None:
        pass

    def close(self) -> None:
        pass


class Flood(Mute):
    """One that never stops."""

    def read(self, timeout_s: float) -> bytes:
        return b"\x07" * 16_384


@pytest.mark.parametrize(
    ("transport", "words"), [(Mute(), "no OrbTouch answered"), (Flood(), "sends bytes")]
)
def test_silence_and_floods_end_after_two_seconds(transport: Mute, words: str) -> None:
    answer = discovery.converse(transport, "the port", clock=hurried)
    assert answer.outcome == "foreign"
    assert words in answer.why


def test_port_that_does_not_open_says_why(tmp_path: Path) -> None:
    answer = discovery.ask(str(tmp_path / "nothing"))
    assert answer.outcome == "closed"
    assert "there is no such port" in answer.why


def test_device_without_an_identity_is_none(desk: Desk) -> None:
    answer = discovery.ask(desk.plug(""))
    assert (answer.outcome, answer.device_id) == ("foreign", "")
    assert "says no identity" in answer.why


def test_a_stuck_port_hangs_nobody(desk: Desk, monkeypatch: Patch) -> None:
    over, ask = threading.Event(), discovery.ask
    port = desk.plug("orb-1")

    def stuck(url: str, key: str) -> Answer:
        if url != port:
            assert over.wait(60.0)
        return ask(url, key)

    monkeypatch.setattr(discovery, "ask", stuck)
    found, hangs = discovery.ask_all({port: "", "/dev/stuck": ""}, deadline_s=5.0)
    over.set()
    assert found.device_id == "orb-1"
    assert hangs.outcome == "stuck"
    assert "/dev/stuck hangs" in hangs.why


def test_devices_are_listed_by_identity_not_port(memory: DeviceStore, capsys: Capture) -> None:
    names = ["orb-1", "orb-2", "orb-3"]
    for order in (names, names[::-1], ["orb-2", "orb-3", "orb-1"]):
        with contextlib.ExitStack() as stack:
            desk = Desk(stack)
            places = {device_id: desk.plug(device_id) for device_id in order}
            assert find.main(["--json", *places.values()]) == 0
            told = json.loads(capsys.readouterr().out)["devices"]
            assert {row["device"]: row["port"] for row in told} == places
            assert {row["seen"] for row in told} == {"now"}
            assert {k.device_id: k.port for k in DeviceStore().devices} == places


def test_device_is_found_on_a_new_port(desk: Desk, memory: DeviceStore, monkeypatch: Patch) -> None:
    old, new = desk.plug("orb-2"), desk.plug("orb-1", "Blue")
    memory.remember("orb-1", name="Blue", port=old, seen="1")
    monkeypatch.setattr(discovery, "listed", lambda everything: [old, new])
    for words in ("orb-1", "Blue"):
        seeker = DevicePort(words, memory)
        assert (seeker.device_id, seeker.url) == ("orb-1", new)
    assert {k.device_id: k.port for k in DeviceStore().devices} == {"orb-1": new, "orb-2": old}


def test_device_where_it_was_opens_one(desk: Desk, memory: DeviceStore, monkeypatch: Patch) -> None:
    monkeypatch.setattr(discovery, "listed", lambda everything: pytest.fail("it was listed"))
    port = desk.plug("orb-1")
    memory.remember("orb-1", port=port)
    assert DevicePort("orb-1", memory).url == port


def test_port_that_vanished_is_looked_for_when_reopened(desk: Desk, memory: DeviceStore) -> None:
    new = desk.plug("orb-1")
    memory.remember("orb-1", port=new)
    seeker = DevicePort("orb-1", memory)
    seeker.url = "/dev/gone"
    transport = seeker.open()
    transport.close()
    assert transport.name == new


def test_double_identity_is_not_chosen(desk: Desk, memory: DeviceStore, monkeypatch: Patch) -> None:
    real, liar = desk.plug("orb-1"), desk.plug("orb-1")
    answers = discovery.ask_all({real: "", liar: ""})
    assert len(discovery.listing(answers, [])) == 2
    assert "2 ports say that they are orb-1" in discovery.remarks(answers)[0]
    discovery.note(memory, answers)
    assert memory.devices == []
    monkeypatch.setattr(discovery, "listed", lambda everything: [real, liar])
    with pytest.raises(LinkError, match="is not one device"):
        DevicePort("orb-1", memory)


def test_device_that_turns_out_to_be_another_ends_it(desk: Desk, memory: DeviceStore) -> None:
    memory.remember("orb-1", port=desk.plug("orb-1"))
    seeker = DevicePort("orb-1", memory)
    seeker.on_received([Connected(orb_welcome("orb-1"))])
    with pytest.raises(LinkError, match="is now orb-9, not orb-1"):
        seeker.on_received([Connected(orb_welcome("orb-9"))])


def test_device_that_is_nowhere_is_one_sentence(memory: DeviceStore) -> None:
    with pytest.raises(LinkError, match="'orb-1' is not there, found no orb; see host find"):
        DevicePort("orb-1", memory)


def test_only_remembered_named_or_bonded_are_asked(tmp_path: Path, monkeypatch: Patch) -> None:
    memory = DeviceStore(tmp_path / "devices.toml")
    memory.remember("orb-1", port="/dev/ttyUSB7", seen="1")
    system = [
        entry("/dev/ttyS0", "n/a"),
        entry("/dev/ttyUSB0", "USB Serial", vid=0x0403, pid=0x6001, product="FT232R"),
        entry("/dev/ttyACM0", "g", vid=0x0525, pid=0xA4A7, product="Gadget Serial"),
        entry("/dev/ttyACM1", "?", vid=0x1209, pid=0x0001, product="OrbTouch 2"),
        entry("/dev/rfcomm0", "n/a"),
        entry("COM9", "Bluetooth link", hwid=r"BTHENUM\{00001101-0000-1000-8000}"),
    ]
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: system)
    monkeypatch.setattr(discovery, "paired", list)
    chosen = [*discovery.candidates(memory)]
    assert chosen == ["/dev/ttyUSB7", "/dev/ttyACM0", "/dev/ttyACM1", "/dev/rfcomm0", "COM9"]
    everything = [*discovery.candidates(memory, everything=True)]
    assert set(everything) == {"/dev/ttyUSB7", *(port.device for port in system)}


def entry(device: str, description: str, **values: object) -> SimpleNamespace:
    usual = {"vid": None, "pid": None, "product": None, "manufacturer": None, "hwid": "n/a"}
    return SimpleNamespace(device=device, description=description, **{**usual, **values})


def test_system_lists_its_ports() -> None:
    assert isinstance(discovery.listed(everything=True), list)


def test_nothing_to_ask_says_what_to_do(memory: DeviceStore, capsys: Capture) -> None:
    assert find.main([]) == 1
    told = capsys.readouterr()
    assert told.out == ""
    assert "host find --all" in told.err


def test_unreadable_key_is_told_first(memory: DeviceStore, tmp_path: Path, capsys: Capture) -> None:
    assert find.main(["--key", str(tmp_path / "no.key")]) == 2
    told = capsys.readouterr()
    assert (told.out, told.err.count("\n")) == ("", 1)
    assert "no.key: no such file or directory" in told.err


def test_absent_device_is_listed_with_its_last_time(memory: DeviceStore, capsys: Capture) -> None:
    memory.remember("orb-1", name="Blue", port="/dev/gone", seen="2026-11-20T18:02:00Z")
    assert find.main([]) == 1
    told = capsys.readouterr()
    assert "orb-1   Blue  orb   /dev/gone  2026-11-20T18:02:00Z" in told.out
    assert "cannot open /dev/gone: there is no such port" in told.err


def test_what_a_terminal_would_obey_is_escaped(memory: DeviceStore, capsys: Capture) -> None:
    memory.remember("orb-1\x1b[2J", name="\u202e\nBlue", port="/dev/\x07", seen="\x1b[31mnow")
    assert find.main([]) == 1
    told = capsys.readouterr()
    assert "orb-1\\x1b[2J  \\u202e\\nBlue  orb   /dev/\\x07  \\x1b[31mnow" in told.out
    assert (told.out + told.err).replace("\n", "").isprintable()
