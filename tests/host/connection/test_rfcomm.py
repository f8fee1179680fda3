"""Sockets that connect by way of the C library: with addresses of families that are everywhere."""

from __future__ import annotations

import errno
import socket
import struct
import sys
from pathlib import Path

import pytest

from tests.support.fake_device import welcome
from tests.support.pytest_types import Capture, Patch

if sys.platform != "linux":
    pytest.skip("Linux's structures and error numbers", allow_module_level=True)


from controller.cli import pair
from controller.links import open_link
from controller.links.base import LinkError
from controller.shared import errors
from controller.shared.bluetooth import bluez
from host.connection import rfcomm
from host.connection.transport import LinkError as HostLinkError
from host.connection.transport import open_transport


def unix(path: Path) -> bytes:
    return struct.pack("=H108s", socket.AF_UNIX, str(path).encode())


def tcp(port: int) -> bytes:
    return struct.pack("=H", socket.AF_INET) + struct.pack(">H4s8x", port, b"\x7f\0\0\1")


def test_a_connection_by_a_packed_address_carries_bytes(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "here"))
        listener.listen()
        connection = rfcomm.connected(socket.socket(socket.AF_UNIX), unix(tmp_path / "here"))
        far, _ = listener.accept()
        with far, connection:
            connection.sendall(b"frame")
            assert far.recv(10) == b"frame"


def test_a_connection_that_takes_its_time_is_waited_for() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener, socket.socket() as raw:
        rfcomm.connected(raw, tcp(listener.getsockname()[1]), tcp(0))
        assert raw.getpeername() == listener.getsockname()


def test_a_refusal_keeps_its_number_and_closes_the_socket(free_port: int, tmp_path: Path) -> None:
    raw = socket.socket()
    with pytest.raises(ConnectionRefusedError):
        rfcomm.connected(raw, tcp(free_port))
    assert raw.fileno() == -1
    with pytest.raises(FileNotFoundError):
        rfcomm.connected(socket.socket(socket.AF_UNIX), unix(tmp_path / "no"))


def test_addresses_are_packed_as_the_kernel_s_header_files_say() -> None:
    packed = rfcomm.packed("00:AA:01:02:03:04", 22)
    assert packed == bytes.fromhex("1f00 0403 0201 aa00 16 00")


@pytest.mark.skipif(not hasattr(socket, "AF_BLUETOOTH"), reason="this Python has no Bluetooth")
def test_our_numbers_are_python_s_own() -> None:
    assert int(socket.AF_BLUETOOTH) == rfcomm.AF_BLUETOOTH
    assert socket.BTPROTO_RFCOMM == rfcomm.RFCOMM


def test_a_url_is_read_in_full() -> None:
    url = "rfcomm://aa:11:22:33:44:55?local=00:AA:01:00:00:00"
    assert rfcomm.parse(url) == ("AA:11:22:33:44:55", "00:AA:01:00:00:00")
    assert rfcomm.parse("rfcomm://aa:11:22:33:44:55") == ("AA:11:22:33:44:55", "")


@pytest.mark.parametrize("rest", ["nonsense", "00:11:22:33:44", "00:11:22:33:44:55?local=hci0"])
def test_a_url_that_is_none_is_told_before_anything_is_tried(rest: str) -> None:
    with pytest.raises(HostLinkError, match=r"is no Bluetooth address.*\?local=00:11:22:33:44:55"):
        open_transport(f"rfcomm://{rest}")


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.EHOSTDOWN, "does not answer; is the orb on"),
        (errno.EHOSTUNREACH, "there is no Bluetooth adapter"),
        (errno.ECONNREFUSED, "refuses the connection"),
        (errno.EACCES, "pair it in the Bluetooth settings"),
        (errno.EAFNOSUPPORT, "open the serial port that pairing made"),
        (errno.EMFILE, "cannot open rfcomm://AA: too many"),
    ],
)
def test_every_error_is_a_sentence_with_what_to_do(number: int, words: str) -> None:
    assert words in rfcomm.explain("rfcomm://AA", "AA", OSError(number, "too many"))


def test_without_its_package_it_says_what_to_install(capsys: Capture, monkeypatch: Patch) -> None:
    monkeypatch.setattr(bluez, "available", lambda: False)
    with pytest.raises(LinkError, match=r"pip install 'orbtouch\[bluetooth\]'"):
        open_link("rfcomm:", welcome())
    assert errors.run("controller", lambda: pair.main([])) == 1
    assert "pip install 'orbtouch[bluetooth]'" in capsys.readouterr().err
