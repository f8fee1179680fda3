"""Duration of a picture of the game, and time to the first one.

    python -m tests.benchmarks.tetris_draw [--json]

A bot plays at twelve actions a second, so that trails, flashes and words are alive in
most frames; every frame at 1280 × 720 is timed by itself, for each theme. `draw_p99_ms` is the
slowest theme's 99th percentile, of CPU time, because a shared machine's clock also counts the
work of others. `first_frame_s` is from an interpreter's start to the window's first picture,
menu and bot's game included.
"""

import os
import subprocess
import sys
import time

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

import numpy as np
import pygame

from tetris.bots import greedy
from tetris.engine.events import Action
from tetris.engine.game import Config, Game, Phase
from tetris.kit.settings import Look, Settings
from tetris.kit.theme import PALETTES
from tetris.window.view import GameView

from .results import Results, command_line

SIZES = {"": (1280, 720), "4k_": (3840, 2160)}
SECONDS = 40
FRAMES_HZ = 60
ACTION_S = 1 / 12

_FIRST = """
import os, tempfile
os.environ["SDL_AUDIODRIVER"] = "none"
from pathlib import Path
import pygame
from tetris.window.app import App, Start
from tetris.kit.display import open_window
surface = open_window((1280, 720), "first frame")
folder = Path(tempfile.mkdtemp())
App(surface, Start(), config=folder, data=folder).step(0.0, pygame.event.get())
pygame.display.flip()
os._exit(0)
"""


def frames_ms(theme: str, size: tuple[int, int]) -> list[float]:
    """Return the time of each frame of one game in which something changed, milliseconds."""
    surface = pygame.display.set_mode(size)
    look = Look(Settings(theme=theme, patterns=theme == "safe", language="en"))
    view, game = GameView(surface.get_rect(), look=look), Game(5, Config(start_level=5))
    took_ms: list[float] = []
    next_s = 0.0
    for frame in range(SECONDS * FRAMES_HZ):
        now_s = frame / FRAMES_HZ
        actions: list[Action] = []
        if game.phase is Phase.OVER:
            actions = [Action.RESTART]
        elif now_s >= next_s:
            actions, next_s = [greedy.plan(game).actions[0]], now_s + ACTION_S
        events = game.update(now_s, actions)
        began_s = time.process_time()
        view.show(events)
        if view.draw(surface, game, now_s, kept=frame > 0):
            took_ms.append(1000 * (time.process_time() - began_s))
    return took_ms


def first_frame_s() -> float:
    """Return how long a fresh interpreter takes to show the menu, the best of three."""
    times = []
    for _ in range(3):
        began_s = time.perf_counter()
        subprocess.run([sys.executable, "-c", _FIRST], check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - began_s)
    return min(times)


def main() -> int:
    options = command_line(__doc__).parse_args()
    pygame.display.init()
    results = Results("tetris_draw")
    for name, size in SIZES.items():
        slowest_ms = 0.0
        for theme in PALETTES:
            p50_ms, p99_ms = np.percentile(frames_ms(theme, size), [50, 99])
            results.note(f"draw_{name}p50_ms_{theme}", round(float(p50_ms), 3), "ms")
            results.note(f"draw_{name}p99_ms_{theme}", round(float(p99_ms), 3), "ms")
            slowest_ms = max(slowest_ms, float(p99_ms))
        results.note(f"draw_{name}p99_ms", round(slowest_ms, 3), "ms")
    results.note("first_frame_s", round(first_frame_s(), 3), "s")
    results.finish(options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
