"""A host and an orb over RFCOMM, through Bumble's virtual controllers: no kernel, no radio."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.fake_device import welcome

pytest.importorskip("bumble", reason="needs bumble, which brings compiled wheels")
pytest.importorskip("dbus_fast", reason="needs dbus-fast (the extra [bluetooth])")

from bumble.sdp import SDP_PDU, DataElement, SDP_ServiceSearchAttributeRequest

from controller.links import open_link, rfcomm
from controller.links.bluetooth.identifiers import CHANNEL, SERVICE_UUID, record
from controller.links.rfcomm import RfcommLink
from controller.protocol.messages import Bye, Command, Hello, Message, Perform
from host.bluetooth import sdp, sockets
from host.bluetooth.protocol_rfcomm import RfcommError, parse
from host.connection.receiver import Connected, Delivered, Lost, Receiver
from host.connection.transport import LinkError, open_transport
from tests.support.bumble_radio import ORB, Air, attributes
from tests.support.fake_bluez import until


class NoBluez:
    """In the thread's place: everything is registered, and nothing ever changes."""

    state = "ready"

    def __init__(self, service: Any, *_: object) -> None:
        service.address = ORB

    def start(self) -> None:
        """There is nothing to start."""

    def close(self) -> None:
        """There is nothing to close."""


@pytest.fixture(scope="module")
def air() -> Iterator[Air]:
    air = Air(record(), CHANNEL)
    yield air
    air.close()


@pytest.fixture
def wired(air: Air, monkeypatch: pytest.MonkeyPatch) -> Air:
    """Put the virtual air in the kernel's place."""
    monkeypatch.setattr(sockets, "rfcomm", air.rfcomm)
    monkeypatch.setattr(sockets, "l2cap", air.l2cap)
    monkeypatch.setattr("sys.platform", "linux")
    return air


@pytest.fixture
def link(wired: Air, monkeypatch: pytest.MonkeyPatch) -> Iterator[RfcommLink]:
    monkeypatch.setattr(rfcomm, "RegistrationThread", NoBluez)
    link = open_link("rfcomm:", welcome())
    assert isinstance(link, RfcommLink)

    def arrive(connection: socket.socket) -> None:
        connection.setblocking(False)
        link._accept(connection, "a laptop", "/laptop")

    wired.arrived = arrive
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


def test_the_channel_is_looked_up_and_a_command_arrives(
    link: RfcommLink, receiver: Receiver
) -> None:
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
    values = {attribute.id: attribute.value for attribute in attributes(record())}
    classes = [str(element.value) for element in values[0x0001].value]
    assert classes[0].lower() == SERVICE_UUID
    assert "1101" in classes[1]
    protocols = values[0x0004].value
    assert [str(layer.value[0].value) for layer in protocols] == [
        "UUID-16:0100 (L2CAP)",
        "UUID-16:0003 (RFCOMM)",
    ]
    assert protocols[1].value[1].value == CHANNEL


def test_bumble_reads_our_question_as_it_is_meant() -> None:
    request = SDP_PDU.from_bytes(sdp.question(7, SERVICE_UUID))
    assert isinstance(request, SDP_ServiceSearchAttributeRequest)
    assert request.transaction_id == 7
    (service,) = request.service_search_pattern.value
    assert str(service.value).lower() == SERVICE_UUID
    (wanted,) = request.attribute_id_list.value
    assert wanted.value == sdp.PROTOCOLS


def test_the_channel_of_a_service_is_found_through_the_air(wired: Air) -> None:
    assert sdp.channel(ORB, SERVICE_UUID) == CHANNEL


def test_a_service_that_is_not_offered_has_no_channel(wired: Air) -> None:
    assert sdp.channel(ORB, "00001108-0000-1000-8000-00805f9b34fb") is None


@settings(deadline=None)
@given(st.recursive(
    st.builds(DataElement.unsigned_integer_16, st.integers(0, 0xFFFF))
    | st.builds(DataElement.text_string, st.binary(max_size=300)),
    lambda children: st.builds(DataElement.sequence, st.lists(children, max_size=4)),
))  # fmt: skip
def test_whatever_bumble_writes_is_read(element: DataElement) -> None:
    def plain(each: DataElement) -> Any:
        return [plain(child) for child in each.value] if isinstance(each.value, list) else (
            each.value
        )  # fmt: skip

    assert list(sdp.values(bytes(element))) == [plain(element)]


@settings(deadline=None)
@given(st.binary(max_size=60))
def test_garbage_for_an_answer_is_an_error_or_nothing(data: bytes) -> None:
    try:
        found = sdp.find_channel(data)
    except sdp.SdpError:
        return
    assert found is None or 1 <= found <= 30


def test_an_orb_that_is_not_there_is_told_in_one_sentence(wired: Air) -> None:
    with pytest.raises(LinkError, match="00:11:22:33:44:55 does not answer; is the orb on"):
        open_transport("rfcomm://00:11:22:33:44:55")


def test_a_channel_where_nobody_listens_is_told_in_one_sentence(wired: Air) -> None:
    with pytest.raises(LinkError, match="refuses the connection; if the orb runs"):
        open_transport(f"rfcomm://{ORB}:9")


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("rfcomm://nonsense", "is no Bluetooth address"),
        ("rfcomm://00:11:22:33:44", "is no Bluetooth address"),
        ("rfcomm://00:11:22:33:44:55:0", "names channel 0, but there are 1 to 30"),
        ("rfcomm://00:11:22:33:44:55:31", "names channel 31"),
        ("rfcomm://00:11:22:33:44:55?speed=9", "has an option speed"),
        ("rfcomm://00:11:22:33:44:55?connect_timeout=x", "is a number of seconds"),
        ("rfcomm://00:11:22:33:44:55?local=hci0", "local is an adapter's address"),
    ],
)
def test_a_url_that_is_none_is_told_before_anything_is_tried(url: str, words: str) -> None:
    with pytest.raises(RfcommError, match=words):
        open_transport(url)


def test_a_url_is_read_in_full() -> None:
    url = "rfcomm://aa:11:22:33:44:55:7?local=00:AA:01:00:00:00&connect_timeout=3"
    options = {"local": "00:AA:01:00:00:00", "connect_timeout": "3"}
    assert parse(url) == ("AA:11:22:33:44:55", 7, options)
