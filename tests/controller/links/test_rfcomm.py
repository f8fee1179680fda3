"""A host and an orb over RFCOMM, with local sockets in place of the kernel's."""

from __future__ import annotations

import socket
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from typing import Any

import pytest

from tests.support.fake_device import welcome

pytest.importorskip("dbus_fast", reason="needs dbus-fast (the extra [bluetooth])")


from controller.links import open_link, rfcomm
from controller.links.bluetooth.bluez import CHANNEL, SERVICE_UUID
from controller.links.bluetooth.serial_profile import record
from controller.links.rfcomm import RfcommLink
from controller.protocol.messages import Bye, Command, Hello, Message, Perform
from host.connection.receiver import Connected, Delivered, Lost, Receiver
from host.connection.transport import open_transport
from tests.support.fake_bluez import until

ORB = "F1:F1:F1:F1:F1:F1"


class NoBluez:
    """In the thread's place: everything is registered, and nothing ever changes."""

    state = "ready"

    def __init__(self, service: Any, *_: object) -> None:
        service.address = ORB

    def start(self) -> None:
        """There is nothing to start."""

    def close(self) -> None:
        """There is nothing to close."""


@pytest.fixture
def link(monkeypatch: pytest.MonkeyPatch) -> Iterator[RfcommLink]:
    """A link to which the host's sockets lead."""
    monkeypatch.setattr(rfcomm, "RegistrationThread", NoBluez)
    link = open_link("rfcomm:", welcome())
    assert isinstance(link, RfcommLink)

    def open_channel(address: str, channel: int) -> socket.socket:
        assert (address, channel) == (ORB, CHANNEL)
        near, far = socket.socketpair()
        for end in (near, far):
            end.setblocking(False)
        link._accept(far, "a laptop", "/laptop")
        return near

    monkeypatch.setattr("host.connection.rfcomm.open_channel", open_channel)
    yield link
    link.close()


@pytest.fixture
def receiver(link: RfcommLink) -> Iterator[Receiver]:
    receiver = Receiver(lambda: open_transport(f"rfcomm://{ORB}"))
    receiver.connect()
    yield receiver
    receiver.close()


def heard(receiver: Receiver, kind: type) -> Any:
    """Return the first news, or message, of a kind."""

    def found() -> Any:
        receiver.wait(0.1)
        for item in receiver.poll():
            inner = item.message if isinstance(item, Delivered) else item
            if isinstance(inner, kind):
                return inner
        return None

    return until(found)


def asked(link: RfcommLink, kind: type[Message]) -> Message:
    """Return the first request of a kind."""

    def found() -> Message | None:
        link.wait(0.1)
        return next((request for request in link.poll() if isinstance(request, kind)), None)

    request = until(found)
    assert isinstance(request, Message)
    return request


def test_a_command_arrives(link: RfcommLink, receiver: Receiver) -> None:
    assert heard(receiver, Connected).welcome.name == "OrbTouch"
    asked(link, Hello)
    link.send(Command("drop", "pinch", 0.9, None, 1), 10)
    assert heard(receiver, Command).name == "drop"


def test_what_the_host_asks_for_arrives(link: RfcommLink, receiver: Receiver) -> None:
    asked(link, Hello)
    receiver.send(Perform(1, "press", 2.0, 1.0))
    request = asked(link, Perform)
    assert isinstance(request, Perform)
    assert request.label == "press"


def test_a_host_that_closes_has_gone_for_the_orb(link: RfcommLink, receiver: Receiver) -> None:
    asked(link, Hello)
    receiver.close()
    asked(link, Bye)


def test_a_link_that_bluez_disconnects_is_lost_and_connected_again(
    link: RfcommLink, receiver: Receiver
) -> None:
    asked(link, Hello)
    link._leave("/laptop")
    heard(receiver, Lost)
    heard(receiver, Connected)


def test_the_record_in_our_xml_says_to_bumble_what_it_should() -> None:
    sdp = pytest.importorskip("bumble.sdp", reason="needs bumble, which brings compiled wheels")
    from bumble.core import UUID

    def element(node: ElementTree.Element) -> Any:
        value, kinds = node.attrib.get("value", ""), sdp.DataElement
        match node.tag:
            case "sequence":
                return kinds.sequence([element(child) for child in node])
            case "uuid":
                short = value.startswith("0x")
                return kinds.uuid(UUID.from_16_bits(int(value, 16)) if short else UUID(value))
            case "uint8":
                return kinds.unsigned_integer_8(int(value, 16))
            case "uint16":
                return kinds.unsigned_integer_16(int(value, 16))
        return kinds(kinds.TEXT_STRING, value.encode())

    attributes = ElementTree.fromstring(record())
    values = {int(each.attrib["id"], 16): element(each[0]).value for each in attributes}
    classes = [str(one.value) for one in values[0x0001]]
    assert classes[0].lower() == SERVICE_UUID
    assert "1101" in classes[1]
    protocols = values[0x0004]
    assert [str(layer.value[0].value) for layer in protocols] == [
        "UUID-16:0100 (L2CAP)",
        "UUID-16:0003 (RFCOMM)",
    ]
    assert protocols[1].value[1].value == CHANNEL
