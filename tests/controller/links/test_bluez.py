"""The serial port over Bluetooth against a fake BlueZ: what goes wrong, and that it mends."""

from __future__ import annotations

import logging
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.support.fake_bluez import HOST, FakeBluez, bus, fake, missing, until

__all__ = ["bus", "fake"]
from tests.support.fake_device import welcome
from tests.support.manual_host import HandMadeHost

if missing():
    pytest.skip(f"needs {missing()}", allow_module_level=True)

from controller.links import open_link
from controller.links.base import LinkError
from controller.links.rfcomm import RfcommLink
from controller.shared.bluetooth.bluez import ADAPTER, DEVICE, SERIAL_PATH, SERVICE_UUID
from controller.shared.protocol.messages import Bye, Command, Hello, State, Welcome

DEVICE_PATH = "/org/bluez/hci0/dev_" + HOST.replace(":", "_")
PROFILES = "org.bluez.ProfileManager1"


@pytest.fixture
def link(fake: FakeBluez) -> Iterator[RfcommLink]:
    link = open_link("rfcomm:", welcome())
    assert isinstance(link, RfcommLink)
    yield link
    link.close()


def owner(link: RfcommLink) -> str:
    """Return the link's address on the bus."""
    service = link._registration._service
    return str(service._bus.raw.unique_name)  # type: ignore[attr-defined]


@contextmanager
def host_of(fake: FakeBluez, link: RfcommLink) -> Iterator[HandMadeHost]:
    """Let BlueZ hand a bonded host's connection over, and play that host."""
    near, far = socket.socketpair()
    with near:
        with far:
            assert fake.hand_over(owner(link), SERIAL_PATH, DEVICE_PATH, far) == ""
        near.settimeout(10.0)
        host = HandMadeHost(lambda: near.recv(4096), near.sendall)
        host.close = lambda: near.shutdown(socket.SHUT_RDWR)
        yield host


def is_greeted(link: RfcommLink) -> None:
    until(lambda: any(isinstance(request, Hello) for request in link.poll()))


def test_the_service_has_our_uuid_and_demands_pairing(fake: FakeBluez, link: RfcommLink) -> None:
    ((path, uuid, options),) = fake.calls("RegisterProfile")
    assert (path, uuid) == (SERIAL_PATH, SERVICE_UUID)
    assert options["RequireAuthentication"]
    assert options["RequireAuthorization"]
    record = options["ServiceRecord"]
    assert f'<uuid value="{SERVICE_UUID}"/><uuid value="0x1101"/>' in record
    assert f'<uint8 value="0x{options["Channel"]:02x}"/>' in record
    assert link.url.startswith("rfcomm://00:01:02:03:04:05:")


def test_a_bonded_host_plays_over_the_socket_of_bluez(fake: FakeBluez, link: RfcommLink) -> None:
    with host_of(fake, link) as host:
        assert isinstance(host.greet(), Welcome)
        assert host.message() == State(())
        is_greeted(link)
        link.send(Command("drop", "pinch", 0.9, None, 1), 10)
        heard = host.message()
        assert isinstance(heard, Command)
        assert heard.name == "drop"


def test_an_unbonded_host_is_refused_and_hears_nothing(fake: FakeBluez, link: RfcommLink) -> None:
    fake.call("/", "org.bluez.Mock", "AddDevice", "sss", "hci0", "66:55:44:33:22:11", "stranger")
    near, far = socket.socketpair()
    with near, far:
        stranger = "/org/bluez/hci0/dev_66_55_44_33_22_11"
        refusal = fake.hand_over(owner(link), SERIAL_PATH, stranger, far)
        assert refusal == "org.bluez.Error.Rejected"
        far.close()
        near.settimeout(10.0)
        assert near.recv(100) == b""


def test_a_connection_on_another_adapter_is_refused(fake: FakeBluez, link: RfcommLink) -> None:
    near, far = socket.socketpair()
    with near, far:
        other = DEVICE_PATH.replace("hci0", "hci1")
        assert fake.hand_over(owner(link), SERIAL_PATH, other, far) == "org.bluez.Error.Rejected"


def test_a_host_that_bluez_disconnects_has_gone(fake: FakeBluez, link: RfcommLink) -> None:
    with host_of(fake, link) as host:
        host.greet()
        is_greeted(link)
        link._leave(DEVICE_PATH)
        (bye,) = until(link.poll)
        assert isinstance(bye, Bye)


def test_a_host_hears_bye_when_the_orb_is_switched_off(fake: FakeBluez) -> None:
    link = open_link("rfcomm:", welcome())
    assert isinstance(link, RfcommLink)
    with host_of(fake, link) as host:
        host.greet()
        assert host.message() == State(())
        closing = threading.Thread(target=link.close)
        closing.start()
        assert isinstance(host.message(), Bye)
        host.close()
        closing.join()


def test_it_is_registered_anew_after_bluetoothd_restarts(fake: FakeBluez, link: RfcommLink) -> None:
    fake.stop()
    until(lambda: link.state != "ready")
    fake.start()
    until(lambda: link.state == "ready")
    assert len(fake.calls("RegisterProfile")) == 1  # the new one has heard of us, once


def test_a_host_keeps_playing_while_bluetoothd_restarts(fake: FakeBluez, link: RfcommLink) -> None:
    with host_of(fake, link) as host:
        host.greet()
        assert host.message() == State(())
        is_greeted(link)
        fake.stop()
        until(lambda: link.state != "ready")
        link.send(State(("down",)), 10)
        assert host.message() == State(("down",))


def test_it_is_registered_anew_when_the_adapter_is_plugged_in_again(
    fake: FakeBluez, link: RfcommLink, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    fake.unplug()
    until(lambda: "there is no Bluetooth adapter" in link.state)
    fake.plug()
    until(lambda: link.state == "ready")
    assert len(fake.calls("RegisterProfile")) == 2
    told = [record.message for record in caplog.records]
    assert sum("there is no Bluetooth adapter" in line for line in told) == 1  # said once


def test_an_adapter_that_is_switched_off_stays_off(fake: FakeBluez, link: RfcommLink) -> None:
    def power(on: bool) -> None:
        fake.ask(lambda bus: bus.set("/org/bluez/hci0", ADAPTER, "Powered", "b", on))

    power(False)
    until(lambda: "switched off" in link.state)
    assert not fake.get("/org/bluez/hci0", ADAPTER, "Powered")
    power(True)
    until(lambda: link.state == "ready")


def test_outside_the_window_nobody_may_pair(fake: FakeBluez, link: RfcommLink) -> None:
    assert not fake.get("/org/bluez/hci0", ADAPTER, "Pairable")
    assert not fake.get("/org/bluez/hci0", ADAPTER, "Discoverable")
    assert confirmation(fake, link) == "org.bluez.Error.Rejected"


def test_the_window_opens_for_a_time_and_who_pairs_is_trusted(
    fake: FakeBluez, link: RfcommLink
) -> None:
    link.pair(90)
    until(lambda: fake.get("/org/bluez/hci0", ADAPTER, "Discoverable"))
    assert fake.get("/org/bluez/hci0", ADAPTER, "DiscoverableTimeout") == 90
    assert fake.get("/org/bluez/hci0", ADAPTER, "PairableTimeout") == 90
    assert fake.get("/org/bluez/hci0", ADAPTER, "Pairable")
    assert confirmation(fake, link) == ""
    fake.call("/", "org.bluez.Mock", "AddDevice", "sss", "hci0", "AA:BB:CC:DD:EE:FF", "tablet")
    fake.pair("AA:BB:CC:DD:EE:FF")
    until(lambda: fake.get("/org/bluez/hci0/dev_AA_BB_CC_DD_EE_FF", DEVICE, "Trusted"))


def confirmation(fake: FakeBluez, link: RfcommLink) -> str:
    """Ask the agent as BlueZ does; return the error's name, or ""."""

    async def ask(bus: object) -> str:
        from dbus_fast import Message

        reply = await bus.raw.call(  # type: ignore[attr-defined]
            Message(destination=owner(link), path="/orbtouch/agent",
                    interface="org.bluez.Agent1", member="RequestConfirmation",
                    signature="ou", body=[DEVICE_PATH, 123456])
        )  # fmt: skip
        return str(reply.error_name or "")

    return str(fake.ask(ask))


def test_a_second_controller_is_told_that_another_program_has_it(fake: FakeBluez) -> None:
    fake.refuse(PROFILES, "RegisterProfile", "osa{sv}", "org.bluez.Error.NotPermitted")
    with pytest.raises(LinkError, match="is a second controller running"):
        open_link("rfcomm:", welcome())


def test_without_bluetoothd_or_adapter_the_error_has_the_remedy(fake: FakeBluez) -> None:
    fake.stop()
    with pytest.raises(LinkError, match="systemctl enable --now bluetooth"):
        open_link("rfcomm:", welcome())
    fake.start(adapter=False)
    with pytest.raises(LinkError, match="there is no Bluetooth adapter; plug one in"):
        open_link("rfcomm:", welcome())
    fake.stop()


def test_a_missing_adapter_is_reported_with_those_there_are(fake: FakeBluez) -> None:
    with pytest.raises(LinkError, match="no Bluetooth adapter hci7; there is hci0"):
        open_link("rfcomm:hci7", welcome())


def test_an_address_to_connect_to_is_no_link_to_wait_on() -> None:
    with pytest.raises(LinkError, match="the orb itself waits: --link rfcomm:"):
        open_link("rfcomm://00:11:22:33:44:55", welcome())
