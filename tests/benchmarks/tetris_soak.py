"""An hour of the real window under random hands: nothing may break, and memory stays flat.

    xvfb-run -s "-screen 0 1400x900x24" python -m tests.benchmarks.tetris_soak [--minutes N]

Keys, pad buttons and the mouse are pressed at random, pads are plugged in and out (SDL's own
virtual ones), the window is resized, loses the focus, fills the screen; audio devices go. Time
is the program's own: an hour of game time passes as fast as it can be drawn. Memory goes up and
down with the window's size, so `growth_mb` is the median of the last sixth against that of the
second; `frames` says how many pictures were drawn.
"""

import contextlib
import ctypes
import gc
import importlib
import os
import random
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Final

os.environ.setdefault("SDL_AUDIODRIVER", "dummy")
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
# A software OpenGL, where SDL would show the picture through it, keeps some memory at each resize;
# a window that is resized 300 times by pygame alone grows by 20 MB with it, and not at all without.
os.environ.setdefault("SDL_FRAMEBUFFER_ACCELERATION", "0")

import pygame

from tests.support.processes import memory_mib
from tetris.kit.display import open_window, set_size
from tetris.kit.menu import OF_CODE
from tetris.window.app import App, Start

from .results import Results, command_line

FRAMES_HZ: Final = 20
SAMPLES: Final = 120  # of memory
FLIP_EVERY: Final = 4  # frames: handing pictures to a display server is most of the time
SIZES: Final = ((640, 480), (1280, 720), (1120, 720), (300, 700), (1390, 880), (200, 120))
_KEYS: Final = [
    *(pygame.K_LEFT, pygame.K_RIGHT, pygame.K_DOWN, pygame.K_UP, pygame.K_SPACE) * 6,
    *(code for code in OF_CODE if isinstance(code, int)),
    *(pygame.K_z, pygame.K_c, pygame.K_p, pygame.K_r, pygame.K_u, pygame.K_h, pygame.K_x),
]
_GAME_PAD: Final = 1  # SDL_JOYSTICK_TYPE_GAMECONTROLLER
_AXES, _BUTTONS = 6, 15


class VirtualPads:
    """Game pads that SDL itself makes up, plugged in and out like real ones."""

    def __init__(self) -> None:
        folder = Path(pygame.__file__).parent.parent / "pygame_ce.libs"
        libraries = sorted(folder.glob("libSDL2-2*"))
        self._sdl = ctypes.CDLL(str(libraries[0])) if libraries else None
        self._open: list[int] = []
        if self._sdl:
            self._sdl.SDL_JoystickOpen.restype = ctypes.c_void_p

    def disturb(self, chance: random.Random) -> None:
        """Plug one in, pull one out, or press something on one."""
        sdl = self._sdl
        if sdl is None:
            return
        what = chance.random()
        if what < 0.02 and len(self._open) < 3:
            index = sdl.SDL_JoystickAttachVirtual(_GAME_PAD, _AXES, _BUTTONS, 1)
            if index >= 0:
                self._open.append(sdl.SDL_JoystickOpen(index))
        elif what < 0.035 and self._open:
            self._open.pop(0)
            sdl.SDL_JoystickDetachVirtual(0)
        elif self._open:
            pad = ctypes.c_void_p(chance.choice(self._open))
            if chance.random() < 0.3:
                value = ctypes.c_int16(chance.choice((-32000, 0, 32000)))
                sdl.SDL_JoystickSetVirtualAxis(pad, chance.randrange(_AXES), value)
            else:
                number = chance.randrange(_BUTTONS)
                sdl.SDL_JoystickSetVirtualButton(pad, number, chance.random() < 0.5)


def load_libraries() -> None:
    """Load what the window loads with its first film, 10 to 30 MB, so that it is not growth."""
    for name in ("PIL.Image", "PIL.GifImagePlugin", "av"):
        with contextlib.suppress(ImportError):
            importlib.import_module(name)


def disturb(chance: random.Random, pads: VirtualPads) -> None:
    """Do one thing that a player, or the world, might do."""
    what = chance.random()
    if what < 0.55:
        kind = pygame.KEYDOWN if chance.random() < 0.6 else pygame.KEYUP
        pygame.event.post(pygame.event.Event(kind, key=chance.choice(_KEYS)))
    elif what < 0.85:
        pads.disturb(chance)
    elif what < 0.96:
        width, height = pygame.display.get_window_size()
        at = chance.randrange(max(1, width)), chance.randrange(max(1, height))
        kind = chance.choice((pygame.MOUSEMOTION, pygame.MOUSEBUTTONDOWN, pygame.MOUSEWHEEL))
        step = chance.choice((-1, 1))
        pygame.event.post(
            pygame.event.Event(kind, pos=at, button=1, buttons=(0, 0, 0), y=step, x=0)
        )
    elif what < 0.975:
        pygame.event.post(pygame.event.Event(pygame.WINDOWFOCUSLOST))
    elif what < 0.985:
        pygame.event.post(pygame.event.Event(pygame.AUDIODEVICEREMOVED, which=1, iscapture=0))
    elif what < 0.99:
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_F11))
    elif not pygame.display.is_fullscreen():
        size = chance.choice(SIZES)
        set_size(size)
        pygame.event.post(pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))


def resident_mb() -> float:
    """Return how much memory is in use, without what the C library keeps in reserve (Linux)."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    return memory_mib()


def soak(minutes: float, seed: int, *, verbose: bool = False) -> dict[str, float]:
    """Play so long, and return the figures."""
    chance, pads = random.Random(seed), VirtualPads()
    frames, opened = round(minutes * 60 * FRAMES_HZ), 0
    samples_mb: list[float] = []
    load_libraries()
    began_s = time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        app: App | None = None
        for frame in range(frames):
            if app is None:
                surface = open_window((1120, 720), "soak")
                app = App(surface, Start(), config=folder, data=folder)
                opened += 1
            while chance.random() < 0.25:
                disturb(chance, pads)
            if not app.step(frame / FRAMES_HZ, pygame.event.get()):
                app.close()
                app = None
            if frame % FLIP_EVERY == 0:
                pygame.display.flip()
            if frame % (frames // SAMPLES) == 0:
                samples_mb.append(resident_mb())
                if verbose:
                    print(f"{frame / FRAMES_HZ / 60:5.1f} min {samples_mb[-1]:8.1f} MB", flush=True)
    sixth = SAMPLES // 6
    early_mb = statistics.median(samples_mb[sixth : 2 * sixth])
    late_mb = statistics.median(samples_mb[-sixth:])
    return {
        "minutes": minutes,
        "frames": frames,
        "windows_opened": opened,
        "early_mb": round(early_mb, 1),
        "late_mb": round(late_mb, 1),
        "growth_mb": round(late_mb - early_mb, 1),
        "took_s": round(time.perf_counter() - began_s, 1),
    }


def main() -> int:
    options = command_line(__doc__, minutes=60.0, seed=1).parse_args()
    figures = soak(options.minutes, options.seed, verbose=not options.json)
    results = Results("tetris_soak")
    for name, value in figures.items():
        results.note(name, value, name.rpartition("_")[2] if name[-2:] in ("mb", "_s") else "")
    results.finish(options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
