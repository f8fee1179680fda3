"""Cost of the link: packets, round trips against bare pyserial, cuts, silence.

    python -m tests.benchmarks.link [--packets N] [--trips N] [--cuts N] [--silent S]
                                    [--wire NAME ...] [--json]

A round trip is Grant and its Granted, program to program. Its peers are the same number of bytes
there and back over the same kind of wire, in turns: "pyserial" knows how long a frame is, which is
the least that a program can do and the peer of the goal; "lines" has to find a frame's end, as ours
has to; "sessions" is the two sessions with neither thread, lock nor queue. The pty's wire is a
process between two ptys.
"""

from __future__ import annotations

import itertools
import os
import socket
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final

import serial

from controller.shared.protocol import messages as protocol
from controller.shared.protocol.auth import FrameAuthenticator
from controller.shared.protocol.host_session import HostSession
from controller.shared.protocol.packets import Decoder, encode
from host.connection.receiver import Connected, Delivered, Lost, Received, Receiver
from host.connection.transport import open_transport

from .link_peers import CHUNK, FRAME
from .link_wires import WIRES, Line, Peer, Wire
from .results import Results, command_line

PACKETS_GOAL: Final = 150_000.0
TRIP_GOAL: Final = 1.3
BATCH: Final = 250  # round trips in one turn
PATIENCE_S: Final = 30.0
_COMMAND: Final = protocol.NumberedCommand("drop", "pinch", 0.93, (2.0, 1.5), 4711, 17, 16, 9000)
_BEAT: Final = protocol.Heartbeat(9000, 8950, 12, 17, ())
_FRAME: Final = protocol.Telemetry(
    4711, bytes(range(120, 145)), (0.0, 0.2, 0.8, 0.0, 0.0), (2.0, 1.5), "pinch", True, 10.0
)
# What a device says in ten seconds of play: 100 frames, 100 heartbeats, 20 commands.
PRESETS: Final[dict[str, tuple[protocol.Message, ...]]] = {
    "play": (_FRAME, _BEAT) * 5 + (_COMMAND,),
    "command": (_COMMAND,),
    "heartbeat": (_BEAT,),
    "telemetry": (_FRAME,),
}
_KEY: Final = bytes(range(32))


def packets(results: Results, count: int) -> None:
    """Measure decoding and encoding, per second of CPU; the best of five."""
    for preset, sealed in (*((name, False) for name in PRESETS), ("play", True)):
        messages, where = PRESETS[preset], f"{preset}-sealed" if sealed else preset

        def seal(sealed: bool = sealed) -> FrameAuthenticator | None:
            return FrameAuthenticator(_KEY, 0) if sealed else None

        def written(messages: tuple[protocol.Message, ...] = messages) -> list[bytes]:
            said, own = itertools.cycle(messages), seal()
            return [
                encode(next(said), session=1, sequence=n & 0xFFFF, t_ms=n, seal=own)
                for n in range(1, count + 1)
            ]

        stream = b"".join(written())

        def read(stream: bytes = stream) -> None:
            decoder = Decoder()
            decoder.seal = seal()
            chunks = range(0, len(stream), CHUNK)
            assert sum(len(decoder.feed(stream[at : at + CHUNK])) for at in chunks) == count

        for name, work, goal in (
            ("packets_per_s_encoded", written, None), ("packets_per_s", read, PACKETS_GOAL),
        ):  # fmt: skip
            seconds = min(_cpu_seconds(work) for _ in range(5))
            results.note(name, count / seconds, "packet/s", preset=where, goal=goal)


def _cpu_seconds(work: Callable[[], object]) -> float:
    began_s = time.process_time()
    work()
    return time.process_time() - began_s


def until(receiver: Receiver, wanted: Callable[[Received], bool]) -> Received:
    """Return the first news that is wanted."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        receiver.wait(1.0)
        for news in receiver.poll():
            if wanted(news):
                return news
    raise RuntimeError("what was waited for did not come")


def _is_granted(news: Received) -> bool:
    return isinstance(news, Delivered) and isinstance(news.message, protocol.Granted)


def trips(results: Results, wire: Wire, count: int) -> None:
    """Measure round trips, ours and the peers', in turns."""
    assert len(encode(protocol.Grant(0), session=1, sequence=1, t_ms=1)) == FRAME
    with ExitStack() as stack:
        trip_of: dict[str, Callable[[], object]] = {
            kind: make(stack, stack.enter_context(wire.line(far)).url)
            for kind, (far, make) in _TRIPS.items()
        }
        taken: dict[str, list[float]] = {kind: [] for kind in trip_of}
        middles: dict[str, list[float]] = {kind: [] for kind in trip_of}
        for _ in range(max(count // BATCH, 2)):
            for kind, trip in trip_of.items():
                batch = [_seconds(trip) for _ in range(BATCH)]
                taken[kind] += batch
                middles[kind].append(statistics.median(batch))
    for kind, seconds in taken.items():
        results.percentiles(f"round_trip{kind}", [1e6 * each for each in seconds], "us", wire.name)
    for kind, ratio, goal in _RATIOS:
        pairs = zip(middles[_OURS], middles[kind], strict=True)
        median = statistics.median(ours / theirs for ours, theirs in pairs)
        results.note(ratio, median, f"ours/{kind[1:]}", preset=wire.name, goal=goal)


def _seconds(trip: Callable[[], object]) -> float:
    began_s = time.perf_counter()
    trip()
    return time.perf_counter() - began_s


def _our_trip(stack: ExitStack, url: str) -> Callable[[], object]:
    receiver = Receiver(lambda: open_transport(url), granted=True)
    stack.callback(receiver.close)
    receiver.connect()
    until(receiver, lambda news: isinstance(news, Connected))

    def trip() -> None:
        receiver.send(protocol.Grant(0))
        until(receiver, _is_granted)

    return trip


def _sessions_trip(stack: ExitStack, url: str) -> Callable[[], object]:
    port = open_transport(url)
    stack.callback(port.close)
    session = HostSession(url, 1, _now_ms(), granted=True)

    def until(wanted: Callable[[Received], bool]) -> None:
        while True:
            if session.output:
                port.write(bytes(session.output))
                session.output.clear()
            if any(map(wanted, session.receive(port.read(PATIENCE_S), _now_ms()))):
                return

    def trip() -> None:
        session.send(protocol.Grant(0), _now_ms())
        until(_is_granted)

    until(lambda news: isinstance(news, Connected))
    return trip


def _bare_trip(stack: ExitStack, url: str) -> Callable[[], object]:
    port = _pyserial(stack, url)
    message = bytes(FRAME)

    def trip() -> None:
        port.write(message)
        port.read(FRAME)

    return trip


def _lines_trip(stack: ExitStack, url: str) -> Callable[[], object]:
    port = _pyserial(stack, url)
    message = bytes(FRAME - 1) + b"\n"

    def trip() -> None:
        port.write(message)
        port.readline()

    return trip


def _pyserial(stack: ExitStack, url: str) -> Any:
    port = serial.serial_for_url(url, baudrate=115_200, timeout=PATIENCE_S, exclusive=True)
    stack.callback(port.close)
    if url.startswith("socket:"):
        with socket.socket(fileno=os.dup(port.fileno())) as connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return port


def _now_ms() -> int:
    return time.monotonic_ns() // 1_000_000


# What is measured in turns: who is at the far end, and what makes a trip.
_OURS: Final = ""
_TRIPS: Final[dict[str, tuple[str, Callable[[ExitStack, str], Callable[[], object]]]]] = {
    _OURS: ("device", _our_trip),
    "@sessions": ("sessions", _sessions_trip),
    "@pyserial": ("echo", _bare_trip),
    "@lines": ("lines", _lines_trip),
}
_RATIOS: Final = (
    ("@pyserial", "round_trip_ratio", TRIP_GOAL),
    ("@lines", "round_trip_ratio@lines", None),
    ("@sessions", "round_trip_ratio@sessions", None),
)


@contextmanager
def connected(wire: Wire) -> Iterator[tuple[Line, Peer, Receiver]]:
    """Give a line whose bytes are counted, its wire, and a receiver that is connected over it."""
    with wire.line("device", counted=True) as line:
        assert line.wire is not None
        receiver = Receiver(lambda: open_transport(line.url))
        receiver.connect()
        until(receiver, lambda news: isinstance(news, Connected))
        yield line, line.wire, receiver
        receiver.close()


def cuts(results: Results, wire: Wire, count: int) -> None:
    """Measure how long it takes from the wire's return to a new session, and to notice a cut."""
    noticed, back = [], []
    with connected(wire) as (_, cable, receiver):
        for _ in range(count):
            time.sleep(0.3)  # of quiet between two cuts
            began_s = time.monotonic()
            cable.ask("pull")
            until(receiver, lambda news: isinstance(news, Lost))
            noticed.append(time.monotonic() - began_s)
            began_s = time.monotonic()
            cable.ask("plug")
            until(receiver, lambda news: isinstance(news, Connected))
            back.append(time.monotonic() - began_s)
    results.note("cut_noticed_p50_s", statistics.median(noticed), "s", preset=wire.name)
    results.note("reconnect_p50_s", statistics.median(back), "s", preset=wire.name)
    results.note("reconnect_max_s", max(back), "s", preset=wire.name)


def silence(results: Results, wire: Wire, seconds: float) -> None:
    """Measure what a link costs on which nothing is said but that both are there."""
    with connected(wire) as (line, cable, receiver):
        pid = line.peer.process.pid
        bytes_before = sum(cable.ask("bytes")["bytes"])
        here_s, there_s = time.process_time(), _cpu_s(pid)
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0:
            receiver.wait(left_s)
            if any(isinstance(news, Lost) for news in receiver.poll()):
                raise RuntimeError("the link was lost in silence")
        minute = 60.0 / seconds
        here_s, there_s = time.process_time() - here_s, _cpu_s(pid) - there_s
        passed = sum(cable.ask("bytes")["bytes"]) - bytes_before
    results.note("silent_minute_host_cpu_s", here_s * minute, "s", preset=wire.name)
    results.note("silent_minute_device_cpu_s", there_s * minute, "s", preset=wire.name)
    results.note("silent_minute_bytes", passed * minute, "byte", preset=wire.name)


def _cpu_s(pid: int) -> float:
    """Return the CPU time of a process, user and system."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main(argv: Sequence[str] | None = None) -> None:
    parser = command_line(__doc__, packets=50_000, trips=5000, cuts=10, silent=60.0)
    parser.add_argument(
        "--wire", action="append", choices=[wire.name for wire in WIRES], help="only these"
    )
    options = parser.parse_args(argv)
    if sys.platform != "linux":
        parser.error("it needs ptys and /proc")
    results = Results("link")
    packets(results, options.packets)
    for wire in WIRES:
        if options.wire and wire.name not in options.wire:
            continue
        trips(results, wire, options.trips)
        if options.cuts:
            cuts(results, wire, options.cuts)
        if options.silent:
            silence(results, wire, options.silent)
    results.finish(options.json)


if __name__ == "__main__":
    main()
