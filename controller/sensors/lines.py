"""A sensor that prints one line of numbers a frame: on a serial port, or at tcp:HOST:PORT."""

from __future__ import annotations

import math
import re
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.frames import Frame
from controller.recordings.recording import MAX_TAXELS
from controller.sensors.base import Sensor, SensorOptions
from controller.sensors.geometry import SensorAwayError, SensorError
from controller.sensors.hardware.description import Description, affordable, read
from controller.shared import ports

FIRST_S: Final = 5.0  # until the first frame: boards start anew when their port is opened
MEASURED: Final = 16  # frames from which the rate is measured
_STALE_S: Final = 0.5  # a frame as old as this is no longer the sensor's ...
_STALE_FRAMES: Final = 3.0  # ... nor one that so many should have followed
_RETRY_S: Final = 0.5  # between two attempts to open a lost port
_POLL_S: Final = 0.002  # between two looks at the port
_CHUNK: Final = 1 << 14  # bytes of one look
_PARSED: Final = 4  # full chunks that are parsed in one frame ...
_DROPPED: Final = 256  # ... and of the older ones that wait behind them, how many are dropped


@dataclass(frozen=True)
class Options(SensorOptions):
    """Options of the sensor: its description, and entries in place of the description's."""

    wiring: Path | None = None
    port: str = ""
    rows: int = 0
    columns: int = 0


def create(options: Options, rate_hz: float | None = None) -> Lines:
    """Return the sensor after a first frame, or raise SensorError; SensorAwayError if none comes.

    Without a description the grid is found out: `controller doctor --out FILE` writes one.
    """
    known = Description() if options.port and options.wiring is None else None
    grid = options.rows, options.columns
    if any(grid) and not (min(grid) > 0 and math.prod(grid) <= MAX_TAXELS):
        raise SensorError(
            f"rows={grid[0]} and columns={grid[1]} are no grid; give both, 1 to {MAX_TAXELS} taxels"
        )
    own = {"port": options.port, "rows": options.rows, "columns": options.columns}
    given: dict[str, Any] = {name: value for name, value in own.items() if value}
    description = replace(known or read(options.wiring, "lines"), **given)
    if not description.port:
        raise SensorError('--sensor lines needs a port: port = "..." in its description')
    port = _open(description)
    try:
        return start(description, port, rate_hz)
    except OSError as error:
        port.close()
        raise SensorAwayError(f"{description.port} is lost: {ports.why(error)}") from None
    except BaseException:
        port.close()
        raise


def start(
    description: Description,
    port: Any,
    rate_hz: float | None = None,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> Lines:
    """Return the sensor of an open port, at a rate or its own, after a first frame.

    A rate that the description does not give is measured. SensorAwayError if no frame comes.
    """
    parser, own_hz = LineParser(description.length), description.rate_hz

    def wait(frames: int) -> None:
        """Parse until so many frames more have come."""
        last, until_s = parser.frames, clock() + FIRST_S
        while frames > 0:
            parser.feed(available(port))
            if parser.frames > last:
                frames -= parser.frames - last
                last, until_s = parser.frames, clock() + FIRST_S
            elif clock() > until_s:
                raise SensorAwayError(_silence(description, parser))
            else:
                sleep(_POLL_S)

    wait(1)
    if not own_hz:
        receive(port, parser)  # what waited in buffers came at once
        wait(1)
        began_s, before = clock(), parser.frames
        wait(MEASURED)
        own_hz = float(f"{(parser.frames - before) / max(clock() - began_s, 1e-3):.2g}")
    description = replace(description.gridded(parser.count), rate_hz=own_hz)
    assert parser.latest is not None
    if description.signal.ratio and description.frame(parser.latest).min() <= 0.0:
        raise SensorError(
            f"{description.name} reads 0 pF or less, which is no capacitance; give its description "
            "another unit (orbtouch docs sensors)"
        )
    read_hz = own_hz if rate_hz is None else affordable(own_hz, rate_hz)
    return Lines(description, port, parser, read_hz)


def available(port: Any) -> bytes:
    """Return the bytes that a port or a socket has, without waiting; OSError if it is lost."""
    if not isinstance(port, socket.socket):
        data: bytes = port.read(port.in_waiting or 1)
        return data
    try:
        data = port.recv(_CHUNK)
    except BlockingIOError:
        return b""
    if not data:
        raise OSError("the other side has closed the connection")
    return data


def receive(port: Any, parser: LineParser) -> None:
    """Parse what has come, within bounds: a source may send faster than lines are parsed.

    Of more than 64 kB the rest is dropped, so that the next lines are new ones.
    """
    for _ in range(_PARSED):
        if not (data := available(port)):
            return
        parser.feed(data)
    for _ in range(_DROPPED):
        if not available(port):
            return
        parser.cut()


class Lines(Sensor):
    """A port and a parser; `read` gives the newest whole frame.

    Attributes:
        description: Of the sensor, with the rate as measured.
        parser: Its counts of lines.
    """

    hardware = "lines"
    description: Description

    def __init__(
        self, description: Description, port: Any, parser: LineParser, rate_hz: float
    ) -> None:
        """Take over an open port, and a parser with a first frame."""
        self.description, self.parser, self.rate_hz = description, parser, rate_hz
        self.geometry, self.signal = description.geometry, description.signal
        self.device_id = description.name
        self._port: Any = port
        self._stale_s = max(_STALE_S, _STALE_FRAMES / description.rate_hz)
        self._seen, self._seen_s, self._retry_s = 0, 0.0, 0.0

    def read(self, t_s: float) -> Frame:
        """Return the newest frame, (rows, columns); SensorAwayError if it is too old."""
        try:
            self._receive(t_s)
        except OSError as error:  # and pyserial's errors
            self.close()
            raise SensorAwayError(f"{self.description.port} is lost: {ports.why(error)}") from None
        if self.parser.frames != self._seen:
            self._seen, self._seen_s = self.parser.frames, t_s
        if t_s - self._seen_s > self._stale_s:
            raise SensorAwayError(_silence(self.description, self.parser))
        assert self.parser.latest is not None
        return self.description.frame(self.parser.latest)

    def close(self) -> None:
        """Close the port."""
        if self._port is not None:
            with suppress(OSError):
                self._port.close()
            self._port = None

    def _receive(self, t_s: float) -> None:
        """Parse what has come; a lost port is opened again."""
        if self._port is None:
            if t_s < self._retry_s:
                raise OSError("it is opened again soon")
            self._retry_s = t_s + _RETRY_S
            self._port = _open(self.description)
            self.parser.cut()
        receive(self._port, self.parser)


def _open(description: Description) -> Any:
    """Return the open port of a description, or raise SensorAwayError; SensorError for no port."""
    name = description.port
    url = f"socket://{name.removeprefix('tcp:')}" if name.startswith("tcp:") else name
    try:
        return ports.open_port(url, description.baud)
    except Exception as error:  # pyserial raises many kinds, such as termios.error
        kind = SensorError if isinstance(error, ValueError) else SensorAwayError
        raise kind(f"cannot open {name}: {ports.why(error)}") from None


def _silence(description: Description, parser: LineParser) -> str:
    """Return the sentence about a port without frames."""
    if parser.dropped:
        expected = f"{description.length} numbers" if description.length else "numbers"
        return (
            f"{description.port} sends lines, but none of {expected}; check baud, rows and columns"
        )
    return f"{description.port} sends no lines; check cable, baud, and the program of the board"


# --- frames in a stream of lines: numbers between commas, spaces, tabs or semicolons; pure --------

MAX_LINE: Final = 64 << 10  # bytes; a longer line is garbage
_LARGEST: Final = 1e6  # of a value, as in recordings
_SEPARATOR: Final = re.compile(rb"[ \t]*[,;\t][ \t]*| +")
_NUMERIC: Final = re.compile(rb"[-+.,;0-9eE \t]+")

Values = NDArray[np.float32]  # (values,)


class LineParser:
    """Finds whole frames; headers, cut, joined and garbled lines are dropped.

    An empty field (",,") is a missing value: the taxel's last one is taken.

    Attributes:
        count: Values of a frame; 0 until two lines in a row agree.
        frames: Number of frames so far.
        dropped: Number of other lines so far.
        latest: The newest frame, (count,); None: there was none.
    """

    def __init__(self, count: int = 0) -> None:
        """Begin in the middle of a line, as a port does; `count` 0 is found out."""
        self.count = count
        self.frames = self.dropped = 0
        self.latest: Values | None = None
        self._rest = b""
        self._whole = False  # whether the beginning of the present line was seen
        self._candidate = 0  # values of the line before, while the count is unknown

    def cut(self) -> None:
        """Begin in the middle of a line again: the port was lost."""
        self._rest, self._whole = b"", False

    def feed(self, data: bytes) -> list[Values]:
        """Take bytes as they came; return the frames that they complete, oldest first."""
        *lines, rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        found = []
        for line in filter(bytes.strip, lines if self._whole else lines[1:]):
            values = self._values(line)
            if values is None:
                self.dropped += 1
            else:
                self.frames, self.latest = self.frames + 1, values
                found.append(values)
        self._rest, self._whole = rest, self._whole or bool(lines)
        if len(rest) > MAX_LINE:
            self.cut()
        return found

    def _values(self, line: bytes) -> Values | None:
        """Return the frame in a whole line, (count,), or None."""
        if not _NUMERIC.fullmatch(line):
            return None
        fields = _SEPARATOR.split(line.strip().rstrip(b",;"))
        if not self.count:
            agreed, self._candidate = len(fields) == self._candidate, len(fields)
            if not agreed:
                return None
            self.count = len(fields)
        if len(fields) != self.count:
            return None
        try:
            values = np.array([float(field) if field else np.nan for field in fields])
        except ValueError:
            return None
        missing = np.isnan(values)
        if missing.any():
            if self.latest is None:
                return None
            values[missing] = self.latest[missing]
        return values.astype(np.float32) if np.abs(values).max() < _LARGEST else None
