"""The pairing of an orb, and what discovery and doctor make of it, against a fake BlueZ."""

from __future__ import annotations

import threading

import pytest

from tests.support.fake_bluez import MOCK, FakeBluez, bus, fake, missing, until

__all__ = ["bus", "fake"]

if missing():
    pytest.skip(f"needs {missing()}", allow_module_level=True)


from controller.__main__ import main as controller
from controller.cli import pair
from controller.diagnostics import bluetooth
from controller.diagnostics.report import Verdict
from controller.shared.bluetooth.bluez import ADAPTER, DEVICE
from host.connection import discovery

ORB = "00:AA:01:01:00:01"


def test_the_orb_says_who_paired(fake: FakeBluez, capsys: pytest.CaptureFixture[str]) -> None:
    def stranger() -> None:
        until(lambda: fake.get("/org/bluez/hci0", ADAPTER, "Discoverable"))
        fake.call("/", MOCK, "AddDevice", "sss", "hci0", "AA:BB:CC:DD:EE:FF", "tablet")
        fake.pair("AA:BB:CC:DD:EE:FF")

    thread = threading.Thread(target=stranger)
    thread.start()
    assert pair.main(["--yes"]) == 0
    thread.join()
    told = capsys.readouterr().out
    assert "look for OrbTouch (00:01:02:03:04:05)" in told
    assert "paired with tablet (AA:BB:CC:DD:EE:FF)" in told
    assert fake.get("/org/bluez/hci0/dev_AA_BB_CC_DD_EE_FF", DEVICE, "Trusted")
    assert not fake.get("/org/bluez/hci0", ADAPTER, "Discoverable")  # shut behind it


def test_the_orb_gives_up_in_time(
    fake: FakeBluez, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pair, "PAIRING_S", 1)
    assert pair.main(["--yes"]) == 1
    assert "no host paired" in capsys.readouterr().out
    assert not fake.get("/org/bluez/hci0", ADAPTER, "Pairable")


def test_bluetoothd_must_be_running(fake: FakeBluez, capsys: pytest.CaptureFixture[str]) -> None:
    fake.stop()
    assert controller(["pair", "--yes"]) == 1
    assert "systemctl enable --now bluetooth" in capsys.readouterr().err


def test_host_find_lists_paired_orbs_and_no_others(fake: FakeBluez) -> None:
    fake.call("/", MOCK, "AddDevice", "sss", "hci0", ORB, "OrbTouch")
    assert discovery.paired() == []
    fake.pair(ORB)
    assert discovery.paired() == [f"rfcomm://{ORB}"]
    fake.stop()
    assert discovery.paired() == []


def test_the_doctor_sees_what_is_missing_and_what_to_do(fake: FakeBluez) -> None:
    found = {row.code: row for row in bluetooth.rows() if row.code}
    assert set(found) <= {"no_service", "not_trusted"}
    assert found["no_service"].advice.startswith("start it: sudo systemctl start orbtouch")
    fake.ask(lambda bus: bus.set("/org/bluez/hci0", ADAPTER, "Powered", "b", False))
    (off,) = [row for row in bluetooth.rows() if row.code == "off"]
    assert off.advice.endswith("bluetoothctl power on")
    fake.unplug()
    (row,) = bluetooth.rows()
    assert (row.found, row.code) == ("there is no Bluetooth adapter", "no_bluez")
    fake.stop()
    (row,) = bluetooth.rows()
    assert row.verdict is Verdict.FAULT
    assert row.advice == "sudo systemctl enable --now bluetooth"
