"""Latency reports of the loop, and work scheduled between frames: a stamp at the end of each hop.

The loop says when a frame begins, the stages mark the ends of their hops, and between two frames,
when there is time, garbage is swept, the host and `controller status` are told, and the ledger's
file is written. Nothing here waits, and memory does not grow.
"""

import contextlib
import json
import logging
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, TextIO

from controller.files import atomic_write, runtime_folder
from controller.protocol.messages import LatencyReport, StageTime
from controller.runtime.latency import HOPS, LatencyStatistics, StageLatency
from controller.runtime.realtime import IdleCollector

TELL_S: Final = 1.0  # between two reports
_SLACK_S: Final = 0.01  # nothing is done between frames that are nearer than this
_LINES: Final = 256  # of the ledger's file, until they are written

_log = logging.getLogger("controller")

Tell = Callable[[LatencyReport], object]


class LatencyReporter:
    """Keeps the ledger of one session, and its reports.

    Attributes:
        about: What else the status file says.
    """

    def __init__(
        self,
        period_s: float,
        tell: Tell,
        *,
        sweeper: IdleCollector | None = None,
        file: TextIO | None = None,
        status: Path | None = None,
        about: dict[str, object] | None = None,
        clock_ns: Callable[[], int] = time.perf_counter_ns,
    ) -> None:
        """Prepare; the first frame is `start`ed by the loop.

        Args:
            period_s: From frame to frame: what there is to spend.
            tell: Takes a report for the host.
            sweeper: Collects garbage between frames.
            file: Takes a line of comma-separated milliseconds for each frame.
            status: A file for `controller status`, replaced with every report.
            about: What else is said there.
            clock_ns: Nanoseconds that never go back.
        """
        self.ledger = LatencyStatistics()
        self._period_s, self._tell, self._sweeper = period_s, tell, sweeper
        self._file, self._status, self.about = file, status, about or {}
        self._clock_ns = clock_ns
        self._stamps = [0] * (len(HOPS) + 1)
        self._at = 0
        self._lines: list[str] = []
        self._told_s = 0.0

    def start(self, late_s: float) -> None:
        """Begin a frame that was due so long ago."""
        now_ns = self._clock_ns()
        self._stamps[0] = now_ns - round(late_s * 1e9)
        self._stamps[1] = now_ns
        self._at = 2

    def mark(self) -> None:
        """End a hop."""
        if self._at < len(self._stamps):
            self._stamps[self._at] = self._clock_ns()
            self._at += 1

    def finish(self, frame: int) -> None:
        """End a frame; one that did not get through all hops does not count."""
        if self._at != len(self._stamps):
            return
        self.ledger.note(self._stamps)
        if self._file is not None:
            hops = ",".join(f"{ms:.4f}" for ms in self.ledger.latest().tolist())
            self._lines.append(f"{frame},{hops}\n")

    def idle(self, now_s: float, left_s: float, missed: int) -> None:
        """Use the time until the next frame, if there is enough of it.

        Args:
            now_s: The loop's clock.
            left_s: Until the next frame.
            missed: Frames that could not be read in their time, since the start.
        """
        if left_s < _SLACK_S:
            if len(self._lines) >= _LINES:
                self._write()
            return
        if self._sweeper is not None:
            self._sweeper.idle(now_s, left_s)
        if now_s - self._told_s >= TELL_S and self.ledger.lines:
            self._told_s = now_s
            self.ledger.missed = missed
            digest = self.ledger.digest()
            self._tell(pace(digest, self._period_s, missed))
            self._publish(digest, missed)
            self._write()

    def close(self) -> None:
        """Write what is left, and take the status away."""
        self._write()
        if self._status is not None:
            with contextlib.suppress(OSError):
                self._status.unlink()

    def _write(self) -> None:
        """Bring the ledger's lines into its file; a full disk costs the ledger, not the game."""
        if self._file is not None and self._lines:
            try:
                self._file.writelines(self._lines)
                self._file.flush()
            except OSError as error:
                _log.warning("the ledger ends here: %s", error.strerror or error)
                self._file = None
        self._lines.clear()

    def _publish(self, digest: list[StageLatency], missed: int) -> None:
        if self._status is None:
            return
        said = {
            **self.about,
            "pid": os.getpid(),
            "frames": self.ledger.lines,
            "missed": missed,
            "period_ms": round(self._period_s * 1000, 3),
            "hops": [[d.hop, d.p50, d.p95, d.p99] for d in digest],
        }
        try:
            atomic_write(self._status, (json.dumps(said) + "\n").encode(), durable=False)
        except OSError:
            self._status = None  # nobody can ask, and the orb goes on


def open_ledger(path: Path) -> TextIO:
    """Return a new file for each frame's hops, which is headed.

    Raises:
        OSError: It exists, or cannot be written.
    """
    file = path.open("x", encoding="utf-8")
    file.write(f"frame,{','.join(f'{hop}_ms' for hop in HOPS)}\n")
    return file


def close_ledger(file: TextIO) -> None:
    """Close it; what a full disk does not take is lost, and was told."""
    with contextlib.suppress(OSError):
        file.close()


def pace(digest: list[StageLatency], period_s: float, missed: int) -> LatencyReport:
    """Return a digest as the message for the host."""
    return LatencyReport(
        period_s * 1000, missed, tuple(StageTime(d.hop, d.p50, d.p95, d.p99) for d in digest)
    )


def status_folders() -> list[Path]:
    """Return where running controllers tell how they are: the service, then the user's own."""
    return [Path("/run/orbtouch"), runtime_folder()]


def status_file() -> Path | None:
    """Return where this controller tells how it is; None if there is no such place."""
    service = os.environ.get("RUNTIME_DIRECTORY", "").partition(":")[0]  # systemd's
    folder = Path(service) if service else status_folders()[-1]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder / "status.json"
