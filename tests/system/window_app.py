"""`host`, printing what its window shows: a line of JSON at each change."""

import json
import sys
from collections.abc import Sequence
from typing import Any

import pygame

from controller.protocol.messages import Command
from host.app.application import OrbApp
from host.cli import play
from host.connection.receiver import Delivered, Received
from tetris.window.screens.menu_screen import MenuScreen


def shown(app: "PrintingApp") -> dict[str, Any]:
    """Return what the window shows: the screen, its items with their places, the orb."""
    screen, orb = app.stage.screen, app.orb
    seen: dict[str, Any] = {
        "screen": type(screen).__name__, "title": "", "notice": "", "items": {}, "table": [],
        "link": orb.link, "ready": orb.ready, "labels": orb.labels,
        "gestures": app.gestures, "size": pygame.display.get_window_size(),
    }  # fmt: skip
    if isinstance(screen, MenuScreen):
        menu = screen.menu
        seen |= {"title": menu.title, "notice": menu.notice}
        seen["values"] = [item.value for item in menu.items]
        seen["table"] = [list(row.cells) for row in menu.table]
        left, top = app.dock.game.topleft
        for spot in screen.spots:
            if spot.number < len(menu.items):
                place = spot.place.move(left, top)
                seen["items"][menu.items[spot.number].label] = [*place.topleft, *place.size]
    game = app.game.game
    if game is not None:
        seen["game"] = [game.phase.name, game.pieces_placed]
    projection = app.panel.projection
    seen["dome"] = [*projection.centre, projection.pixels_per_unit * projection.pad.radius]
    return seen


class PrintingApp(OrbApp):
    """The application; it notes recognised gestures, and prints what it shows."""

    _last = ""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        """Begin without a gesture."""
        self.gestures: list[str] = []  # recognised since the start
        super().__init__(*arguments, **options)

    def tick(self, now_s: float, received: Sequence[Received] = ()) -> None:
        """Advance, and note the gestures."""
        for item in received:
            if isinstance(item, Delivered) and isinstance(item.message, Command):
                self.gestures.append(item.message.label)
        super().tick(now_s, received)

    def draw(self, surface: pygame.Surface) -> None:
        """Draw, and print what has changed."""
        super().draw(surface)
        line = json.dumps(shown(self))
        if line != self._last:
            self._last = line
            print(line, flush=True)


if __name__ == "__main__":
    play.OrbApp = PrintingApp  # type: ignore[misc]
    sys.exit(play.main(sys.argv[1:]))
