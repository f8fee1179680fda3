"""A phone as the virtual orb's skin: choice of the address, and the code to scan."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

import pygame

from controller.errors import UserError
from host.app.screen import Orb, OrbScreen, rows
from host.phone import open_phone, own_addresses
from tetris.window.menu import Item, Menu, Row
from tetris.window.screen_stack import ScreenStack

if TYPE_CHECKING:
    from host.phone.server import PhoneServer

_DARK: Final = (0, 0, 0)
_LIGHT: Final = (255, 255, 255)


class PhoneScreen(OrbScreen):
    """Shows the code of a phone's page, how the connection is, and what can be done."""

    def __init__(self, stage: ScreenStack, orb: Orb) -> None:
        """Show the page; nothing is served before an address has been chosen."""
        self._problem = ""
        self._addresses = own_addresses()
        self._code: tuple[str, pygame.Surface] | None = None  # of an address, a pixel a module
        super().__init__(stage, orb)

    def page(self) -> Menu:
        """Return the addresses to choose from, or the state of the phone."""
        words, phone = self._stage.look.words, self.orb.phone
        back = Item(words("menu.back"), self.leave)
        if phone is not None:
            items = [
                back,
                Item(words("phone.renew"), phone.renew, hint=words("phone.renew_hint")),
                Item(words("phone.stop"), self._stop),
            ]
            return Menu(words("phone.title"), items, table=self._state(phone))
        table = rows(words("phone.choose" if self._addresses else "phone.none"))
        items = [Item(address, partial(self._start, address)) for address in self._addresses]
        return Menu(words("phone.title"), [*items, back], table=table, notice=self._problem)

    def _start(self, address: str) -> None:
        try:
            self.orb.phone, self._problem = open_phone(address), ""
        except UserError as error:
            self._problem = str(error)

    def _stop(self) -> None:
        if self.orb.phone is not None:
            self.orb.phone.close()
        self.orb.phone = None

    def _state(self, phone: PhoneServer) -> list[Row]:
        words = self._stage.look.words
        if phone.connected:
            lines = rows(words("phone.connected"))
        else:
            lines = [*rows(words("phone.scan")), Row((phone.url,), quiet=True)]
        return lines + (rows(words("phone.refused"), marked=True) if phone.refused else [])

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the code above the menu, while it can be used."""
        phone = self.orb.phone
        if phone is None or phone.connected:
            super().draw(surface, time_s)
            return
        stage, unit = self._stage, self._stage.unit
        surface.fill(stage.look.palette.background)
        menu = stage.area.inflate(-round(24 * unit), -round(24 * unit))
        room = menu.copy()
        menu.height = min(menu.height // 2, self._view.height(self.menu, unit))
        menu.bottom = room.bottom
        self._view.draw(surface, menu, self.menu, self.selected, unit)
        room.height = menu.top - room.top
        code = self._picture(phone.url)
        # A whole number of pixels a module: cameras read sharp edges.
        size = code.get_width() * max(1, min(room.size) // code.get_width())
        surface.blit(
            pygame.transform.scale(code, (size, size)),
            pygame.Rect(0, 0, size, size).move(room.centerx - size // 2, room.centery - size // 2),
        )

    def _picture(self, url: str) -> pygame.Surface:
        """Return the code of an address, a pixel a module."""
        if self._code is None or self._code[0] != url:
            from host.phone import qr  # in here: an optional extra

            modules = qr.modules(url)
            picture = pygame.Surface((len(modules), len(modules)))
            for y, row in enumerate(modules):
                for x, dark in enumerate(row):
                    picture.set_at((x, y), _DARK if dark else _LIGHT)
            self._code = url, picture
        return self._code[1]
