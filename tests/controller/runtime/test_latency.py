"""The ledger: each hop of each frame, percentiles of the latest ones, and memory that stays."""

from dataclasses import replace
from types import SimpleNamespace

from controller.cli.run import options_of
from controller.runtime.assemble import open_device, prepare
from controller.runtime.latency import HOPS, LatencyReporter, LatencyStatistics
from controller.shared.protocol.messages import LatencyReport, StageTime


def test_hops_are_the_differences_of_the_stamps_and_all_is_their_sum() -> None:
    ledger = LatencyStatistics(("scan", "network"))
    ledger.note([0, 2_000_000, 5_000_000])
    assert ledger.digest() == (
        StageTime("scan", 2.0, 2.0, 2.0),
        StageTime("network", 3.0, 3.0, 3.0),
        StageTime("all", 5.0, 5.0, 5.0),
    )


def test_old_frames_are_forgotten_and_nothing_grows() -> None:
    ledger = LatencyStatistics(("scan",), lines=10)
    assert ledger.digest() == ()
    for ms in [9] * 10 + [1] * 10:
        ledger.note([0, ms * 1_000_000])
    assert ledger.digest()[0] == StageTime("scan", 1.0, 1.0, 1.0)
    assert ledger.lines == 20


def test_frames_count_after_all_hops_and_reports_come_once_a_second() -> None:
    reports: list[LatencyReport] = []
    reporter = LatencyReporter(0.1, reports.append, clock_ns=lambda: 5_000_000)
    for hops in (len(HOPS) - 1, 2):  # the sensor was away in the second frame
        reporter.start(0.001)
        for _ in range(hops):
            reporter.mark()
        reporter.idle(now_s=3.0, left_s=0.09, missed=2)
    (report,) = reports
    assert (report.period_ms, report.missed) == (100.0, 2)
    assert report.hops[0] == StageTime("wait", 1.0, 1.0, 1.0)
    assert reporter.statistics.lines == 1


def test_a_report_carries_the_time_of_its_frame_as_every_message() -> None:
    sent: list[tuple[object, int]] = []
    link = SimpleNamespace(
        connected=True, touchable=True, send=lambda message, t_ms: sent.append((message, t_ms))
    )
    parts = prepare(options_of(["--seed", "3"]))
    device = open_device(replace(parts, link=link), 1)  # type: ignore[arg-type]
    assert device.latency is not None
    for number in range(1, 91):
        device.advance(40.0)
        device.latency.idle(now_s=number / 40, left_s=0.02, missed=0)
    device.close()
    times = [t_ms for message, t_ms in sent if isinstance(message, LatencyReport)]
    assert times == [1000, 2000]  # a host that reads them sets its clock by them
