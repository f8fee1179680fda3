"""The list of orbs, the change from one to another, and what runs on threads."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from host.app.orbs import OWN, Orbs
from host.connection import discovery
from host.connection.device_store import DeviceStore, KnownDevice
from host.connection.discovery import NOW, Answer, DevicePort
from host.connection.receiver import Receiver, Refused
from host.connection.transport import Transport
from host.connection.virtual_orb import VirtualOrbProcess
from tests.support.app_window import Window

PATIENCE_S = 20.0
BLUE = Answer("/dev/ttyACM1", "orb", "", "orb-2", "Blue", False)


class Link(Receiver):
    """Keeps what it is asked for."""

    def __init__(self) -> None:
        self.opened: list[Callable[[], Transport]] = []
        self.tokens: list[str] = []

    def reopen(
        self, open_transport: Callable[[], Transport], *, token: str = "", key: bytes = b""
    ) -> None:
        self.opened.append(open_transport)
        self.tokens.append(token)


@pytest.fixture
def memory(tmp_path: Path) -> DeviceStore:
    store = DeviceStore(tmp_path / "devices.toml")
    store.remember("orb-1", name="Red", port="/dev/ttyACM0", seen="2026-01-02T00:00:00Z")
    return store


@pytest.fixture
def link() -> Link:
    return Link()


@pytest.fixture
def orbs(link: Link, memory: DeviceStore) -> Iterator[Orbs]:
    made = Orbs(link, memory, lambda: VirtualOrbProcess(1, command=("true",)))
    yield made
    made.close()


def test_list_has_our_own_orb_the_found_ones_and_the_remembered_ones(
    orbs: Orbs, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert [entry.device_id for entry in orbs.entries()] == ["", "orb-1"]
    monkeypatch.setattr(discovery, "candidates", lambda memory: {BLUE.url: ""})
    go_on = threading.Event()

    def ask(url: str, key: str) -> Answer:
        go_on.wait(PATIENCE_S)
        return BLUE

    monkeypatch.setattr(discovery, "ask", ask)
    orbs.scan()
    orbs.tick()  # does not wait for the answer
    assert orbs.scanning
    go_on.set()
    while orbs.scanning:
        orbs.tick()
    assert [(entry.device_id, entry.seen == NOW) for entry in orbs.entries()] == [
        ("", True), ("orb-2", True), ("orb-1", False),
    ]  # fmt: skip


def test_port_that_is_open_is_not_opened_a_second_time(
    link: Link, memory: DeviceStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []
    found = {"/dev/ttyACM0": "", BLUE.url: ""}
    monkeypatch.setattr(discovery, "candidates", lambda memory: found)

    def ask(url: str, key: str) -> Answer:
        asked.append(url)
        return BLUE

    monkeypatch.setattr(discovery, "ask", ask)
    orbs = Orbs(link, memory, lambda: VirtualOrbProcess(1), where=lambda: "/dev/ttyACM0")
    orbs.scan()
    while orbs.scanning:
        orbs.tick()
    assert asked == [BLUE.url]


def test_chosen_orb_is_connected_by_its_port_and_ours_is_started_again(
    link: Link, memory: DeviceStore
) -> None:
    moved: list[tuple[str, str]] = []

    def note(port: DevicePort | None, key: str) -> None:
        moved.append((port.url if port else "own", key))

    orbs = Orbs(link, memory, lambda: VirtualOrbProcess(1, command=("true",)), moved=note)
    red = orbs.entries()[1]
    assert orbs.present(OWN, "")
    orbs.choose(red)
    assert orbs.present(red, "")
    assert not orbs.present(OWN, "")
    orbs.choose(OWN)
    assert moved == [("/dev/ttyACM0", ""), ("own", "")]
    assert [bool(token) for token in link.tokens] == [False, True]
    orbs.close()


def test_key_that_cannot_be_read_changes_nothing_and_is_said(orbs: Orbs, link: Link) -> None:
    orbs.choose(KnownDevice("orb-3", port="/dev/ttyACM3", key="/nowhere/key"))
    assert "/nowhere/key" in orbs.notice
    assert link.opened == []


def test_an_english_sentence_is_led_to_in_another_language_and_stands_under_details() -> None:
    window = Window(welcome=None)
    window.app.orbs = Orbs(Link(), DeviceStore(), lambda: VirtualOrbProcess(1))
    stage = window.app.stage
    stage.change(replace(stage.settings, language="de"))
    refused = "ttyACM0: this link does not prove whose it is"
    window.pass_s(0.1, Refused(refused))
    window.app._orb_items(stage)[0].do()  # type: ignore[misc]
    window.pass_s(0.1)
    shown = [row.cells[0] for row in window.app.stage.screen.menu.table]  # type: ignore[union-attr]
    assert " ".join(shown) == window.app.words("orb.trouble")
    for label in ("Dieser Orb", "Einzelheiten"):
        screen = window.app.stage.screen
        next(item for item in screen.menu.items if item.label == label).do()  # type: ignore
        window.pass_s(0.1)
    table = window.app.stage.screen.menu.table  # type: ignore[union-attr]
    assert refused in " ".join(row.cells[0] for row in table)
