"""Sockets that connect by way of the C library: with addresses of families that are everywhere."""

from __future__ import annotations

import errno
import socket
import struct
import sys
from pathlib import Path

import pytest

from tests.support.fake_device import welcome

if sys.platform != "linux":
    pytest.skip("Linux's structures and error numbers", allow_module_level=True)

from controller import errors
from controller.cli import pair as orb_pair
from controller.links import LinkError, open_link
from controller.links.bluetooth import bluez
from host.bluetooth import sockets
from host.bluetooth.protocol_rfcomm import explain
from host.cli import pair


def unix(path: Path) -> bytes:
    return struct.pack("=H108s", socket.AF_UNIX, str(path).encode())


def tcp(port: int) -> bytes:
    return struct.pack("=H", socket.AF_INET) + struct.pack(">H4s8x", port, b"\x7f\0\0\1")


def test_a_connection_by_a_packed_address_carries_bytes(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listener, socket.socket(socket.AF_UNIX) as raw:
        listener.bind(str(tmp_path / "here"))
        listener.listen()
        connection = sockets._connected(raw, unix(tmp_path / "here"), b"", 5.0)
        far, _ = listener.accept()
        with far:
            connection.sendall(b"frame")
            assert far.recv(10) == b"frame"


def test_a_connection_that_takes_its_time_is_waited_for() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener, socket.socket() as raw:
        sockets._connected(raw, tcp(listener.getsockname()[1]), tcp(0), 5.0)
        assert raw.getpeername() == listener.getsockname()
        assert raw.getblocking()


def test_a_refusal_keeps_its_number_and_closes_the_socket(free_port: int) -> None:
    raw = socket.socket()
    with pytest.raises(OSError) as refused:
        sockets._connected(raw, tcp(free_port), b"", 5.0)
    assert refused.value.errno == errno.ECONNREFUSED
    assert raw.fileno() == -1


def test_nobody_there_keeps_its_number_too(tmp_path: Path) -> None:
    with pytest.raises(OSError) as absent:
        sockets._connected(socket.socket(socket.AF_UNIX), unix(tmp_path / "no"), b"", 5.0)
    assert absent.value.errno == errno.ENOENT


def test_addresses_are_packed_as_the_kernel_s_header_files_say() -> None:
    rfcomm = sockets.rfcomm_address("00:AA:01:02:03:04", 22)
    assert rfcomm == bytes.fromhex("1f00 0403 0201 aa00 16 00")
    l2cap = sockets.l2cap_address("00:AA:01:02:03:04", 1)
    assert l2cap == bytes.fromhex("1f00 0100 0403 0201 aa00 0000 00 00")


@pytest.mark.skipif(not hasattr(socket, "AF_BLUETOOTH"), reason="this Python has no Bluetooth")
def test_our_numbers_are_python_s_own() -> None:
    assert int(socket.AF_BLUETOOTH) == sockets.AF_BLUETOOTH
    assert socket.BTPROTO_RFCOMM == sockets.RFCOMM
    assert socket.BTPROTO_L2CAP == sockets.L2CAP


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.EHOSTDOWN, "does not answer; is the orb on"),
        (errno.ETIMEDOUT, "does not answer"),
        (errno.EHOSTUNREACH, "there is no Bluetooth adapter"),
        (errno.ECONNREFUSED, "refuses the connection"),
        (errno.EACCES, "pair first: host pair AA"),
        (errno.EAFNOSUPPORT, "open the serial port that pairing made"),
        (errno.EMFILE, "cannot open rfcomm://AA: too many"),
    ],
)
def test_every_error_is_a_sentence_with_what_to_do(number: int, words: str) -> None:
    assert words in explain("rfcomm://AA", "AA", OSError(number, "too many"))


@pytest.mark.parametrize(("system", "port"), [("win32", "COM5"), ("darwin", "/dev/cu.OrbTouch")])
def test_other_systems_are_led_through_their_own_settings(
    system: str, port: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", system)
    assert pair.main([]) == 0
    told = capsys.readouterr().out
    assert "controller pair" in told
    assert f"host --link {port}" in told


def test_without_its_package_bluetooth_says_what_to_install(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bluez, "available", lambda: False)
    with pytest.raises(LinkError, match=r"pip install 'orbtouch\[bluetooth\]'"):
        open_link("rfcomm:", welcome())
    for program, main in (("host", pair.main), ("controller", orb_pair.main)):
        assert errors.run(program, lambda main=main: main([])) == 1  # type: ignore[misc]
        assert "pip install 'orbtouch[bluetooth]'" in capsys.readouterr().err


@pytest.mark.parametrize("address", ["nonsense", "00:11:22:33:44", "00:11:22:33:44:55:1"])
def test_an_address_to_pair_with_looks_like_one(
    address: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        pair.main([address])
    assert ended.value.code == 2
    assert "is no address like 00:11:22:33:44:55" in capsys.readouterr().err
