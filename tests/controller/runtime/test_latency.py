"""The ledger: each hop of each frame, percentiles of the latest ones, and memory that stays."""

import gc
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from controller.runtime import realtime
from controller.runtime.latency import HOPS, LatencyStatistics, StageLatency
from controller.runtime.latency_report import LatencyReporter, close_ledger, open_ledger

ONE_THREAD = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # as the device runs


def test_hops_are_the_differences_of_the_stamps_and_all_is_their_sum() -> None:
    ledger = LatencyStatistics(("scan", "network"))
    ledger.note([0, 2_000_000, 5_000_000])
    assert ledger.latest().tolist() == [2.0, 3.0]
    assert ledger.digest() == [
        StageLatency("scan", 2.0, 2.0, 2.0),
        StageLatency("network", 3.0, 3.0, 3.0),
        StageLatency("all", 5.0, 5.0, 5.0),
    ]


def test_percentiles_are_numpys_own() -> None:
    ledger = LatencyStatistics(("scan",), lines=1000)
    for ms in range(1000):
        ledger.note([0, ms * 1_000_000])
    (scan, _) = ledger.digest()
    assert (scan.p50, scan.p95, scan.p99) == pytest.approx(
        np.percentile(np.arange(1000.0), [50, 95, 99])
    )


def test_old_frames_are_forgotten_and_nothing_grows() -> None:
    ledger = LatencyStatistics(("scan",), lines=10)
    for _ in range(10):
        ledger.note([0, 9_000_000])
    for _ in range(10):
        ledger.note([0, 1_000_000])
    assert ledger.digest()[0] == StageLatency("scan", 1.0, 1.0, 1.0)
    assert ledger.lines == 20


def test_an_empty_ledger_says_nothing() -> None:
    assert LatencyStatistics().digest() == []


def test_garbage_is_swept_between_frames_only() -> None:
    sweeper = realtime.IdleCollector()
    try:
        assert not gc.isenabled()
        before = gc.get_stats()[1]["collections"]
        sweeper.idle(now_s=10.0, left_s=0.001)  # the next frame is near
        assert gc.get_stats()[1]["collections"] == before
        sweeper.idle(now_s=10.0, left_s=0.09)
        assert gc.get_stats()[1]["collections"] == before + 1
        sweeper.idle(now_s=10.1, left_s=0.09)  # swept just now
        assert gc.get_stats()[1]["collections"] == before + 1
    finally:
        sweeper.close()
    assert gc.isenabled()


def test_real_time_that_is_not_allowed_is_said_and_done_without(
    caplog: pytest.LogCaptureFixture,
) -> None:
    def refuse(process: int, policy: int, parameter: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    assert not realtime.real_time(refuse)
    assert "allow it with `ulimit -r 10`" in caplog.text


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="only Linux tells")
def test_no_product_of_a_step_asks_for_memory_any_more() -> None:
    program = """
import sys
import numpy as np
from controller.runtime import realtime as quiet

def pages():
    return int(open("/proc/self/statm").read().split()[0])

def product():
    before = pages()
    np.linalg.solve(np.eye(30) + 1.0, np.ones((30, 30)) @ np.ones((30, 30)))
    return pages() - before

if "reserved" in sys.argv:
    quiet.reserve()
print(product() * 4 // 1024)
"""
    grown = [
        int(subprocess.check_output([sys.executable, "-c", program, word], env=ONE_THREAD))
        for word in ("reserved", "unprepared")
    ]
    assert grown[0] < 2  # MiB
    assert grown[0] <= grown[1]  # how much it would have been is the library's own affair


@pytest.mark.skipif(not hasattr(os, "SCHED_FIFO"), reason="this system has no SCHED_FIFO")
def test_real_time_is_asked_for_this_thread_alone() -> None:
    asked: list[tuple[int, int]] = []
    assert realtime.real_time(lambda process, policy, parameter: asked.append((process, policy)))
    assert asked == [(0, os.SCHED_FIFO)]


def test_a_ledgers_file_has_one_heading_and_a_line_for_each_frame_of_all_sessions(
    tmp_path: Path,
) -> None:
    path = tmp_path / "ledger.csv"
    file = open_ledger(path)
    for _ in range(2):  # sessions
        keeper = LatencyReporter(0.1, lambda pace: None, file=file, clock_ns=lambda: 5_000_000)
        for frame in (1, 2):
            keeper.start(0.001)
            for _ in HOPS[1:]:
                keeper.mark()
            keeper.finish(frame)
        keeper.close()
    close_ledger(file)
    heading, *lines = path.read_text().splitlines()
    assert heading == "frame,wait_ms,scan_ms,prepare_ms,network_ms,decide_ms,send_ms"
    assert lines == [f"{frame},1.0000" + 5 * ",0.0000" for frame in (1, 2, 1, 2)]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a disk that is full")
def test_a_full_disk_costs_the_ledger_and_nothing_else(caplog: pytest.LogCaptureFixture) -> None:
    with Path("/dev/full").open("w") as file:
        keeper = LatencyReporter(0.1, lambda pace: None, file=file)
        for frame in (1, 2):
            keeper.start(0.0)
            for _ in HOPS[1:]:
                keeper.mark()
            keeper.finish(frame)
            keeper.idle(float(frame), 0.09, missed=0)
        keeper.close()
        close_ledger(file)
    assert caplog.messages == ["the ledger ends here: No space left on device"]
