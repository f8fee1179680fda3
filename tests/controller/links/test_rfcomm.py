"""A host and an orb over RFCOMM: over local sockets, and through Bumble's virtual controllers."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.support.fake_device import welcome

pytest.importorskip("dbus_fast", reason="needs dbus-fast (the extra [bluetooth])")


from controller.links import open_link, rfcomm
from controller.links.bluetooth.serial_profile import record
from controller.links.rfcomm import RfcommLink
from controller.shared.bluetooth.bluez import CHANNEL, SERVICE_UUID
from controller.shared.protocol.messages import Bye, Command, Hello, Message, Perform
from host.connection.receiver import Connected, Delivered, Lost, Receiver
from host.connection.transport import LinkError, open_transport
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


class Local:
    """Local sockets in the kernel's place."""

    arrived: Callable[[socket.socket], None]  # called with the orb's end of every connection

    def open_channel(self, address: str, local: str = "") -> socket.socket:
        """Connect to the orb's channel."""
        assert address == ORB
        near, far = socket.socketpair()
        near.setblocking(False)
        self.arrived(far)
        return near


@pytest.fixture(scope="module")
def air() -> Iterator[Any]:
    """Bumble's virtual controllers: no kernel, no radio."""
    pytest.importorskip("bumble", reason="needs bumble, which brings compiled wheels")
    from tests.support.bumble_radio import Air

    air = Air(record(), CHANNEL)
    yield air
    air.close()


@pytest.fixture
def wired(air: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Put the virtual controllers in the kernel's place."""
    monkeypatch.setattr("host.connection.rfcomm.open_channel", air.open_channel)
    monkeypatch.setattr("sys.platform", "linux")
    return air


@pytest.fixture(params=["local", "bumble"])
def link(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[RfcommLink]:
    """A link to which the host's sockets lead."""
    monkeypatch.setattr(rfcomm, "RegistrationThread", NoBluez)
    link = open_link("rfcomm:", welcome())
    assert isinstance(link, RfcommLink)
    wire: Any = Local()
    if request.param == "local":
        monkeypatch.setattr("host.connection.rfcomm.open_channel", wire.open_channel)
    else:
        wire = request.getfixturevalue("wired")

    def arrive(connection: socket.socket) -> None:
        connection.setblocking(False)
        link._accept(connection, "a laptop", "/laptop")

    wire.arrived = arrive
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


def test_a_link_that_bluez_ends_is_connected_again(link: RfcommLink, receiver: Receiver) -> None:
    asked(link, Hello)
    link._leave("/laptop")
    heard(receiver, Lost)
    heard(receiver, Connected)


def test_the_record_in_our_xml_says_to_bumble_what_it_should(air: Any) -> None:
    from tests.support.bumble_radio import attributes

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


def test_an_orb_that_is_not_there_is_told_in_one_sentence(wired: Any) -> None:
    with pytest.raises(LinkError, match="00:11:22:33:44:55 does not answer; is the orb on"):
        open_transport("rfcomm://00:11:22:33:44:55")


def test_a_device_without_the_service_is_told_in_one_sentence(
    wired: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wired, "channel", 9)
    with pytest.raises(LinkError, match="refuses the connection; start the orb"):
        open_transport(f"rfcomm://{ORB}")
