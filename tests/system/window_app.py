"""`host`, printing what its window shows: a line of JSON at each change.

Names of a pad's buttons on standard input press those of a pad that is not there.
"""

import json
import sys
import threading
from collections.abc import Sequence
from typing import Any

import pygame

from controller.shared.protocol.messages import Command
from host.app import application
from host.app.application import OrbApp
from host.app.screens.learn import LearnScreen
from host.cli import play
from host.connection.receiver import Delivered, Received
from tetris.kit.bindings import BUTTONS
from tetris.window.menu_screen import MenuScreen
from tetris.window.play_screen import PlayScreen


def shown(app: "PrintingApp") -> dict[str, Any]:
    """Return what the window shows: the screen, its items with their places, the orb."""
    screen, orb = app.stage.screen, app.orb
    seen: dict[str, Any] = {
        "screen": type(screen).__name__, "title": "", "notice": "", "items": {}, "doors": [],
        "values": [], "table": [], "step": None,
        "link": orb.link, "ready": orb.ready, "labels": [], "selected": "",
        "gestures": app.gestures, "commands": app.commands,
        "size": pygame.display.get_window_size(),
    }  # fmt: skip
    if isinstance(screen, MenuScreen):
        menu = screen.menu
        selected = menu.items[screen.selected].label if menu.items else ""
        seen |= {"title": menu.title, "notice": menu.notice, "selected": selected}
        seen["labels"] = [item.label for item in menu.items]
        # What leads elsewhere when it is taken; items with a value only change that.
        seen["doors"] = [item.label for item in menu.items if item.do and not item.step]
        seen["values"] = [item.value for item in menu.items]
        seen["table"] = [list(row.cells) for row in menu.table]
        left, top = app.dock.game.topleft
        for spot in screen.spots:
            if spot.number < len(menu.items):
                place = spot.place.move(left, top)
                seen["items"][menu.items[spot.number].label] = [*place.topleft, *place.size]
    if isinstance(screen, LearnScreen) and screen.step is not None:
        pad, (x, y) = app.touch.pad, screen.step.place
        across, up = (x - pad.centre[0]) / pad.radius, (y - pad.centre[1]) / pad.radius
        seen["step"] = [screen.step.label, across, up]
    if isinstance(screen, PlayScreen):
        left, top = app.dock.game.topleft
        seen["pause"] = screen.button.move(left, top).center
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
        self.commands: list[str] = []  # theirs
        super().__init__(*arguments, **options)

    def tick(self, now_s: float, received: Sequence[Received] = ()) -> None:
        """Advance, and note the gestures."""
        for item in received:
            if isinstance(item, Delivered) and isinstance(item.message, Command):
                self.gestures.append(item.message.label)
                self.commands.append(item.message.name)
        super().tick(now_s, received)

    def draw(self, surface: pygame.Surface) -> None:
        """Draw, and print what has changed."""
        super().draw(surface)
        line = json.dumps(shown(self))
        if line != self._last:
            self._last = line
            print(line, flush=True)


def press_pad() -> None:
    """Press the buttons that standard input names, until it ends."""
    numbers = {name: number for number, name in BUTTONS.items()}
    for line in sys.stdin:
        for kind in (pygame.CONTROLLERBUTTONDOWN, pygame.CONTROLLERBUTTONUP):
            pygame.event.post(pygame.event.Event(kind, button=numbers[line.strip()], instance_id=9))


if __name__ == "__main__":
    threading.Thread(target=press_pad, daemon=True).start()
    application.OrbApp = PrintingApp  # type: ignore[misc]
    sys.exit(play.main(sys.argv[1:]))
