"""A phone as the virtual orb's skin, in the window: its page there, and its fingers on the dome."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pygame
import pytest
from websockets.sync.client import ClientConnection

import host.phone
from controller.shared.errors import UserError
from controller.shared.protocol.messages import Contacts
from host.app.screens import phone as screen
from host.connection.receiver import Lost
from tests.support.app_window import FELT, WELCOME, Window
from tests.support.phone_tab import join, opened
from tests.support.waiting import until

ONE_FINGER = "[[4, 0.5, 0, 0, 0.5]]"


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> Iterator[Window]:
    """A window on this page, on a machine whose only address is that of the loopback."""
    monkeypatch.setattr(screen, "own_addresses", lambda: ["127.0.0.1"])
    monkeypatch.setattr(screen, "open_phone", lambda words: host.phone.open_phone(f"{words}:0"))
    made = Window()
    made.app.show_phone()
    yield made
    if made.app.phone is not None:
        made.app.phone.close()


def labels(window: Window) -> list[str]:
    return [item.label for item in page(window).menu.items]


def said(window: Window) -> str:
    return " ".join(row.cells[0] for row in page(window).menu.table)


def page(window: Window) -> screen.PhoneScreen:
    shown = window.app.stage.screen
    assert isinstance(shown, screen.PhoneScreen)
    return shown


def take(window: Window, label: str) -> None:
    item = next(item for item in page(window).menu.items if item.label == label)
    assert item.do is not None
    item.do()
    window.pass_s(0.1, FELT)
    window.contacts()  # shows the phone a view, too


def tab_of(window: Window) -> AbstractContextManager[ClientConnection]:
    assert window.app.phone is not None
    return opened(window.app.phone.url)


def begin(window: Window, tab: ClientConnection) -> dict[str, Any]:
    view = join(tab)
    window.pass_s(0.1, FELT)
    return view


def on_dome(window: Window, fingers: int) -> Contacts:
    """Wait for a number of contacts on the way to the orb."""

    def sent() -> Contacts | None:
        window.pass_s(0.1, FELT)
        found = [one for one in window.contacts() if len(one.contacts) == fingers]
        return found[-1] if found else None

    contacts: Contacts = until(sent)
    return contacts


def test_an_address_is_chosen_and_its_code_is_shown_until_a_phone_is_there(window: Window) -> None:
    assert labels(window) == ["127.0.0.1", "Back"]
    take(window, "127.0.0.1")
    assert "Scan the code" in said(window)
    blank = window.surface.copy()
    window.app.draw(window.surface)
    with tab_of(window) as tab:
        begin(window, tab)
        assert "A phone is connected" in said(window)
        window.app.draw(window.surface)
        assert pygame.image.tobytes(blank, "RGB") != pygame.image.tobytes(window.surface, "RGB")
        with tab_of(window) as second:
            second.send('""')
            until(lambda: window.app.phone and window.app.phone.refused)
    window.pass_s(0.1, FELT)
    assert "Another phone was refused" in said(window)


def test_fingers_on_the_phone_are_contacts_on_the_orb_and_end_with_it(window: Window) -> None:
    take(window, "127.0.0.1")
    with tab_of(window) as tab:
        assert begin(window, tab)["status"].startswith("Touch the dome")
        tab.send(ONE_FINGER)
        (finger,) = on_dome(window, 1).contacts
        assert (finger.x, finger.y) == pytest.approx((2 + 0.5 * 3.8, 2))
        assert window.app.state.contacts == (finger,)
    on_dome(window, 0)


def test_fingers_are_lifted_while_the_link_to_the_orb_is_lost(window: Window) -> None:
    take(window, "127.0.0.1")
    with tab_of(window) as tab:
        begin(window, tab)
        tab.send(ONE_FINGER)
        on_dome(window, 1)
        window.pass_s(0.1, Lost("the cable is out"))
        assert window.contacts() == []
        assert window.app.state.contacts == ()


def test_the_phone_speaks_the_language_of_the_window(window: Window) -> None:
    take(window, "127.0.0.1")
    stage = window.app.stage
    stage.change(replace(stage.settings, language="fr"))
    window.pass_s(0.1, FELT)
    window.contacts()
    with tab_of(window) as tab:
        assert begin(window, tab)["status"].startswith("Touchez le dôme")


def test_switched_off_the_page_is_gone(window: Window) -> None:
    take(window, "127.0.0.1")
    with tab_of(window) as tab:
        begin(window, tab)
        take(window, "Switch off")
        assert window.app.phone is None
        assert labels(window) == ["127.0.0.1", "Back"]


def test_a_trouble_is_told_on_the_page(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(words: str) -> None:
        raise UserError(f"{words} is taken")

    monkeypatch.setattr(screen, "open_phone", refuse)
    take(window, "127.0.0.1")
    assert "the port is taken" in page(window).menu.notice
    assert window.app.phone is None


def test_without_a_network_there_is_nothing_to_choose(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(screen, "own_addresses", list[str])
    alone = Window(welcome=WELCOME)
    alone.app.show_phone()
    assert labels(alone) == ["Back"]
    assert "is in no network" in said(alone)


@pytest.mark.system
@pytest.mark.skipif(shutil.which("zbarimg") is None, reason="needs zbarimg")
@pytest.mark.parametrize("size", [(1280, 720), (720, 1280), (640, 480)])
def test_the_code_is_read_from_the_picture_of_the_window(
    window: Window, size: tuple[int, int], tmp_path: Path
) -> None:
    take(window, "127.0.0.1")
    assert window.app.phone is not None
    window.surface = pygame.Surface(size)
    window.pass_s(0.1, FELT)
    picture = tmp_path / "window.png"
    pygame.image.save(window.surface, picture)
    found = subprocess.run(
        ["zbarimg", "--nodbus", "-q", "--raw", picture], capture_output=True, text=True, check=False
    )
    assert found.stdout.strip() == window.app.phone.url
