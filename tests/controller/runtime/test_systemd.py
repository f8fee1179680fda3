"""The device as a service: what systemd is told, its unit, and the checks of Bluetooth."""

from __future__ import annotations

import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from controller.diagnostics import bluetooth
from controller.runtime.device import HOLD_S, LongPress
from controller.runtime.systemd import BEATS, WatchdogHeartbeat
from controller.shared.bluetooth.bluez import SERVICE_UUID, explain
from tests.support import ROOT

if sys.platform == "win32":
    pytest.skip("systemd is for Linux", allow_module_level=True)


@pytest.fixture
def systemd(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.settimeout(60.0)
        yield listener


def environment(systemd: socket.socket, **more: str) -> dict[str, str]:
    return {"NOTIFY_SOCKET": str(systemd.getsockname()), **more}


def heard(systemd: socket.socket) -> str:
    return systemd.recv(4096).decode()


def test_it_says_ready_its_state_once_in_one_line_and_stopping(systemd: socket.socket) -> None:
    heart = WatchdogHeartbeat(environment(systemd))
    heart.ready()
    for line in ("waiting", "waiting", "a host\nis there"):
        heart.status(line)
    heart.stopping()
    assert [heard(systemd) for _ in range(4)] == [
        "READY=1", "STATUS=waiting", "STATUS=a host is there", "STOPPING=1",
    ]  # fmt: skip


def test_it_beats_three_times_an_interval_however_often_called(systemd: socket.socket) -> None:
    now_s = 0.0
    heart = WatchdogHeartbeat(environment(systemd, WATCHDOG_USEC="9000000"), lambda: now_s)
    for tenth in range(91):
        now_s = tenth / 10
        heart.beat()
    systemd.setblocking(False)
    assert [heard(systemd) for _ in range(BEATS)] == ["WATCHDOG=1"] * BEATS
    with pytest.raises(BlockingIOError):
        heard(systemd)


def test_without_systemd_nothing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[object] = []
    monkeypatch.setattr(socket, "socket", lambda *kind: opened.append(kind))
    now_s = iter((0.0, 1.0, 1.0))
    heart = WatchdogHeartbeat({"WATCHDOG_USEC": "1"}, lambda: next(now_s))
    heart.ready()
    heart.beat()
    assert opened == []


def test_a_watchdog_for_another_process_is_none_of_ours(systemd: socket.socket) -> None:
    told = environment(systemd, WATCHDOG_USEC="1", WATCHDOG_PID="1")
    WatchdogHeartbeat(told, lambda: 0.0).beat()
    systemd.setblocking(False)
    with pytest.raises(BlockingIOError):
        heard(systemd)


def test_a_supervisor_that_has_gone_does_not_stop_the_orb(tmp_path: Path) -> None:
    WatchdogHeartbeat({"NOTIFY_SOCKET": str(tmp_path / "notify")}).ready()


def test_the_real_controller_is_ready_beats_tells_and_stops(systemd: socket.socket) -> None:
    command = [sys.executable, "-m", "controller", "--link", "listen://127.0.0.1:0"]
    surroundings = environment(systemd, WATCHDOG_USEC="30000", OMP_NUM_THREADS="1")
    process = subprocess.Popen(
        command, env=surroundings, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        assert heard(systemd) == "READY=1"
        told = {heard(systemd), heard(systemd)}
        while not any("STATUS=waiting for a host at socket://" in line for line in told):
            told.add(heard(systemd))
        while "WATCHDOG=1" not in told:
            told.add(heard(systemd))
        process.send_signal(signal.SIGTERM)
        while "STOPPING=1" not in told:
            told.add(heard(systemd))
        assert process.wait(30.0) == 0
    finally:
        process.kill()
        process.wait()


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="needs systemd")
def test_systemd_finds_no_fault_in_the_unit_and_little_that_it_exposes(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "service.md").read_text()
    unit = page.partition("```ini\n")[2].partition("```")[0]
    file = tmp_path / "orbtouch.service"
    file.write_text(unit.replace("/opt/orbtouch/bin/controller", "/bin/true"))
    verify = ["systemd-analyze", "verify", "--man=no", str(file)]
    done = subprocess.run(verify, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    security = ["systemd-analyze", "security", "--offline=yes", "--no-pager", str(file)]
    done = subprocess.run(security, capture_output=True, text=True, check=False)
    exposure = float(done.stdout.rsplit("exposure level", 1)[1].split()[2])
    assert exposure < 2.0  # of 10


def test_a_button_that_is_held_tells_once_and_again_after_it_was_let_go() -> None:
    button = LongPress()
    told = [button.step("" if t < 80 or t > 85 else "null", t / 10) for t in range(160)]
    assert [at / 10 for at, now in enumerate(told) if now] == [HOLD_S, 8.6 + HOLD_S]
    assert not any(LongPress().step(None, float(t)) for t in range(100))  # there is none


def test_errors_of_bluez_are_said_with_what_to_do() -> None:
    said = explain("org.bluez.Error.NotPermitted", "UUID already registered")
    assert "(UUID already registered)" in said
    assert explain("org.example.Strange", "as {it} is") == "as {it} is"


ADAPTER = {"Address": "00:11", "Alias": "OrbTouch", "Powered": True, "UUIDs": [SERVICE_UUID]}


def objects(**changes: object) -> dict[str, dict[str, dict[str, object]]]:
    return {"/org/bluez/hci0": {"org.bluez.Adapter1": {**ADAPTER, **changes}}}


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"Powered": False}, "off"),
        ({"UUIDs": []}, "no_service"),
        ({"Discoverable": True}, "no_bond"),
    ],
)
def test_each_adapter_problem_has_a_row_and_advice(changes: dict[str, object], code: str) -> None:
    found = {row.code: row for row in bluetooth.judge(objects(**changes)) if row.code}
    assert {code, "no_bond"} <= found.keys() <= {code, "no_bond", "no_service"}
    assert found[code].advice
