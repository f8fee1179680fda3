"""Pictures and films of the application for README and docs.

    python -m tests.system.docs_pictures

Writes docs/pictures/app-*.png, tetris-*.png, teach.gif, play.gif and traces.png in about six
minutes: a script moves the pointer, and a virtual orb in a process of its own feels it. No display
is needed; the films need Pillow, which `[train]` brings.
"""

import os
import sys
import tempfile
import time
import zlib
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

os.environ["SDL_VIDEODRIVER"] = os.environ["SDL_AUDIODRIVER"] = "dummy"

from dataclasses import replace

import pygame
from matplotlib.figure import Figure
from PIL import Image

import orbtouch
from host.app.application import OrbApp
from host.app.screens.watch import WatchScreen
from host.connection.latency import EndToEndLatency
from host.connection.receiver import Receiver
from host.connection.virtual_orb import VirtualOrbProcess
from host.targets import SIZE
from host.window_loop import window
from tests.benchmarks import tetris_pictures
from tetris.kit.theme import DARK
from tetris.window.app import Start
from tetris.window.menu_screen import MenuScreen
from tetris.window.play_screen import PlayScreen

from .desktop import arc
from .pictures import Shelf

ROOT: Final = Path(__file__).parents[2]
PICTURES: Final = ROOT / "docs" / "pictures"
FILM: Final = (800, 450)  # pixels
WIDE: Final = 960  # of the saved pictures, which keeps them small
COLOURS: Final = 256
RATE_HZ: Final = 10  # pictures a second
PLAY_S: Final = 14.0  # of the film of play, which ends soon after a cleared row
_STEP_S: Final = 1 / 60
_LONGEST_S: Final = 150.0  # until something is shown that must come
_POINTER: Final = ((0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (13, 12))  # pixels

ARC: Final = arc(120, 55)

Place = tuple[float, float]


class Camera:
    """The application in real time, a pointer, and the film of what is seen.

    Attributes:
        film: Its pictures, compressed; a full one loses its first.
        speed: How much faster than life the film is; 0 films nothing.
    """

    def __init__(self) -> None:
        """Begin with the title page; `run` lets time pass."""
        self._orb = VirtualOrbProcess(1)
        self._receiver = Receiver(self._orb.open, token=self._orb.token)
        hops = self._hops = EndToEndLatency(lambda: self._receiver.clock_offset_ms)
        self._receiver.subscribe(hops.on_received)
        self._receiver.start()
        self._surface = window(headless=True, size=FILM)
        self.app = OrbApp(Start(), sound=False)
        self.app.orb.latency = hops
        self.app.stage.change(replace(self.app.stage.settings, language="en"))
        self.app.orbs = Shelf(self._receiver)
        self._pointer = (FILM[0] * 0.6, FILM[1] * 0.9)
        self.film: deque[bytes] = deque()
        self.speed = 0.0
        self._began_s, self._due_s = time.monotonic(), 0.0

    def close(self) -> None:
        """End the orb."""
        self._receiver.close()
        self._orb.close()

    # -- time ------------------------------------------------------------------------------

    def run(self, seconds: float) -> None:
        """Let time pass."""
        until_s = time.monotonic() + seconds
        while time.monotonic() < until_s:
            self._step()

    def until(self, holds: Callable[[], bool]) -> None:
        """Let time pass until something holds."""
        until_s = time.monotonic() + _LONGEST_S
        while not holds():
            self._step()
            if time.monotonic() > until_s:
                raise TimeoutError(f"{type(self.app.stage.screen).__name__} shows nothing else")

    def at(self, screen: str) -> None:
        """Wait for a screen by its class."""
        self.until(lambda: type(self.app.stage.screen).__name__ == screen)

    def _step(self) -> None:
        now_s = time.monotonic() - self._began_s
        self.app.tick(now_s, self._receiver.poll())
        for message in self.app.outgoing(now_s):
            self._receiver.send(message)
        if now_s >= self._due_s:
            self._due_s = max(self._due_s, now_s - 1.0) + (self.speed or 1.0) / RATE_HZ
            self.app.draw(self._surface)
            self._hops.drawn()
            if self.speed:
                self.film.append(zlib.compress(self._seen(self._surface), 1))
        self._receiver.wait(_STEP_S)

    def home(self) -> None:
        """Go back to the title page; the link may have been silent while a film was saved."""
        self.run(2.0)
        self.app.stage.home()
        self.run(0.5)

    # -- the pointer -----------------------------------------------------------------------

    def choose(self, label: str) -> None:
        """Go to the item of a menu, and click it."""
        self.until(lambda: self._item(label) is not None)
        place = self._item(label)
        assert place
        self.go(place.left + place.width / 3, place.centery)
        self.run(0.15)
        self._event(pygame.MOUSEBUTTONDOWN, 1)
        self._event(pygame.MOUSEBUTTONUP, 1)
        self.run(0.5)

    def _item(self, label: str) -> pygame.Rect | None:
        screen = self.app.stage.screen
        if isinstance(screen, MenuScreen):
            for spot in screen.spots:
                items = screen.menu.items
                if spot.number < len(items) and items[spot.number].label == label:
                    return spot.place.move(self.app.dock.game.topleft)
        return None

    def go(self, x: float, y: float, seconds: float = 0.35) -> None:
        """Move the pointer."""
        (first_x, first_y), begun_s, share = self._pointer, time.monotonic(), 0.0
        while share < 1.0:
            share = min(1.0, (time.monotonic() - begun_s) / seconds)
            eased = share * share * (3 - 2 * share)
            self._pointer = first_x + eased * (x - first_x), first_y + eased * (y - first_y)
            self._event(pygame.MOUSEMOTION)
            self._step()

    def stroke(self, path: Sequence[Place], seconds: float, button: int = 1) -> None:
        """Drag along a path on the dome, shares of its radius right and up."""
        self.go(*self.on_dome(path[0]))
        self.press(button)
        for place in path[1:]:
            self.go(*self.on_dome(place), seconds / (len(path) - 1))
        self.lift(button)

    def press(self, button: int = 1) -> None:
        """Hold the mouse's button down."""
        self._event(pygame.MOUSEBUTTONDOWN, button)

    def lift(self, button: int = 1) -> None:
        """Let the mouse's button come up."""
        self._event(pygame.MOUSEBUTTONUP, button)

    def on_dome(self, place: Place) -> Place:
        """Return the pixels of a place on the dome."""
        projection = self.app.panel.projection
        radius = projection.pixels_per_unit * projection.pad.radius
        (centre_x, centre_y), (x, y) = projection.centre, place
        return centre_x + radius * x, centre_y - radius * y

    def _event(self, kind: int, button: int = 0) -> None:
        place = round(self._pointer[0]), round(self._pointer[1])
        event = pygame.event.Event(kind, pos=place, button=button, rel=(0, 0), buttons=(0, 0, 0))
        self.app.handle(event, time.monotonic() - self._began_s)

    # -- what is saved ---------------------------------------------------------------------

    def _seen(self, surface: pygame.Surface) -> bytes:
        """Return a picture of the window with the pointer, RGB."""
        picture = surface.copy()
        places = [(self._pointer[0] + x, self._pointer[1] + y) for x, y in _POINTER]
        pygame.draw.polygon(picture, "white", places)
        pygame.draw.aalines(picture, "black", True, places)
        return pygame.image.tobytes(picture, "RGB")

    def save(self, path: Path) -> None:
        """Save a picture of the window in its first size, in few colours."""
        surface = pygame.Surface(SIZE)
        self.app.draw(surface)
        self.app.draw(surface)  # pages learn their size by the first one
        small = pygame.transform.smoothscale(surface, (WIDE, WIDE * SIZE[1] // SIZE[0]))
        pixels = Image.frombytes("RGB", small.size, pygame.image.tobytes(small, "RGB"))
        few = pixels.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=4)
        few.save(path, optimize=True)
        print(path.name, flush=True)
        self.app.draw(self._surface)

    def save_film(self, path: Path) -> None:
        """Save the film, and begin another one."""
        pictures = [Image.frombytes("RGB", FILM, zlib.decompress(one)) for one in self.film]
        sample = [*pictures[:: len(pictures) // 9], Image.frombytes("RGB", FILM, _swatch())]
        strip = Image.new("RGB", (FILM[0], FILM[1] * len(sample)))
        for number, picture in enumerate(sample):
            strip.paste(picture, (0, FILM[1] * number))
        palette = strip.quantize(COLOURS)  # one for the whole film
        first, *rest = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
        first.save(path, save_all=True, append_images=rest, duration=1000 // RATE_HZ, loop=0)
        print(f"{path.name}: {len(self.film)} pictures, {path.stat().st_size / 1e6:.1f} MB")
        self.film, self.speed = deque(), 0.0


def _swatch() -> bytes:
    """Return a picture with the pieces' colours, so that a film's palette has them."""
    picture = pygame.Surface(FILM)
    colours = [*DARK.pieces[:-1], DARK.good, DARK.accent]
    for number, colour in enumerate(colours):
        picture.fill(colour, (number * FILM[0] // len(colours), 0, FILM[0], FILM[1]))
    return pygame.image.tobytes(picture, "RGB")


def swipe(camera: Camera, number: int) -> None:
    """Swipe from left to right, each time a little differently."""
    height, reach = 0.1 * (number % 3 - 1), 0.45 + 0.05 * (number % 2)
    path = [(reach * (k / 3 - 1), height + 0.04 * k) for k in range(7)]
    camera.stroke(path, 0.32 + 0.05 * (number % 3))
    camera.run(0.75)


def teach(camera: Camera) -> None:
    """Film how a gesture is taught, tried and used."""
    camera.home()
    camera.speed = 1.8
    for item in ("Teach", "New gesture…", "swipe"):
        camera.choose(item)
    for number in range(1, 6):
        swipe(camera, number)
        if camera._item("Keep it"):  # once: a swipe begins as a press does
            camera.choose("Keep it")
        if number == 4:
            camera.run(0.5)
            camera.save(PICTURES / "app-examples.png")
    camera.choose("Learn")
    camera.speed = 4.0
    camera.until(lambda: camera._item("End the trial") is not None)
    camera.speed = 1.8
    for number in range(1, 6):
        swipe(camera, number)
    camera.run(1.0)
    camera.save(PICTURES / "app-try.png")
    camera.choose("Play with it")
    camera.run(1.5)
    for number in range(2):
        swipe(camera, number)
    camera.run(1.0)
    camera.save_film(PICTURES / "teach.gif")


def pages(camera: Camera) -> None:
    """Save other pages of the application."""
    camera.home()
    for way, name in (
        (("Teach",), "gestures"), (("Learn",), "learn"), (("Orb",), "orbs"),
        (("Orb", "This orb"), "this-orb"), (("Orb", "Control other programs"), "programs"),
    ):  # fmt: skip
        for item in way:
            camera.choose(item)
        camera.run(2.6)  # a gesture is shown on the dome
        camera.save(PICTURES / f"app-{name}.png")
        camera.home()


def lab(camera: Camera) -> None:
    """Save the lab after some gestures."""
    camera.choose("Orb")
    camera.choose("Lab")
    for path in ([(-0.5, 0.1)] * 2, [(0.5, 0.3)] * 2, ARC):
        camera.stroke(path, 0.4)
        camera.run(1.2)
    camera.save(PICTURES / "app-lab.png")
    camera.choose("Back")
    camera.choose("Back")


def play(camera: Camera) -> None:
    """Film the orb's own hand until it has cleared a row, and go on in its place."""
    camera.until(lambda: camera.app.orb.link == "live" and camera.app.orb.ready)
    camera.save(PICTURES / "app-title.png")
    camera.film, camera.speed = deque(maxlen=round(PLAY_S * RATE_HZ)), 1.0
    camera.choose("Watch")
    screen = camera.app.stage.screen
    assert isinstance(screen, WatchScreen)
    camera.until(lambda: screen.game.lines > 0)
    camera.run(2.5)
    camera.save(PICTURES / "app-watch.png")
    camera.save_film(PICTURES / "play.gif")
    camera.go(*camera.on_dome((-0.5, 0.1)))
    for seconds in (0.2, 0.5):  # the first press takes over, the second one plays
        camera.press()
        camera.run(seconds)
        if seconds == 0.5:
            camera.save(PICTURES / "app-press.png")
        camera.lift()
        camera.run(2.0)
    assert isinstance(camera.app.stage.screen, PlayScreen)


def traces() -> None:
    """Save the plot of ten seconds of a recording, as docs/researcher.md shows it."""
    session = orbtouch.simulate(minutes=1, seed=1)
    figure = Figure(figsize=(9, 3), layout="constrained")
    session[5.0:15.0].plot(figure.add_subplot())
    figure.savefig(PICTURES / "traces.png", dpi=90)
    print("traces.png")


def main() -> int:
    """Save all."""
    traces()
    tetris_pictures.take_all(PICTURES)
    with tempfile.TemporaryDirectory() as home:
        os.environ.update(XDG_CONFIG_HOME=home, XDG_DATA_HOME=home)
        camera = Camera()
        try:
            play(camera)
            teach(camera)
            pages(camera)
            lab(camera)
        finally:
            camera.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
