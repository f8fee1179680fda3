"""A conversation against an earlier one: no byte, time or event of the link changes unnoticed.

Device and host talk for a minute over a wire that delays, drops and corrupts, and is cut now and
then; the digest is that of all bytes and events. When a change is meant to change the link, take
the new digests from the failures.
"""

from hashlib import sha256
from random import Random

import pytest

from controller.shared.protocol.device_session import DeviceSession
from controller.shared.protocol.host_session import HostSession
from controller.shared.protocol.messages import (
    Command,
    Contact,
    Contacts,
    Message,
    State,
    Telemetry,
)
from controller.shared.protocol.retransmit import RetransmitQueue, SessionHistory
from tests.support.fake_device import welcome

STEPS = 6000  # of 10 ms
KEY = bytes(range(32))
NAMES = ("left", "right", "drop", "hold")
GOLDEN = {("open", False): "18f99d30d014824c", ("keyed", True): "dad5e98958e05630"}


class Wire:
    """One direction: chunks that arrive late, wrong or never."""

    def __init__(self, script: Random) -> None:
        self.script = script
        self.chunks: list[tuple[int, bytes]] = []  # step of arrival

    def put(self, data: bytes, step: int) -> None:
        chance = self.script.random()
        if data and chance > 0.03:
            place = int(chance * len(data))
            wrong = bytes([data[place] ^ 4]) if chance < 0.05 else data[place : place + 1]
            last = self.chunks[-1][0] if self.chunks else 0
            late = max(last, step + int(self.script.random() ** 4 * 40))
            self.chunks.append((late, data[:place] + wrong + data[place + 1 :]))

    def get(self, step: int) -> bytes:
        arrived = b"".join(data for late, data in self.chunks if late <= step)
        self.chunks = [one for one in self.chunks if one[0] > step]
        return arrived


def draw_message(script: Random) -> Message:
    name, number = NAMES[int(script.random() * len(NAMES))], int(script.random() * 1000)
    chance = script.random()
    if chance < 0.5:
        return Command(name, "press", chance, (chance, 2.0), number)
    if chance < 0.8:
        return State((name,) if chance < 0.65 else ())
    return Telemetry(
        number, bytes(25), (chance, 1.0 - chance, 0.0, 0.0, 0.0), None, name, True, 10.0
    )


def digest(name: str, *, keyed: bool) -> str:
    script, key = Random(name), KEY if keyed else b""
    there, back, said = Wire(script), Wire(script), sha256()
    past, box = SessionHistory(), RetransmitQueue()

    def draw(size: int) -> bytes:
        return script.randbytes(size)

    device = DeviceSession(welcome(), key=key, outbox=box, draw=draw)
    host = HostSession("orb", 65_500, 0, key=key, nonce=draw(16), past=past)
    for step in range(STEPS):
        now_ms, chance = 4_294_950_000 + 10 * step, script.random()  # 32 bits wrap around
        if chance < 0.15:
            device.send(draw_message(script), now_ms, now_ms)
        elif chance < 0.2:
            finger = Contact(1, chance, 2.0, 8.0, 7.0)
            said.update(repr(host.send(Contacts((finger,)), now_ms)).encode())
        events: list[object] = [*device.tick(now_ms), *host.tick(now_ms)]
        events += device.receive(there.get(step), now_ms)
        events += host.receive(back.get(step), now_ms)
        if chance > 0.998 or host.over:
            events += [*device.end("cut"), *host.cut("cut")]
            there, back = Wire(script), Wire(script)
            device = DeviceSession(welcome(), key=key, number=device.number, outbox=box, draw=draw)
            host = HostSession("orb", step % 65_536, now_ms, key=key, nonce=draw(16), past=past)
        there.put(bytes(host.output), step)
        back.put(bytes(device.output), step)
        told = (events, bytes(host.output), bytes(device.output), host.pressed, device.live,
                host.wait_ms(now_ms), host.clock_offset_ms, device.dropped)  # fmt: skip
        said.update(repr(told).encode())
        host.output.clear()
        device.output.clear()
    return said.hexdigest()[:16]


@pytest.mark.parametrize(("name", "keyed"), GOLDEN)
def test_a_minute_of_the_link_is_byte_for_byte_the_same(name: str, keyed: bool) -> None:
    assert digest(name, keyed=keyed) == GOLDEN[name, keyed]
