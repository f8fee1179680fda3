"""Pictures of every page of the application, in sizes, themes and languages.

    python -m tests.system.pictures DIR [--size 1280x720 ...] [--theme dark ...] [--language en ...]
        [--scale 100]

One sheet for each combination, DIR/1280x720-dark-en-100.png, with all pages that doors lead to, or
with --single a file a page. A virtual orb in a process of its own fills the panel; no display
is needed.
"""

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

os.environ["SDL_VIDEODRIVER"] = os.environ["SDL_AUDIODRIVER"] = "dummy"

from dataclasses import replace

import pygame

from controller.shared.protocol.messages import Contact, Contacts
from controller.shared.protocol.teaching import Describe, GestureInfo, Vocabulary
from host import window_loop
from host.app.application import OrbApp
from host.app.orbs import Orbs
from host.connection.device_store import DeviceStore
from host.connection.receiver import Delivered, Received, Receiver
from host.connection.virtual_orb import VirtualOrbProcess
from tetris.window.app import Start
from tetris.window.menu_screen import MenuScreen

from .walk import SHUT

SIZES: Final = ("1280x720", "960x720", "640x360", "720x1280")
THEMES: Final = ("dark", "light")
LANGUAGES: Final = ("en", "de", "fr")
SHEET: Final = 2400  # pixels of a sheet's width
_TOUCH: Final = (Contact(0, 0.8, 2.7, 9.0, 7.0),)
_HEAR_S, _TOUCH_S = 2.5, (1.6, 1.75)  # how long the orb is listened to; when it is touched
_FRAME_S: Final = 1 / 60
_FRAMES: Final = 70  # of a page before its picture
_MOST: Final = 80  # pages

Way = tuple[int, ...]  # numbers of the items taken, from the first page


def heard() -> list[Received]:
    """Return what a virtual orb sends in its first seconds, a press included."""
    orb = VirtualOrbProcess(1)
    receiver = Receiver(orb.open, token=orb.token)
    received: list[Received] = []
    receiver.start()
    try:
        begun_s = None
        while begun_s is None or time.monotonic() - begun_s < _HEAR_S:
            receiver.wait(0.02)
            items = receiver.poll()
            received += items
            if begun_s is None and items:
                begun_s = time.monotonic()
                receiver.send(Describe())
            passed_s = time.monotonic() - begun_s if begun_s else 0.0
            down = _TOUCH_S[0] < passed_s < _TOUCH_S[1]
            receiver.send(Contacts(_TOUCH if down else ()))
    finally:
        receiver.close()
        orb.close()
    return received


class Shelf(Orbs):
    """Orbs that are not looked for."""

    def __init__(self, receiver: Receiver) -> None:
        super().__init__(receiver, DeviceStore(), lambda: VirtualOrbProcess(1))

    def scan(self) -> None:
        """Find nothing."""


class Album:
    """The application in one size and look, and the pages it has shown; `look` is of `Settings`."""

    def __init__(
        self, size: tuple[int, int], look: Mapping[str, Any], orb: Sequence[Received]
    ) -> None:
        self._surface = window_loop.window(headless=True, size=size)
        self._look = {**look, "introduced": True}
        self._orb = orb
        self._described = [
            item
            for item in orb
            if isinstance(item, Delivered) and isinstance(item.message, GestureInfo | Vocabulary)
        ]
        self._unused = Receiver(VirtualOrbProcess(1).open)  # never started

    def pages(self) -> Iterator[tuple[str, pygame.Surface]]:
        """Yield each page's name and picture; breadth first, each once."""
        queue: list[Way] = [()]
        seen: set[tuple[str, str]] = set()
        while queue and len(seen) < _MOST:
            way = queue.pop(0)
            app = self._at(way)
            screen = app.stage.screen if app else None
            menu = screen.menu if isinstance(screen, MenuScreen) else None
            name = type(screen).__name__, menu.title if menu else ""
            if app is None or name in seen:
                continue
            seen.add(name)
            yield "-".join(name).lower().replace(" ", "-"), self._surface.copy()
            if menu:
                doors = enumerate(menu.items)
                queue += [(*way, n) for n, item in doors if item.do and not item.step]

    def _at(self, way: Way) -> OrbApp | None:
        """Return a fresh application at a page; None if the way closes it."""
        app = OrbApp(Start(), sound=False)
        app.stage.change(replace(app.stage.settings, **self._look))
        app.orbs = Shelf(self._unused)
        self._now_s = 0.0
        self._pass(app, self._orb)
        for number in way:
            screen = app.stage.screen
            assert isinstance(screen, MenuScreen)
            item = screen.menu.items[number]
            if item.label in SHUT or item.do is None:
                return None
            item.do()
            if app.stage.screen is None:
                return None
            self._pass(app, self._described)
        return app

    def _pass(self, app: OrbApp, received: Sequence[Received] = ()) -> None:
        """Let a second pass, and draw."""
        items = list(received)
        for _ in range(_FRAMES):
            app.tick(self._now_s, items)
            app.outgoing(self._now_s)
            items = []
            self._now_s += _FRAME_S
        app.draw(self._surface)


def sheet(pictures: Sequence[pygame.Surface]) -> pygame.Surface:
    """Return all pictures of one size on one surface, `SHEET` pixels wide."""
    width, height = pictures[0].get_size()
    across = max(1, round((len(pictures) * height / width) ** 0.5))
    small = SHEET // across, round(SHEET / across * height / width)
    down = -(-len(pictures) // across)
    page = pygame.Surface((SHEET, small[1] * down))
    for number, picture in enumerate(pictures):
        place = number % across * small[0], number // across * small[1]
        page.blit(pygame.transform.smoothscale(picture, small), place)
    return page


def main() -> int:
    """Save the pictures."""
    parser = argparse.ArgumentParser(prog="python -m tests.system.pictures", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", nargs="*", default=SIZES)
    parser.add_argument("--theme", nargs="*", default=THEMES)
    parser.add_argument("--language", nargs="*", default=LANGUAGES)
    parser.add_argument("--scale", type=int, default=100, help="size of letters, percent")
    parser.add_argument("--single", action="store_true", help="a file a page")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as home:
        os.environ.update(XDG_CONFIG_HOME=home, XDG_DATA_HOME=home)
        _save_all(options)
    return 0


def _save_all(options: argparse.Namespace) -> None:
    orb = heard()
    for size in options.size:
        width, height = map(int, size.split("x"))
        for theme in options.theme:
            for language in options.language:
                look = {"theme": theme, "language": language, "scale": options.scale}
                pages = dict(Album((width, height), look, orb).pages())
                stem = f"{size}-{theme}-{language}-{options.scale}"
                files = pages if options.single else {"": sheet(list(pages.values()))}
                for name, picture in files.items():
                    path = options.folder / f"{stem}{name and '-'}{name}.png"
                    pygame.image.save(picture, path)
                print(f"{stem}: {len(pages)} pages", flush=True)


if __name__ == "__main__":
    sys.exit(main())
