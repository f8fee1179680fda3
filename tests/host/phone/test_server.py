"""The server of the phone's page, on loopback: who gets in, and what ends."""

import contextlib
import json
import socket
import sys
from collections import deque
from collections.abc import Iterator
from functools import partial
from http.client import HTTPConnection, HTTPResponse
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection

from controller.shared.errors import UserError
from host.phone import open_phone, page, server
from host.phone.server import PhoneServer
from tests.support.phone_tab import join, opened
from tests.support.waiting import PATIENCE_S, until

ONE_FINGER = "[[0, 0.1, 0.2, 0, 0.5]]"
VIEW: dict[str, Any] = {"words": {}, "status": ""}


@pytest.fixture
def phone() -> Iterator[PhoneServer]:
    served = open_phone("127.0.0.1:0")
    served.view = VIEW
    yield served
    served.close()


def parts(phone: PhoneServer) -> tuple[str, str]:
    """Return ADDRESS:PORT and the path."""
    netloc, _, token = phone.url.removeprefix("http://").partition("/")
    return netloc, f"/{token}"


def ask(phone: PhoneServer, path: str, method: str = "GET", **headers: str) -> HTTPResponse:
    http = HTTPConnection(parts(phone)[0], timeout=PATIENCE_S)
    http.request(method, path, headers=headers)
    return http.getresponse()


def closing_code(tab: ClientConnection) -> int | None:
    """Return the code with which the server closes a connection."""
    with pytest.raises(ConnectionClosed):
        deque(iter(partial(tab.recv, PATIENCE_S), None), maxlen=0)
    return tab.close_code


def test_the_token_opens_the_page_and_nothing_may_be_loaded_into_it(phone: PhoneServer) -> None:
    answer = ask(phone, parts(phone)[1])
    page = answer.read().decode()
    assert answer.status == 200
    assert not phone.refused
    assert page.startswith("<!doctype html>")
    assert "{nonce}" not in page
    assert "{words}" not in page
    policy = answer.headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; script-src 'nonce-")
    assert "unsafe" not in policy
    assert answer.headers["Cache-Control"] == "no-store"
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    assert answer.headers["Referrer-Policy"] == "no-referrer"
    assert "Server" not in answer.headers


@pytest.mark.parametrize(
    ("path", "method", "headers"),
    [
        ("/", "GET", {}),
        ("/phone.html", "GET", {}),
        ("/../../etc/passwd", "GET", {}),
        ("/" + "A" * 43, "GET", {}),
        ("{}/", "GET", {}),
        ("{}?", "GET", {}),
        ("{}", "HEAD", {}),
        ("{}", "POST", {}),
        ("{}", "GET", {"Host": "evil.example"}),  # a name that was made to point here
        ("{}", "GET", {"Host": "localhost"}),
        ("/" + "A" * 9000, "GET", {}),
        ("{}", "GET", {"Upgrade": "websocket", "Connection": "Upgrade"}),
    ],
)
def test_everything_else_is_nothing(
    phone: PhoneServer, path: str, method: str, headers: dict[str, str]
) -> None:
    answer = ask(phone, path.replace("{}", parts(phone)[1]), method, **headers)
    assert answer.status == 404
    assert answer.read() == b""
    assert {name.lower() for name, _ in answer.getheaders()} == {"content-length", "connection"}


def test_bytes_that_are_no_request_get_no_answer(phone: PhoneServer) -> None:
    host, _, port = parts(phone)[0].partition(":")
    with socket.create_connection((host, int(port)), PATIENCE_S) as stranger:
        stranger.sendall(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n")
        assert stranger.recv(100) == b""


@pytest.mark.parametrize("origin", ["http://evil.example", "null", None, "no token"])
def test_a_page_of_another_origin_gets_no_socket(phone: PhoneServer, origin: str | None) -> None:
    url = phone.url
    if origin == "no token":  # the right origin, but another path
        origin = f"http://{parts(phone)[0]}"
        url = f"{origin}/"
    with pytest.raises(InvalidStatus) as refused, opened(url, origin):
        pass
    assert refused.value.response.status_code == 404
    assert refused.value.response.body == b""
    assert not phone.phone


def test_fingers_of_the_page_are_on_the_dome_until_they_lift(phone: PhoneServer) -> None:
    with opened(phone.url) as tab:
        join(tab)
        tab.send(ONE_FINGER)
        fingers = until(lambda: phone.contacts)
        assert fingers == page.contacts(ONE_FINGER, phone.pad)
        for status in ("a", "b"):  # a short silence lifts nothing
            phone.view = {**VIEW, "status": status}
            assert json.loads(tab.recv(PATIENCE_S))["status"] == status
        assert phone.contacts == fingers
        tab.send("[]")
        until(lambda: not phone.contacts)


def test_a_lost_connection_lifts_all_fingers(phone: PhoneServer) -> None:
    with opened(phone.url) as tab:
        join(tab)
        tab.send(ONE_FINGER)
        until(lambda: phone.contacts)
        tab.socket.shutdown(socket.SHUT_RDWR)
        until(lambda: not phone.phone)
        assert phone.contacts == ()


def test_a_page_that_falls_silent_lifts_all_fingers_and_stays(
    phone: PhoneServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "SILENCE_S", 0.01)
    with opened(phone.url) as tab:
        join(tab)
        tab.send(ONE_FINGER)
        until(lambda: not phone.contacts and tab)
        phone.view = {**VIEW, "status": "still there"}
        assert json.loads(tab.recv(PATIENCE_S))["status"] == "still there"


def test_a_second_phone_is_refused_and_the_first_stays(phone: PhoneServer) -> None:
    with opened(phone.url) as first, opened(phone.url) as second:
        join(first)
        second.send('""')
        assert closing_code(second) == server.TAKEN
        assert phone.refused
        first.send(ONE_FINGER)
        until(lambda: phone.contacts)


def test_the_same_phone_connects_again_with_its_key(phone: PhoneServer) -> None:
    with opened(phone.url) as first:
        key = join(first)["key"]
        with opened(phone.url) as again:
            assert join(again, key)["key"] == key
            assert closing_code(first) == server.ENDED
            again.send(ONE_FINGER)
            until(lambda: phone.contacts)
            assert phone.phone


def test_fingers_are_lifted_before_a_malformed_message_closes_the_socket(
    phone: PhoneServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[int] = []
    close = server._Connection.close

    async def closing(connection: Any, code: int = 1000, reason: str = "") -> None:
        seen.append(len(phone.contacts))
        await close(connection, code, reason)

    monkeypatch.setattr(server._Connection, "close", closing)
    with opened(phone.url) as tab:
        join(tab)
        tab.send(ONE_FINGER)
        until(lambda: bool(phone.contacts))
        tab.send("[]]")
        assert closing_code(tab) == server.MALFORMED
    assert seen[0] == 0


@pytest.mark.parametrize(
    "sent",
    ["garbage", "[[0, 9, 9, 0, 0]]", "{}", b"[]", "[" * 1000, '"key again"', " " * 1025],
)
def test_a_malformed_message_closes_the_socket(phone: PhoneServer, sent: str | bytes) -> None:
    with opened(phone.url) as tab:
        join(tab)
        tab.send(sent)
        long = len(sent) > server.MAX_BYTES
        assert closing_code(tab) == (1009 if long else server.MALFORMED)
    until(lambda: not phone.phone)


@pytest.mark.parametrize("sent", ["[]", "7", b"", '"\\ud800"' * 20])
def test_a_first_message_that_is_no_key_closes_the_socket(
    phone: PhoneServer, sent: str | bytes
) -> None:
    with opened(phone.url) as tab:
        tab.send(sent)
        assert closing_code(tab) == server.MALFORMED
    assert not phone.phone


def test_a_flood_closes_the_socket(phone: PhoneServer) -> None:
    with opened(phone.url) as tab:
        join(tab)
        with contextlib.suppress(ConnectionClosed):
            for _ in range(10 * server.RATE_HZ):
                tab.send(ONE_FINGER)
        assert closing_code(tab) == server.MALFORMED
    until(lambda: not phone.contacts)


def test_a_page_that_does_not_say_anything_is_closed(
    phone: PhoneServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "WAIT_S", 0.01)
    with opened(phone.url) as tab:
        assert closing_code(tab) is not None
    assert not phone.phone


@pytest.mark.parametrize("addresses", [1, 20])
def test_idle_connections_keep_nobody_out(phone: PhoneServer, addresses: int) -> None:
    """They are closed when there are too many, of one address or of all, the oldest first."""
    if addresses > 1 and sys.platform != "linux":
        pytest.skip("only Linux has more than one loopback address from the start")
    host, _, port = parts(phone)[0].partition(":")
    held = []
    for number in range(20):
        mine = f"127.0.1.{1 + number % addresses}" if addresses > 1 else host
        held.append(socket.create_connection((host, int(port)), PATIENCE_S, (mine, 0)))
        assert ask(phone, parts(phone)[1]).status == 200

    def ended(one: socket.socket) -> bool:
        one.setblocking(False)
        try:
            return not one.recv(1)
        except BlockingIOError:
            return False
        except ConnectionResetError:
            return True

    most = server.MAX_WAITING if addresses == 1 else server.MAX_CONNECTIONS
    until(lambda: sum(map(ended, held)) >= 20 - most)
    for one in held:
        one.close()


def test_the_page_is_shown_every_new_view_and_its_words_are_escaped(phone: PhoneServer) -> None:
    phone.view = {"words": {"lost": '<perdu> & "fini"'}, "status": "a"}
    answer = ask(phone, parts(phone)[1]).read().decode()
    assert "&lt;perdu&gt;" in answer
    assert "<perdu>" not in answer
    with opened(phone.url) as tab:
        assert join(tab)["status"] == "a"
        phone.view = {**VIEW, "status": "b"}
        assert json.loads(tab.recv(PATIENCE_S))["status"] == "b"


def test_the_server_ends_with_its_phone() -> None:
    phone = open_phone("127.0.0.1:0")
    phone.view = VIEW
    with opened(phone.url) as tab:
        join(tab)
        phone.close()
        assert closing_code(tab) == server.ENDED
    with pytest.raises(ConnectionRefusedError):
        ask(phone, "/")
    phone.close()  # once more


def test_a_stranger_that_holds_a_connection_does_not_hold_the_end(phone: PhoneServer) -> None:
    host, _, port = parts(phone)[0].partition(":")
    with (
        opened(phone.url) as tab,
        socket.create_connection((host, int(port)), PATIENCE_S) as stranger,
    ):
        join(tab)
        phone.close()
        assert closing_code(tab) == server.ENDED
        stranger.setblocking(False)
        with pytest.raises(BlockingIOError):  # the server has not closed this one yet
            stranger.recv(1)


@pytest.mark.parametrize(
    "words",
    [
        "",
        "nonsense",
        "0.0.0.0",
        "::",
        "224.0.0.1",
        "127.0.0.1:0/path",
        "127.0.0.1:70000",
        "me@127.0.0.1",
    ],
)
def test_what_is_no_address_is_refused_with_the_addresses_there_are(
    words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("host.phone.own_addresses", lambda: ["192.168.1.4"])
    with pytest.raises(UserError, match=r"expected an address .*: 192\.168\.1\.4"):
        open_phone(words)


def test_an_address_of_another_machine_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("host.phone.own_addresses", list[str])
    with pytest.raises(UserError, match=r"203\.0\.113\.9 is not an address"):
        open_phone("203.0.113.9")


def test_a_port_that_is_taken_is_told(phone: PhoneServer) -> None:
    with pytest.raises(UserError, match="name another port"):
        open_phone(parts(phone)[0])


def test_without_the_libraries_one_sentence_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "qrcode.main", None)
    with pytest.raises(UserError, match=r"pip install 'orbtouch\[phone\]'"):
        open_phone("127.0.0.1:0")
