"""The store of known devices: a file that nothing can spoil for good."""

import stat
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from host.connection.device_store import MOST, DeviceStore, KnownDevice
from tests.support import special_files


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "config" / "devices.toml"


def test_what_is_remembered_is_there_the_next_time(path: Path) -> None:
    DeviceStore(path).remember(
        "orb-1", name="Orb", port="/dev/ttyACM0", seen="2026-11-21T08:00:00Z"
    )
    DeviceStore(path).remember(
        "orb-1", target="keyboard", keys="/home/me/mine.toml", profile="slides"
    )
    assert DeviceStore(path).devices == [
        KnownDevice(
            *("orb-1", "Orb", False, "/dev/ttyACM0", "2026-11-21T08:00:00Z"),
            *("keyboard", "/home/me/mine.toml", "slides"),
        )
    ]


def test_device_is_found_by_identity_before_name(path: Path) -> None:
    memory = DeviceStore(path)
    memory.remember("orb-1", name="orb-2", seen="1")
    memory.remember("orb-2", name="Orb", seen="2")
    memory.remember("orb-3", name="Orb", seen="3")
    assert [known.device_id for known in memory.named("orb-2")] == ["orb-2"]
    assert [known.device_id for known in memory.named("Orb")] == ["orb-3", "orb-2"]
    assert memory.named("nobody") == []


def test_what_another_program_noted_meanwhile_stays(path: Path) -> None:
    ours, theirs = DeviceStore(path), DeviceStore(path)
    ours.remember("orb-1", port="A")
    theirs.remember("orb-2", port="B")
    ours.remember("orb-1", port="C")
    assert {k.device_id: k.port for k in DeviceStore(path).devices} == {"orb-1": "C", "orb-2": "B"}


def test_only_the_latest_devices_are_kept(path: Path) -> None:
    memory = DeviceStore(path)
    for number in range(MOST + 3):
        memory.remember(f"virtual-{number}", seen=f"{number:04d}")
    names = [known.device_id for known in DeviceStore(path).devices]
    assert len(names) == MOST
    assert names[0] == f"virtual-{MOST + 2}"
    assert "virtual-2" not in names


@pytest.mark.parametrize(
    "content",
    [
        *(b"[device", b"device = 3", b"device.a = 3", b"\xff\xfe", b"a = [" * 10_000),
        *(b"[device.a]\nport = 3", b'[device.a]\nvirtual = "yes"'),
    ],
)
def test_damaged_file_is_put_aside_and_told_of(path: Path, content: bytes) -> None:
    path.parent.mkdir()
    path.write_bytes(content)
    told: list[str] = []
    memory = DeviceStore(path, told.append)
    assert memory.devices == []
    assert "is damaged" in told[0]
    assert told[0].endswith("was put aside as devices-damaged-1.toml")
    memory.remember("orb-1", port="A")
    assert [known.port for known in DeviceStore(path).devices] == ["A"]
    assert path.with_name("devices-damaged-1.toml").read_bytes() == content


def test_a_folder_that_is_a_file_is_named_and_nothing_said_to_be_put_aside(tmp_path: Path) -> None:
    folder = tmp_path / ".config"
    folder.write_text("no folder")
    told: list[str] = []
    memory = DeviceStore(folder / "orbtouch" / "devices.toml", told.append)
    memory.remember("orb-1", port="A")
    assert len(told) == 3  # at the start, and where it is read again and written
    assert all("devices.toml" in words and "put aside" not in words for words in told)


def test_a_damaged_file_leaves_an_earlier_one_where_it_is(path: Path) -> None:
    path.with_name("devices-damaged-1.toml").mkdir(parents=True)
    path.write_text("[device")
    told: list[str] = []
    assert DeviceStore(path, told.append).devices == []
    assert told[0].endswith("was put aside as devices-damaged-2.toml")
    assert path.with_name("devices-damaged-2.toml").read_text() == "[device"


@pytest.mark.skipif(sys.platform != "linux", reason="special files of Linux")
@pytest.mark.parametrize("kind", special_files.KINDS)
def test_special_file_in_its_place_costs_a_sentence(kind: str, tmp_path: Path) -> None:
    path = special_files.make(kind, tmp_path, "devices.toml")
    told: list[str] = []

    def read(words: list[str]) -> int:
        return len(DeviceStore(path, told.append).devices)

    assert special_files.answer(read, []).status == 0
    if kind != "locked":  # which only root may read
        assert len(told) == (kind not in ("missing", "empty", "dangling"))
    assert "\n" not in "".join(told)


def test_file_is_its_owner_s_alone(path: Path) -> None:
    DeviceStore(path).remember("orb-1", key="/home/me/orb.key")
    assert path.stat().st_mode & 0o077 == 0 or sys.platform == "win32"


text = st.text(st.characters(codec="utf-8"), max_size=20)


@settings(deadline=None, max_examples=50)
@given(text, text, text, st.booleans())
def test_any_identity_and_any_name_is_read_as_it_was_written(
    tmp_path_factory: pytest.TempPathFactory, device_id: str, name: str, port: str, virtual: bool
) -> None:
    path = tmp_path_factory.mktemp("settings") / "devices.toml"
    known = KnownDevice(device_id, name, virtual, port, "1")
    memory = DeviceStore(path, pytest.fail)
    memory.remember(device_id, name=name, virtual=virtual, port=port, seen="1")
    assert DeviceStore(path, pytest.fail).devices == [known]
    assert stat.S_ISREG(path.stat().st_mode)
