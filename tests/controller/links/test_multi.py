"""Several links at a time, each played by hand."""

from __future__ import annotations

import pytest

from controller.links import Access, Link, LinkError, open_link, split
from controller.links.multi import MultiLink, create
from controller.shared.protocol.messages import (
    Bye,
    Command,
    Contact,
    Contacts,
    Hello,
    Message,
    State,
)
from tests.support.fake_device import welcome

HELLO = Hello(1, 1, "", "a laptop", False)
PRESS = Command("left", "press", 1.0, None, 1)
FINGER = Contacts((Contact(1, 2.0, 2.0, 1.0, 5.0),))


class Played(Link):
    """A link whose host is the test."""

    dropped = 0
    connected = False

    def __init__(self, *, touchable: bool = True) -> None:
        self.touchable = touchable
        self.sent: list[Message] = []
        self.asked: list[Message] = []
        self.paired: list[int] = []
        self.closed = False

    def send(self, message: Message, t_ms: int) -> None:
        if self.connected:
            self.sent.append(message)
        else:
            self.dropped += 1

    def poll(self) -> list[Message]:
        asked, self.asked = self.asked, []
        for message in asked:
            if isinstance(message, Hello | Bye):
                self.connected = isinstance(message, Hello)
        return asked

    def wait(self, timeout_s: float) -> None:
        pass

    def pair(self, seconds: int) -> None:
        self.paired.append(seconds)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def both() -> tuple[Played, Played, MultiLink]:
    port, pad = Played(), Played(touchable=False)
    return port, pad, MultiLink([port, pad])


Both = tuple[Played, Played, MultiLink]


def test_a_plus_joins_links_only_where_another_one_begins() -> None:
    assert split("rfcomm:+hid:hci1?keys=a+b.toml") == ["rfcomm:", "hid:hci1?keys=a+b.toml"]
    assert split("hwgrep://usb+.*") == ["hwgrep://usb+.*"]
    assert split("-") == ["-"]


def test_what_the_orb_says_goes_to_every_host(both: Both) -> None:
    port, pad, fan = both
    for link in (port, pad):
        link.asked = [HELLO]
    fan.poll()
    fan.send(PRESS, 100)
    assert port.sent == pad.sent == [PRESS]


def test_the_first_host_begins_and_the_last_one_ends(both: Both) -> None:
    port, pad, fan = both
    pad.asked = [HELLO]
    assert fan.poll() == [HELLO]
    port.asked = [HELLO]
    assert fan.poll() == []
    pad.asked = [Bye("gone")]
    assert fan.poll() == [Contacts(())]
    assert fan.connected
    port.asked = [Bye("gone, too")]
    assert fan.poll() == [Bye("gone, too")]
    assert not fan.connected


def test_a_second_host_does_not_hide_a_release_from_the_first(both: Both) -> None:
    port, pad, fan = both
    port.asked = [HELLO]
    fan.poll()
    fan.send(State(("left",)), 100)
    pad.asked = [HELLO]
    assert fan.poll() == []  # the loop would forget what is held
    fan.send(State(()), 200)
    assert port.sent == [State(("left",)), State(())]


def test_a_host_that_owns_the_clock_always_begins_anew(both: Both) -> None:
    port, pad, fan = both
    pad.asked = [HELLO]
    fan.poll()
    granted = Hello(1, 1, "", "a demo", True)
    port.asked = [granted]
    assert fan.poll() == [granted]


def test_requests_of_any_host_arrive(both: Both) -> None:
    port, _pad, fan = both
    port.asked = [HELLO, FINGER]
    assert fan.poll() == [HELLO, FINGER]
    assert fan.touchable


def test_dropped_counts_for_hosts_that_are_there(both: Both) -> None:
    port, _pad, fan = both
    fan.send(PRESS, 1)
    assert fan.dropped == 2
    port.asked = [HELLO]
    fan.poll()
    assert fan.dropped == port.dropped == 1


def test_pairing_and_the_end_reach_all_links(both: Both) -> None:
    port, pad, fan = both
    fan.pair(60)
    fan.close()
    assert port.paired == pad.paired == [60]
    assert port.closed
    assert pad.closed


def test_when_one_link_cannot_be_opened_the_others_are_closed_again() -> None:
    with pytest.raises(LinkError, match="cannot understand hid://x"):
        open_link("listen://127.0.0.1:0+hid://x", welcome())


def test_a_link_that_stands_twice_is_refused() -> None:
    with pytest.raises(LinkError, match="hid: stands twice in hid:\\+hid:"):
        create("hid:+hid:", welcome(), Access())
