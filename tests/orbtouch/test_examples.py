"""Each example of `examples/` does what it says."""

import ast
import importlib.util
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pygame
import pytest

import orbtouch
from tests.support import fake_device
from tests.support.processes import LineProcess

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def example(name: str) -> ModuleType:
    """Import an example, which runs what is not below `__main__`."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class ScriptedOrb:
    """An orb whose commands are listed, a picture each; the window is closed after the last."""

    def __init__(self, *names: str) -> None:
        self.names = list(names)
        self.drawn = 0

    def __enter__(self) -> "ScriptedOrb":
        return self

    def __exit__(self, *problem: object) -> None:
        pass

    def commands(self) -> list[orbtouch.Command]:
        name = self.names.pop(0)
        if not self.names:
            pygame.event.post(pygame.event.Event(pygame.QUIT))
        return [orbtouch.Command(0.0, name, "press", 1.0, None)]

    def touch(self, *fingers: tuple[float, float]) -> None:
        assert fingers == ()

    def draw(self, surface: pygame.Surface, rect: pygame.Rect) -> None:
        self.drawn += 1


def test_the_game_moves_its_ball(monkeypatch: pytest.MonkeyPatch) -> None:
    orb = ScriptedOrb("left", "left", "drop", "right", "down")
    monkeypatch.setattr(orbtouch, "connect", lambda: orb, raising=False)
    pygame.init()
    game = example("game")
    assert tuple(game.ball) == (640, 240)  # one step right and down of the middle
    assert orb.drawn == 5
    code = ast.parse((EXAMPLES / "game.py").read_text(encoding="utf-8")).body[1:]
    assert sum(len(ast.unparse(part).splitlines()) for part in code) <= 15


def test_the_circle_is_where_the_finger_is_and_as_wide_as_it_is_deep(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class TouchedOrb(ScriptedOrb):
        contact = orbtouch.Contact(0.0, (2.0, 1.0), 0.1, 8.0, 0.4, 1, 0.9, 0.0, 0.0, 0.0, 0.3)

        def touch(self, *fingers: tuple[float, float], depth_mm: float = 0.0) -> None:
            assert (fingers, depth_mm) == ((), 6.0)

        events = ScriptedOrb.commands

    monkeypatch.setattr(orbtouch, "connect", lambda: TouchedOrb("left"), raising=False)
    pygame.init()
    pygame.event.clear()
    screen = example("follow").screen
    red = pygame.surfarray.array_red(screen).nonzero()  # (x, y), y from the top
    assert [round(np.mean(axis)) for axis in red] == [200, 280]
    assert [np.ptp(axis) for axis in red] == pytest.approx([80, 80], abs=2)


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a minute at 10 Hz for each minute at 40 Hz."""
    simulate, load = orbtouch.simulate, orbtouch.load_network

    def less(*, minutes: float, user: int, rate_hz: float = 10.0) -> orbtouch.Recording:
        return simulate(minutes=minutes / 2, user=user, rate_hz=rate_hz)

    monkeypatch.setattr(orbtouch, "simulate", less, raising=False)
    monkeypatch.setattr(
        orbtouch, "load_network", lambda: load("models/orbtouch-10hz.orb"), raising=False
    )


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(("name", "needs"), [("gru", "torch"), ("template", "numpy")])
def test_an_own_predictor_is_judged_beside_the_network_that_ships(name: str, needs: str) -> None:
    pytest.importorskip(needs)
    assert_judged(example(name))


def assert_judged(made: ModuleType) -> None:
    assert made.mine.sessions == made.shipped.sessions == 3
    assert made.mine.events == made.shipped.events > 10
    assert float(made.shipped.recall) > float(made.mine.recall) > 0.1


@pytest.mark.slow
@pytest.mark.usefixtures("short")
def test_a_forest_is_judged_and_recognises_live(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It sees a replay of a person it has learned, with which the orb ends, in place of a game."""
    pytest.importorskip("sklearn")
    answers = []
    orbtouch.simulate(minutes=1, user=0)[0.0:5.0].save(tmp_path / "known.npz")

    def watched(predict: Callable[[np.ndarray], np.ndarray], words: Any, **given: Any) -> None:
        def heard(windows: np.ndarray) -> np.ndarray:
            found = predict(windows)
            answers.append(int(found.argmax()))
            return found

        with orbtouch.live(heard, replay=tmp_path / "known.npz", **given) as orb:
            list(orb)

    monkeypatch.setattr(orbtouch, "play", watched, raising=False)
    monkeypatch.setattr(sys, "argv", ["forest.py"])
    assert_judged(example("forest"))
    assert 0 in answers
    assert len({*answers}) > 1


@pytest.mark.train
@pytest.mark.usefixtures("short")
def test_own_tables_become_a_network_that_is_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    made = example("own_csv").made
    assert (tmp_path / "own.orb").is_file()
    assert made.network.classes[0] == "null"
    assert len(made.curve["gesture"]) == 4
    assert 0.2 < float(made.scores["gesture"]) <= 1.0


@pytest.mark.parametrize("name", ["forest", "gru", "template", "own_csv"])
def test_an_example_of_own_work_is_short_and_public(name: str) -> None:
    """25 lines of 100 columns, blank ones not counted, and of our packages only the interface."""
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line.strip()]
    assert len(lines) <= 25
    assert max(map(len, lines)) <= 100
    assert not re.search(
        r"(import|from) (controller|host|models|tetris)|orbtouch\.\w+ import", text
    )


def test_the_nearest_neighbour_learns_two_names() -> None:
    pytest.importorskip("pythonosc")
    learner = example("nearest_neighbour").Learner()
    assert learner.hear(np.zeros(25)) == ""
    for name, place in (("rest", 0), ("corner", 24)):
        learner.teach(name)
        for _ in range(40):
            learner.hear(np.eye(25)[place])
    near = np.eye(25)[24] * 0.8
    assert learner.hear(near) == "corner"
    assert len(learner.names) == 80  # no more are taken unasked


def test_epochs_lie_around_the_commands() -> None:
    pytest.importorskip("pylsl")
    eeg = example("eeg")
    t = np.arange(0.0, 10.0, 0.01)
    samples = np.stack([t, -t], axis=1)
    cut, kept = eeg.epochs(samples, t, np.array([0.2, 4.0, 9.5]), 100.0)
    assert kept.tolist() == [1]  # the others do not lie wholly inside
    assert cut.shape == (1, 150, 2)
    assert cut[0, 0, 0] == pytest.approx(3.5)
    assert cut[0, 50, 0] == pytest.approx(4.0)


AMPLIFIER = """
import time, pylsl
outlet = pylsl.StreamOutlet(pylsl.StreamInfo("amplifier", "EEG", 4, 250.0, "float32", "eeg-1"))
began_s, sent = time.monotonic(), 0
while True:
    due = int((time.monotonic() - began_s) * 250)
    if due > sent:
        outlet.push_chunk([[float(number)] * 4 for number in range(sent, due)])
        sent = due
    time.sleep(0.01)
"""
LOOPBACK = """
[multicast]
ResolveScope = machine
ListenAddress = 127.0.0.1
[ports]
IPv6 = disable
"""


@pytest.mark.system
def test_epochs_are_collected_from_two_streams(tmp_path: Path) -> None:
    """An amplifier, an orb with a command in every tenth frame, `host --tap lsl`, the example."""
    pytest.importorskip("pylsl")
    (tmp_path / "lsl.cfg").write_text(LOOPBACK)
    there: dict[str, Any] = {
        "cwd": tmp_path, "env": os.environ | {"LSLAPICFG": str(tmp_path / "lsl.cfg")}
    }  # fmt: skip
    orb = LineProcess((sys.executable, fake_device.__file__, "listen://127.0.0.1:0"))
    url = json.loads(orb.line())["listening"].replace("listen:", "socket:")
    tap = [sys.executable, "-m", "host", "--headless", "--seconds", "60", "--link", url]
    host = subprocess.Popen([*tap, "--tap", "lsl"])
    amplifier = subprocess.Popen([sys.executable, "-c", AMPLIFIER], **there)
    try:
        command = [sys.executable, str(EXAMPLES / "eeg.py"), "4"]
        done = subprocess.run(command, **there, capture_output=True, text=True, timeout=60)
    finally:
        for process in (amplifier, host):
            process.terminate()
            process.wait()
        orb.close()
    assert done.returncode == 0, done.stderr
    with np.load(tmp_path / "epochs.npz") as saved:
        assert len(saved["epochs"]) > 5  # of 20 commands in 4 s, those with 1.5 s of EEG around
        assert saved["epochs"].shape[1:] == (375, 4)
        assert set(saved["commands"]) == {"drop"}
        steps = np.diff(saved["epochs"][:, 0, 0])  # samples between two commands, 0.2 s apart
    assert steps.mean() == pytest.approx(50.0, abs=5.0)


def test_the_notebook_runs_from_top_to_bottom(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    cells = json.loads((EXAMPLES / "report.ipynb").read_text(encoding="utf-8"))["cells"]
    space: dict[str, Any] = {}
    shown = [run(cell, space) for cell in cells if cell["cell_type"] == "code"]
    assert isinstance(shown[0], orbtouch.Recording)
    assert isinstance(shown[-3], orbtouch.Evaluation)
    assert shown[-3].classes[-1] == "swipe"
    assert (tmp_path / "mine.orb").is_file()


def run(cell: dict[str, Any], space: dict[str, Any]) -> object:
    """Run a cell as a notebook does; return the value of its last line, if that is one."""
    body = ast.parse("".join(cell["source"])).body
    last = body[-1]
    if not isinstance(last, ast.Expr):
        exec(compile(ast.Module(body, []), "cell", "exec"), space)
        return None
    exec(compile(ast.Module(body[:-1], []), "cell", "exec"), space)
    value: object = eval(compile(ast.Expression(last.value), "cell", "eval"), space)
    if hasattr(value, "_repr_html_"):
        assert value._repr_html_()
    return value


def test_every_example_is_described() -> None:
    text = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    for path in EXAMPLES.iterdir():
        if path.name not in {"README.md", "__pycache__"} and path.suffix != ".pyc":
            assert f"]({path.name}" in text, path.name
