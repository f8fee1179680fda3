"""A gesture ships by two files, its entry in the vocabulary and its movement; no code changes."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

from tests.support import ROOT

ENTRY = """
[[gesture]]
label = "tap2"
say = "tap twice"
rotations = "all"
mirror = "self"
command = "hold"
"""
PROGRAM = """
import json
import pygame
from controller.bundles import vocabulary
from controller.shared.protocol.messages import COMMANDS, Welcome
from controller.simulator.session import simulate
from host.demo.autoplayer import MANUAL, Autoplayer
from host.ui.orb_state import OrbState
from host.ui.panel.panel import Panel
from host.ui.pointer_input import DomeArea
from models.data.simulate import DataSet
from tetris.kit.settings import Look

book = vocabulary.shipped()

def card(labels):
    view, surface, panel = OrbState(), pygame.Surface((360, 640)), Panel()
    view.connected(Welcome(1, 7, "a", "A", True, 5, 5, 10.0, 10.0, 100, 300, labels, COMMANDS))
    panel.place(surface.get_rect(), DomeArea(), gestures=len(labels) - 1)
    panel.draw(surface, view, 0.0, Look())
    return pygame.image.tobytes(surface, "RGB")

pygame.font.init()
print(json.dumps({
    "simulated": "tap2" in {event.kind for event in simulate(1, 1.0).events},
    "in data sets": "tap2" in DataSet().gestures,
    "mapped": book.mapping.command("tap2", None),
    "played": MANUAL["hold"],
    "drawn": card(book.labels) != card(book.labels[:-1]),
}))
"""


def test_a_gesture_is_added_by_its_entry_and_its_movement(tmp_path: Path) -> None:
    for package in ("assets", "controller", "host", "models", "tetris"):
        ignored = shutil.ignore_patterns("__pycache__", "*.onnx", "*.npz")
        shutil.copytree(ROOT / package, tmp_path / package, ignore=ignored)
    with (tmp_path / "controller" / "bundles" / "gestures.toml").open("a") as file:
        file.write(ENTRY)
    motions = tmp_path / "controller" / "simulator" / "hand" / "gestures"
    like = (motions / "double_tap.toml").read_text().replace('"double_tap"', '"tap2"')
    (motions / "tap2.toml").write_text(like)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "SDL_VIDEODRIVER": "dummy"}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert not done.returncode, done.stderr
    assert json.loads(done.stdout.splitlines()[-1]) == {
        "simulated": True,
        "in data sets": True,
        "mapped": "hold",
        "played": ["tap2", [2.0, 2.0]],
        "drawn": True,
    }
