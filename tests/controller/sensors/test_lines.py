"""The sensor `lines`: a recorded session, printed on a pty, is understood as its replay is."""

import contextlib
import os
import socket
import sys
from collections.abc import Callable, Iterator
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.recordings import reader
from controller.recordings.recording import Recording
from controller.sensors import base as sensors
from controller.sensors import lines
from controller.sensors.geometry import SensorAwayError, SensorError
from controller.sensors.hardware.description import Description
from controller.sensors.lines import LineParser
from controller.shared import ports
from controller.shared.aliases import Frames
from tests.support import ROOT
from tests.support.described import described

if sys.platform == "win32":
    pytest.skip("Windows has no ptys", allow_module_level=True)

import pty
import tty

SHIPPED = bundle.read(bundle.default_path(10.0))
GRID = "rows = 5\ncolumns = 5\n"
Print = Callable[[NDArray[np.floating]], bytes]


def commas(frame: NDArray[np.floating]) -> bytes:
    return b",".join(b"%.5g" % value for value in frame.ravel()) + b"\r\n"


class Board:
    """A board that prints lines on a pty; each is read before the next one is printed."""

    def __init__(self) -> None:
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)

    def write(self, data: bytes) -> None:
        os.write(self._master, data)

    def sensor(self, text: str, first: bytes, rate_hz: float | None = None) -> lines.Lines:
        """A sensor of a description, on this pty, that has read the line `first`."""
        description = described(f'port = "{self.port}"\n{text}')
        port = ports.open_port(self.port)
        self.write(b"half a li\n" + first)
        return lines.start(description, port, rate_hz)

    def show(self, sensor: lines.Lines, line: bytes, t_s: float) -> Frames:
        """Print a line; return what the sensor reads after it has come."""
        self.write(line)
        before = sensor.parser.frames + sensor.parser.dropped
        while True:
            frame = sensor.read(t_s)
            if sensor.parser.frames + sensor.parser.dropped != before:
                return frame

    def close(self) -> None:
        os.close(self._master)
        os.close(self._slave)


@pytest.fixture
def board() -> Iterator[Board]:
    made = Board()
    yield made
    made.close()


@pytest.fixture(scope="module")
def session() -> Recording:
    return reader.load(ROOT / "assets" / "demo.npz")


@pytest.fixture(scope="module")
def replayed(session: Recording) -> list[tuple[float, str]]:
    return understood(sensors.load("replay", path=session_path()), session.t, lambda k: None)


def session_path() -> Path:
    return ROOT / "assets" / "demo.npz"


def understood(
    sensor: Any, times: NDArray[np.float64], show: Callable[[int], Any]
) -> list[tuple[float, str]]:
    """Time and name of each command, at a frame each time."""
    pipeline = Pipeline(
        SHIPPED.settings, Recognizer(SHIPPED), SHIPPED.mapping, signal=sensor.signal
    )
    found = []
    for number, t_s in enumerate(times.tolist()):
        frame = show(number)
        step = pipeline.step(sensor.read(t_s) if frame is None else frame, t_s)
        if step.command is not None:
            found.append((t_s, step.command.command))
    return found


def names(commands: list[tuple[float, str]]) -> list[str]:
    return [name for _, name in commands]


def alike(one: list[str], other: list[str]) -> int:
    """How many commands two lists have in common, in order."""
    matcher = SequenceMatcher(None, one, other, autojunk=False)
    return sum(block.size for block in matcher.get_matching_blocks())


def play(
    board: Board, text: str, frames: Frames, times: NDArray[np.float64], printed: Print = commas
) -> list[tuple[float, str]]:
    """The commands of frames that are printed as lines."""
    sensor = board.sensor(text, printed(frames[0]), 10.0)
    return understood(
        sensor, times, lambda k: board.show(sensor, printed(frames[k]), float(times[k]))
    )


def test_lines_of_a_session_give_the_commands_of_its_replay(
    board: Board, session: Recording, replayed: list[tuple[float, str]]
) -> None:
    assert len(replayed) == 113
    text = GRID + 'unit = "pF"\nrate_hz = 10.0\n'
    assert play(board, text, session.frames, session.t) == replayed


def test_at_9_hz_the_commands_are_the_same(
    board: Board, session: Recording, replayed: list[tuple[float, str]]
) -> None:
    times = session.t
    sent = np.arange(0.0, times[-1], 1 / 9)  # when a board without a common clock prints
    newest = np.maximum(np.searchsorted(times, sent, side="right") - 1, 0)
    sensor = board.sensor(GRID + 'unit = "pF"\nrate_hz = 9.0\n', commas(session.frames[0]), 10.0)
    assert sensor.rate_hz == 10.0
    shown = 0

    def show(number: int) -> Frames | None:
        nonlocal shown
        frame = None
        while shown < len(sent) and sent[shown] <= times[number]:
            frame = board.show(sensor, commas(session.frames[newest[shown]]), times[number])
            shown += 1
        return frame

    assert names(understood(sensor, times, show)) == names(replayed)


def test_missing_values_cost_one_command_of_113_at_most(
    board: Board, session: Recording, replayed: list[tuple[float, str]]
) -> None:
    rng = np.random.default_rng(3)

    def holed(frame: NDArray[np.floating]) -> bytes:
        fields = commas(frame).rstrip().split(b",")
        kind = rng.random()
        if kind < 0.1:
            fields[rng.integers(25)] = b""  # ",,": the taxel's last value is taken
        elif kind < 0.12:
            del fields[rng.integers(25)]  # the whole line is dropped
        return b",".join(fields) + b"\n"

    sensor = board.sensor(GRID + 'unit = "pF"\nrate_hz = 10.0\n', commas(session.frames[0]), 10.0)
    found = understood(
        sensor,
        session.t,
        lambda k: board.show(sensor, holed(session.frames[k]), float(session.t[k])),
    )
    assert sensor.parser.dropped > 20
    assert len(found) <= len(replayed)
    assert alike(names(found), names(replayed)) >= len(replayed) - 1  # a short press


def test_taxels_in_another_order_are_put_in_their_places(
    board: Board, session: Recording, replayed: list[tuple[float, str]]
) -> None:
    wires = np.random.default_rng(4).permutation(30)[:25]  # the value of each taxel, of 30

    def printed(frame: NDArray[np.floating]) -> bytes:
        values = np.full(30, 7.0)
        values[wires] = frame.ravel()
        return commas(values).replace(b",", b" ")

    text = f'{GRID}values = 30\norder = {wires.tolist()}\nunit = "pF"\nrate_hz = 10.0\n'
    assert play(board, text, session.frames, session.t, printed) == replayed


@pytest.mark.parametrize("sign", ["falls", "rises"])
def test_counts_that_rest_at_zero_give_the_same_commands(
    board: Board, session: Recording, replayed: list[tuple[float, str]], sign: str
) -> None:
    rest = session.frames[:10].mean(axis=0)
    change = 1000.0 * (session.frames / rest - 1.0) * (-1.0 if sign == "rises" else 1.0)
    counts = np.round(change).astype(np.float32)
    text = f'{GRID}sign = "{sign}"\nunit = "counts"\nscale = 1000.0\nrate_hz = 10.0\n'
    assert names(play(board, text, counts, session.t)) == names(replayed)


def test_without_a_scale_the_first_touches_and_some_light_ones_are_lost(
    board: Board, session: Recording, replayed: list[tuple[float, str]]
) -> None:
    """The first touches are firm ones here, so the scale that is learned is a fifth too high."""
    rest = session.frames[:10].mean(axis=0)
    counts = np.round(1000.0 * (session.frames / rest - 1.0)).astype(np.float32)
    found = names(play(board, GRID + "rate_hz = 10.0\n", counts, session.t))
    assert len(found) <= len(replayed)
    assert alike(found, names(replayed)) >= 106  # of 113


# --- rate, silence, loss --------------------------------------------------------------------------


class Paced:
    """A port on a clock of its own that prints lines at a rate, after a backlog of 50."""

    def __init__(self, rate_hz: float) -> None:
        self.now_s, self._rate_hz, self._sent = 0.0, rate_hz, -50
        self.line = b"1,2,3,4\n"

    @property
    def in_waiting(self) -> int:
        return 1

    def clock(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds

    def read(self, size: int) -> bytes:
        due = int(self.now_s * self._rate_hz)
        lines, self._sent = due - self._sent, due
        return self.line * lines

    def close(self) -> None:
        """Nothing is open."""


@pytest.mark.parametrize("rate_hz", [9.0, 40.0])
def test_rate_and_grid_are_found_out(rate_hz: float) -> None:
    port = Paced(rate_hz)
    bare = described("rows = 2\ncolumns = 2\n")
    sensor = lines.start(bare, port, None, port.clock, port.sleep)
    assert sensor.rate_hz == pytest.approx(rate_hz, rel=0.02)
    assert sensor.read(0.0).tolist() == [[1.0, 2.0], [3.0, 4.0]]


def test_picofarads_at_zero_are_refused_since_they_would_be_divided_by() -> None:
    port = Paced(40.0)
    mine = described('rows = 2\ncolumns = 2\nunit = "pF"\n')
    assert lines.start(mine, port, None, port.clock, port.sleep).signal.ratio
    port = Paced(40.0)
    port.line = b"1,0,3,2\n"
    with pytest.raises(
        SensorError, match=r"reads 0 pF or less.* give its description another unit"
    ):
        lines.start(mine, port, None, port.clock, port.sleep)


def test_a_silent_board_is_told_with_what_to_look_at(board: Board) -> None:
    port = Paced(0.0)
    port.read(1)
    mine = described('port = "/dev/ttyACM0"\nrows = 2\ncolumns = 2\n')
    with pytest.raises(SensorAwayError, match="/dev/ttyACM0 sends no lines; check cable, baud"):
        lines.start(mine, port, None, port.clock, port.sleep)
    other = described("rows = 3\ncolumns = 3\n")
    with pytest.raises(SensorAwayError, match="sends lines, but none of 9 numbers; check baud"):
        lines.start(other, Paced(40.0), None, port.clock, port.sleep)


def test_a_board_that_falls_silent_is_away_until_its_next_line(board: Board) -> None:
    sensor = board.sensor("rows = 1\ncolumns = 2\nrate_hz = 10.0\n", b"1,2\n")
    assert board.show(sensor, b"3,4\n", 1.0).tolist() == [[3.0, 4.0]]
    assert sensor.read(1.4).tolist() == [[3.0, 4.0]]  # the clocks differ: a frame may come twice
    with pytest.raises(SensorAwayError, match="sends no lines"):
        sensor.read(1.6)
    board.write(b"5,6\n")
    while sensor.parser.frames < 3:
        with contextlib.suppress(SensorAwayError):
            frame = sensor.read(1.7)
    assert frame.tolist() == [[5.0, 6.0]]


def read_until_lost(sensor: lines.Lines) -> None:
    """Read until the system has told that the connection is closed."""
    for _ in range(100_000):
        sensor.read(0.1)


def test_tcp_and_a_lost_connection(free_port: int) -> None:
    with socket.create_server(("127.0.0.1", free_port)) as server:
        mine = f'port = "tcp:127.0.0.1:{free_port}"\nrows = 1\ncolumns = 2\nrate_hz = 10.0\n'
        description = described(mine)
        port = ports.open_port(f"socket://127.0.0.1:{free_port}")
        peer, _ = server.accept()
        peer.sendall(b"\n1,2\n")
        sensor = lines.start(description, port)
        assert sensor.read(0.0).tolist() == [[1.0, 2.0]]
        peer.close()
        with pytest.raises(SensorAwayError, match="is lost"):
            read_until_lost(sensor)
        with pytest.raises(SensorAwayError, match="sends no lines"):
            sensor.read(1.0)  # opens it again
        peer, _ = server.accept()
        peer.sendall(b"9,9\n3,4\n")  # the first line may be cut
        while sensor.parser.frames < 2:
            with contextlib.suppress(SensorAwayError):
                frame = sensor.read(1.1)
        assert frame.tolist() == [[3.0, 4.0]]
        peer.close()
        sensor.close()


def test_a_grid_that_is_no_square_is_named_in_the_options(monkeypatch: pytest.MonkeyPatch) -> None:
    described: list[Description] = []
    monkeypatch.setattr(lines, "_open", lambda _: None)
    monkeypatch.setattr(lines, "start", lambda description, *_: described.append(description))
    lines.create(lines.Options(port="/dev/ttyACM0", rows=3, columns=4))
    assert (described[0].port, described[0].rows, described[0].columns) == ("/dev/ttyACM0", 3, 4)


@pytest.mark.parametrize(
    ("spec", "sentence"),
    [
        ("lines", "needs a description: lines:wiring=FILE.toml"),
        ("lines:port=/dev/absent", "cannot open /dev/absent: there is no such port"),
        ("lines:port=tcp:nowhere", "expected is socket://ADDRESS:PORT"),
        ("lines:port=/dev/absent,rows=3", "rows=3 and columns=0 are no grid; give both"),
        ("lines:port=/dev/absent,rows=-3,columns=-4", "rows=-3 and columns=-4 are no grid"),
    ],
)
def test_what_is_missing_is_said_in_a_sentence(spec: str, sentence: str) -> None:
    with pytest.raises(SensorError, match=sentence):
        sensors.load(spec)


def test_a_port_that_may_come_back_is_waited_for_and_a_name_that_is_none_is_not() -> None:
    with pytest.raises(SensorAwayError):
        sensors.load("lines:port=/dev/absent,rows=3,columns=4")
    with pytest.raises(SensorError) as never:
        sensors.load("lines:port=tcp:nowhere,rows=3,columns=4")
    assert not isinstance(never.value, SensorAwayError)


class NeverEmpty:
    """A port whose other side prints faster than anything can read."""

    in_waiting = 1 << 14

    def __init__(self) -> None:
        self.count = 0

    def read(self, size: int) -> bytes:
        """The same line again and again, cut anywhere; each read shows another value."""
        self.count += 1
        line = b"%d,2,3,4\n" % self.count
        return (line * (size // len(line) + 1))[:size]


def test_a_source_that_never_pauses_costs_a_bounded_amount_a_frame() -> None:
    description = described('port = "endless"\nrows = 2\ncolumns = 2\nrate_hz = 40.0\n')
    port = NeverEmpty()
    sensor = lines.start(description, port, None)
    seen = []
    for number in range(1, 4):
        before = port.count
        seen.append(int(sensor.read(number / 40.0)[0, 0]))
        assert port.count - before <= 300  # looks at the port
    assert seen == sorted(set(seen))  # each frame is a newer one


def test_a_rate_is_measured_of_a_source_that_never_pauses() -> None:
    description = described('port = "endless"\nrows = 2\ncolumns = 2\n')
    assert lines.start(description, NeverEmpty(), 40.0).rate_hz == pytest.approx(40.0, rel=0.05)


@pytest.mark.parametrize(("chunks", "parsed", "dropped"), [(2, 2, 0), (9, 4, 5), (500, 4, 256)])
def test_of_a_flood_the_first_is_parsed_and_the_rest_is_dropped(
    chunks: int, parsed: int, dropped: int
) -> None:
    class Flood:
        in_waiting, left = 2, chunks

        def read(self, size: int) -> bytes:
            self.left -= 1
            return b"1\n" if self.left >= 0 else b""

    class Counter(LineParser):
        fed = cuts = 0

        def feed(self, data: bytes) -> list[Any]:
            self.fed += 1
            return []

        def cut(self) -> None:
            self.cuts += 1

    counter = Counter(1)
    lines.receive(Flood(), counter)
    assert (counter.fed, counter.cuts) == (parsed, dropped)


def test_a_port_with_nothing_to_read_is_asked_for_a_byte_to_see_if_it_is_lost() -> None:
    class Lost:
        in_waiting = 0

        def read(self, size: int) -> bytes:
            if size:
                raise OSError("the board was unplugged")
            return b""

    with pytest.raises(OSError, match="unplugged"):
        lines.available(Lost())
