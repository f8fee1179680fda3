"""A phone as the virtual orb's skin: choice of the address, and the code to scan."""

from functools import lru_cache, partial

import pygame

from controller.shared.errors import UserError
from host.app.screen import Orb, OrbScreen, rows
from host.phone import code, open_phone, own_addresses
from tetris.kit.menu import Item, Menu
from tetris.kit.stage import Stage


class PhoneScreen(OrbScreen):
    """Shows the code of a phone's page, how the connection is, and what can be done."""

    def __init__(self, stage: Stage, orb: Orb) -> None:
        self._problem = ""
        super().__init__(stage, orb)

    def page(self) -> Menu:
        """Return the addresses to choose from, or the state of the phone."""
        words, phone, items = self.words, self.orb.phone, [self.back_item()]
        if phone is None:
            items[:0] = [Item(name, partial(self._start, name)) for name in own_addresses()]
            said = "choose" if items[1:] else "none"
        else:
            said = "connected" if phone.phone else "scan"
            items.append(self.item("phone.stop", self._stop))
        table = rows(words(f"phone.{said}"))
        if phone and phone.refused:
            table += rows(words("phone.refused"), marked=True)
        return Menu(words("phone.title"), items, table=table, notice=self._problem)

    def _start(self, address: str) -> None:
        try:
            self.orb.phone, self._problem = open_phone(address), ""
        except UserError:
            self._problem = self.words("phone.cannot")

    def _stop(self) -> None:
        if self.orb.phone:
            self.orb.phone.close()
        self.orb.phone = None

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the menu, and below it the code while it can be used."""
        super().draw(surface, time_s)
        if self.orb.phone and not self.orb.phone.phone:
            picture, area = _picture(self.orb.phone.url), self._stage.area
            room = area.height - max(spot.place.bottom for spot in self.spots)
            # A whole number of pixels a module: cameras read sharp edges.
            times = max(1, min(room, area.width) // picture.get_width())
            picture = pygame.transform.scale_by(picture, times)
            surface.blit(picture, picture.get_rect(center=(area.centerx, area.bottom - room // 2)))


@lru_cache(maxsize=1)
def _picture(url: str) -> pygame.Surface:
    modules = code(url).get_matrix()
    grey = bytes(0 if dark else 255 for row in modules for dark in row for _ in "rgb")
    return pygame.image.frombytes(grey, (len(modules), len(modules)), "RGB")
