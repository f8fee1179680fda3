"""A device, a host and a bad wire between them, on a virtual clock; and their invariants.

`World.wait` lets time pass in steps of 10 ms: the two sessions tick, bytes travel, the host
reconnects as `host.connection.receiver` does. All else is trouble. After every step `World` checks
that what the host was told can be true, with nothing but its own notes of what was really asked
for.
"""

from __future__ import annotations

import zlib
from collections import Counter
from dataclasses import dataclass, field

from controller.shared.protocol import codec, link_events
from controller.shared.protocol.device_session import BACKLOG, DeviceSession
from controller.shared.protocol.host_session import HostSession
from controller.shared.protocol.messages import (
    DEADMAN_MS,
    HUNG_MS,
    LATE_MS,
    Bye,
    Command,
    ContactState,
    Hello,
    State,
    Telemetry,
)
from controller.shared.protocol.packets import MAX_FRAME, Decoder
from controller.shared.protocol.retransmit import MOST, RetransmitQueue, SessionHistory
from tests.support.fake_device import welcome

TICK_MS = 10
LATENCY_MS = 3  # of the wire, one way
PATIENCE_MS = 8_000  # for a healed wire to bring the two together again
KEY = bytes(range(32))
CHANGES = ("corrupt", "lose", "truncate", "duplicate", "reorder", "delay", "noise")
FELT = Telemetry(1, bytes(25), (1.0,), None, "", True, 10.0)


@dataclass
class Wire:
    """One direction: chunks on their way, oldest first."""

    chunks: list[tuple[int, bytes]] = field(default_factory=list)  # (when it arrives, bytes)
    free_ms: int = 0  # nothing arrives before

    def put(self, data: bytes, now_ms: int) -> None:
        """Send bytes behind those that travel."""
        last_ms = self.chunks[-1][0] if self.chunks else 0
        self.chunks.append((max(now_ms + LATENCY_MS, self.free_ms, last_ms), data))

    def take(self, now_ms: int) -> list[bytes]:
        count = sum(due_ms <= now_ms for due_ms, _ in self.chunks)
        arrived = [data for _, data in self.chunks[:count]]
        del self.chunks[:count]
        return arrived

    def stall(self, until_ms: int) -> None:
        """Let nothing arrive before a time; it all comes then."""
        self.free_ms = max(self.free_ms, until_ms)
        self.chunks = [(max(due_ms, until_ms), data) for due_ms, data in self.chunks]


class World:
    """Both ends, and what really happened; of a serial line's cut only silence tells."""

    def __init__(self, *, serial: bool, keyed: bool, device_ms: int) -> None:
        self.happened: Counter[str] = Counter()
        self.now_ms = 0
        self.plugged = True
        self._full_ms = 0  # the device's port takes no bytes before
        self._mended_ms = 0  # when a cut line is mended
        self.to_host, self.to_device = Wire(), Wire()
        self.oldest_ms = 0  # age of the oldest command or contact that was delivered
        self.keyed = keyed
        self._serial, self._key, self._skew_ms = serial, KEY if keyed else b"", device_ms
        self._drawn = 0
        # the device
        self._boot = 0
        # By boot: what was asked (frame, when), and how much of it when a new host came.
        self._asked: dict[int, list[tuple[int, int]]] = {}
        self._begun: dict[int, set[int]] = {}
        self._frame = 0
        self._touched: dict[int, int] = {}  # frames of contacts, and when
        self._contact = 0  # frame of the contact that the device has said last; 0: it has ended
        self.held: tuple[str, ...] = ()
        self._loop_ms = 0  # the latest sign of the device's control loop
        self._hung_until_ms = 0
        self.outbox = RetransmitQueue()
        self.lines: list[DeviceSession] = []  # the newest is the one that the host is at
        self._start_device()
        # the host
        self.past = SessionHistory(host_nonce=1)
        self._hosts = 1
        self.host: HostSession | None = None
        self._next_ms = 0  # when the host tries again
        self._failures = 0
        self._base = 0  # the number behind which the host counts
        self._met = 0  # the boot of the device that it counts of
        self._counted = 0  # delivered and missed since
        self._intact_ms = 0  # when a whole frame came last
        self._felt = 0  # frame of the contact that the host was told last; 0: it has ended
        self._newest = 0  # frame of the newest contact or command that it was told

    # --- what the two programs do ---

    def command(self) -> None:
        """The player asks for something; a loop that hangs does not notice."""
        if self.hung:
            return
        self._frame += 1
        self._asked[self._boot].append((self._frame, self.now_ms))
        command = Command("drop", "pinch", 0.9, None, self._frame)
        session = self._live
        if session is None:
            self.outbox.put(command, self.now_ms, self.device_ms)
        else:
            session.send(command, self.now_ms, self.device_ms)
        self.happened["commands"] += 1

    def hold(self, pressed: tuple[str, ...]) -> None:
        """The player holds something, or lets go."""
        if self.hung:
            return
        self.held = pressed
        self._device_says(State(pressed))

    def feel(self) -> None:
        """The device sends a frame of telemetry."""
        self._device_says(FELT)

    def touch(self, frames: int) -> None:
        """The player touches for some frames, each 10 ms; with 0 he lifts the finger."""
        for _ in range(frames):
            if not self.hung:
                self._frame += 1
                self._touched[self._frame], self._contact = self.now_ms, self._frame
                self._device_says(ContactState(self._frame, 2.0, 2.0, fingers=1))
                self._device_says(FELT)
                self._look()
            self.wait(TICK_MS)
        if frames == 0 and self._contact and not self.hung:
            self._device_says(ContactState(self._contact))
            self._contact = 0
            self._look()

    def clog(self, for_ms: int) -> None:
        """Let the device's port take no bytes for some time."""
        self._full_ms = max(self._full_ms, self.now_ms + for_ms)

    def hang(self, for_ms: int) -> None:
        """Let the device's control loop hang: it sends nothing; its link's thread goes on."""
        self._hung_until_ms = self.now_ms + for_ms
        self.happened["hung loops"] += 1

    @property
    def hung(self) -> bool:
        """Whether the control loop hangs."""
        return self.now_ms < self._hung_until_ms

    def wait(self, pass_ms: int) -> None:
        end_ms = self.now_ms + pass_ms
        while self.now_ms < end_ms:
            self.now_ms = min(self.now_ms + TICK_MS, end_ms)
            self._tick()
            self.check()

    # --- trouble ---

    def cut(self, for_ms: int, *, host_knows: bool, device_knows: bool) -> None:
        """Break the line for some time; what travels is lost."""
        self.plugged, self._mended_ms = False, self.now_ms + for_ms
        self.to_host, self.to_device = Wire(), Wire()
        self.happened["cut"] += 1
        if self._serial:
            return
        if host_knows and self.host is not None:
            self._hear(self.host.cut("the wire was cut"))
        if device_knows:
            self._hang_up()

    def restart_device(self) -> None:
        """Switch the device off and on: it forgets everything."""
        self.outbox, self.held, self._contact = RetransmitQueue(), (), 0
        self.lines.clear()
        self._start_device()
        self._end_line()
        self.happened["device restarts"] += 1

    def restart_host(self) -> None:
        """Start the host's program anew: it forgets everything."""
        self._hosts += 1
        self.past = SessionHistory(host_nonce=self._hosts)
        self.host, self._next_ms, self._failures, self._felt = None, self.now_ms, 0, 0
        self._end_line()
        self.happened["host restarts"] += 1

    def end_host(self) -> None:
        """Let the host close, and come back later."""
        if self.host is not None:
            self.host.close("the host was closed", self.now_ms)
            self._pump()
            self.happened["host ends"] += 1
            self.host, self._next_ms, self._felt = None, self.now_ms + 300, 0

    def change(self, direction: Wire, how: str, at: int) -> None:
        """Do something to what travels in one direction."""
        chunks = direction.chunks
        if how == "noise":
            chunks.insert(at % (len(chunks) + 1), (self._between(chunks, at), bytes([at & 0xFF])))
        elif chunks:
            index = at % len(chunks)
            due_ms, data = chunks[index]
            if how == "corrupt" and data:
                place = at // 7 % len(data)
                data = data[:place] + bytes([data[place] ^ (1 << at % 8)]) + data[place + 1 :]
                chunks[index] = due_ms, data
            elif how == "lose":
                del chunks[index]
            elif how == "truncate":
                chunks[index] = due_ms, data[: at // 7 % (len(data) + 1)]
            elif how == "duplicate":
                chunks.insert(index, (due_ms, data))
            elif how == "reorder" and index + 1 < len(chunks):
                chunks[index] = due_ms, chunks[index + 1][1]
                chunks[index + 1] = chunks[index + 1][0], data
            elif how == "delay":
                chunks[index] = due_ms, b""
                direction.put(data, self.now_ms + at % 2000)
        self.happened[how] += 1

    # --- what must hold ---

    def check(self) -> None:
        """Raise AssertionError if the host was told what cannot be, or anything grows."""
        assert len(self.outbox.posted) <= MOST
        for session in self.lines:
            assert len(session.output) <= BACKLOG + MAX_FRAME + 1
        assert len(self.lines) <= 2
        if self.host is None:
            return
        if self._felt:
            passed_ms = self.now_ms - self._touched[self._felt]
            assert passed_ms <= LATE_MS + DEADMAN_MS + TICK_MS, f"touches after {passed_ms} ms"
        silent_ms = self.now_ms - self._intact_ms
        assert silent_ms < DEADMAN_MS or not self.host.pressed, f"held after {silent_ms} ms"
        if self.host.welcomed:
            assert self.past.done == self._base + self._counted, "a command is unaccounted for"

    def settle(self) -> None:
        """Mend everything, wait, and check that both ends know the fate of every command."""
        self.plugged, self._hung_until_ms, self._full_ms = True, self.now_ms, 0
        for direction in (self.to_host, self.to_device):
            direction.free_ms = 0
            direction.chunks = [
                (min(due_ms, self.now_ms), data) for due_ms, data in direction.chunks
            ]
        self.wait(PATIENCE_MS)
        assert self.host is not None
        assert self.host.state == "live"
        assert self._met == self._boot
        assert self.past.done == self.outbox.number == len(self._asked[self._boot])
        assert self.outbox.posted == ()
        assert self.outbox.missed == self.past.missed
        assert self.host.pressed == self.held
        assert not self._felt
        assert (self.host.clock.rtt_ms or 0) <= 2 * LATENCY_MS + 4 * TICK_MS
        offset_ms = self.host.clock.offset_ms
        assert offset_ms is not None
        true_ms = self.device_ms - self.now_ms
        assert abs((offset_ms - true_ms + 2**31) % 2**32 - 2**31) <= LATENCY_MS + 2 * TICK_MS

    # --- the machinery ---

    @property
    def device_ms(self) -> int:
        return self.now_ms + self._skew_ms

    @property
    def _live(self) -> DeviceSession | None:
        return next((session for session in self.lines if session.live), None)

    def _draw(self, size: int) -> bytes:
        self._drawn += 1
        return self._drawn.to_bytes(size, "little")

    def _start_device(self) -> None:
        self._boot += 1
        self._asked[self._boot], self._begun[self._boot] = [], {0}
        if self._serial:
            self._open_line()

    def _open_line(self) -> None:
        session = DeviceSession(
            welcome(nonce=self._boot), key=self._key, outbox=self.outbox, draw=self._draw,
            number=1000 * self._boot + self._drawn,
        )  # fmt: skip
        self.lines = [*(line for line in self.lines if line.live), session]

    def _hang_up(self) -> None:
        for session in self.lines:
            session.end("the wire was cut")
        self.lines.clear()

    def _end_line(self) -> None:
        """End a TCP connection because one end's program has ended: the other end is told."""
        if self._serial:
            return
        self.to_host, self.to_device = Wire(), Wire()
        if self.host is not None:
            self._hear(self.host.cut("the wire was cut"))
        self._hang_up()

    def _look(self) -> None:
        """Check that no contact waits behind anything in the output of the device."""
        for session in self.lines:
            decoder = Decoder()
            decoder.seal = session._seal
            later = [packet.message for packet in decoder.feed(bytes(session.output))][1:]
            waiting = [one for one in later if isinstance(one, ContactState) and one.fingers]
            assert not waiting, "a contact waits"

    def _device_says(self, message: State | Telemetry | ContactState) -> None:
        session = self._live
        if session is not None and not self.hung:
            session.send(message, self.now_ms, self.device_ms)

    def _tick(self) -> None:
        self.plugged = self.plugged or self.now_ms >= self._mended_ms
        if not self.hung:
            self._loop_ms = self.now_ms
        silent_ms = self.now_ms - self._loop_ms
        if silent_ms >= DEADMAN_MS:
            self.held, self._contact = (), 0  # only a new touch holds again
        for session in tuple(self.lines):
            before = len(session.output)
            session.tick(self.device_ms, self.device_ms - silent_ms)
            held = session.live and (session._pressed or session._touched)
            assert not (silent_ms >= DEADMAN_MS and held), "held by a hung loop"
            assert not (silent_ms >= HUNG_MS and len(session.output) > before), "a heartbeat"
        if self.host is not None:
            self._hear(self.host.tick(self.now_ms))
        if self.host is None or self.host.over:
            self._connect()
        self._pump()

    def _connect(self) -> None:
        """Try again when the pause is over, as the receiver does."""
        if self.host is not None and self.host.over:
            self._failures = 0 if self.host.welcomed else self._failures + 1
            self._next_ms = self.now_ms + round(1000 * link_events.pause_s(self._failures, 0.5))
            self.host = None
        if self.now_ms < self._next_ms or not (self.plugged or self._serial):
            return
        if not self._serial:
            self.to_host, self.to_device = Wire(), Wire()
            self._open_line()
        self.host = HostSession(
            "orb", self._drawn * 7919 & 0xFFFF, self.now_ms,
            key=self._key, nonce=self._draw(16), past=self.past,
        )  # fmt: skip
        self._intact_ms = self.now_ms
        self.happened["attempts"] += 1

    def _pump(self) -> None:
        """Carry bytes, there and back, as far as they come now."""
        for session in self.lines:
            # Of two lines the older one is half open: nobody is at its other end.
            if self.plugged and session is self.lines[-1] and session.output:
                if self.now_ms < self._full_ms:
                    continue
                self.to_host.put(bytes(session.output), self.now_ms)
            session.output.clear()
        if self.host is not None and self.host.output:
            if self.plugged:
                self.to_device.put(bytes(self.host.output), self.now_ms)
            self.host.output.clear()
        for data in self.to_device.take(self.now_ms):
            if self.lines and data:
                self._listen(self.lines[-1], data)
        for data in self.to_host.take(self.now_ms):
            if any(_is_intact(run) for run in data.split(b"\0")):
                self._intact_ms = self.now_ms
            if self.host is not None and data:
                self._hear(self.host.receive(data, self.now_ms))

    def _listen(self, session: DeviceSession, data: bytes) -> None:
        live = self._live
        session.taken_by = self.outbox.host if live not in (None, session) else 0
        for request in session.receive(data, self.device_ms):
            if isinstance(request, Hello):
                self.happened["resumed" if session.resumed else "begun"] += 1
                self.lines = [session]  # its old line is closed
                if not session.resumed:
                    self._begun[self._boot].add(len(self._asked[self._boot]))
                if self.hung:
                    self.held = ()
                if self.held:
                    session.send(State(self.held), self.now_ms, self.device_ms)
            elif isinstance(request, Bye):
                self.happened["left"] += 1

    def _hear(self, news: list[link_events.Received]) -> None:
        """Compare what the host is told with what really happened."""
        done = self.past.done - sum(
            item.count if isinstance(item, link_events.Missed) else _is_command(item)
            for item in news
        )  # before these news, as long as no other device was met
        for item in news:
            if isinstance(item, link_events.Connected):
                if not item.welcome.resumed or self._met != item.welcome.boot_nonce:
                    # On a serial line this may still be the device before it was restarted.
                    self._met, self._counted = item.welcome.boot_nonce, 0
                    self._base = done = item.welcome.done
                    assert done in self._begun[self._met], "what was asked before the host came"
            elif isinstance(item, link_events.Missed):
                self._counted += item.count
                done += item.count
                assert done <= len(self._asked[self._met]), "more is missed than was asked for"
                self.happened["missed"] += item.count
            elif isinstance(item, link_events.Delivered) and isinstance(item.message, Command):
                self._counted += 1
                done += 1
                frame, asked_ms = self._asked[self._met][done - 1]
                assert item.message.frame == frame, "out of order, again, or invented"
                age_ms = self.now_ms - asked_ms
                assert age_ms <= LATE_MS, f"obeyed after {age_ms} ms"
                self._newest = max(self._newest, frame)
                self.oldest_ms = max(self.oldest_ms, age_ms)
                self.happened["delivered"] += 1
            elif isinstance(item, link_events.Delivered) and isinstance(item.message, ContactState):
                self._feel(item.message)
            elif isinstance(item, link_events.Stale | link_events.Lost | link_events.Refused):
                self._felt = 0
                self.happened[type(item).__name__.lower()] += 1

    def _feel(self, contact: ContactState) -> None:
        """Compare a contact that the host was told with those that were."""
        if not contact.fingers:
            assert self._felt == contact.frame, "the end of another contact, or of none"
            self._felt = 0
            return
        age_ms = self.now_ms - self._touched[contact.frame]
        assert age_ms <= LATE_MS, f"a contact of {age_ms} ms ago"
        assert contact.frame > self._newest, "a contact behind a command, or behind a newer one"
        self.oldest_ms = max(self.oldest_ms, age_ms)
        self._felt = self._newest = contact.frame
        self.happened["contacts"] += 1

    @staticmethod
    def _between(chunks: list[tuple[int, bytes]], at: int) -> int:
        index = at % (len(chunks) + 1)
        return chunks[index - 1][0] if index and chunks else 0


def _is_command(item: link_events.Received) -> bool:
    return isinstance(item, link_events.Delivered) and isinstance(item.message, Command)


def _is_intact(run: bytes) -> bool:
    """Return whether a run of bytes is a frame with the right checksum."""
    try:
        frame = codec.cobs_decode(run)
    except codec.BAD_BYTES:
        return False
    return len(frame) > 4 and zlib.crc32(frame[:-4]) == int.from_bytes(frame[-4:], "little")
