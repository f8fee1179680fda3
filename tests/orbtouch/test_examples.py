"""Examples with an orb, the notebook, and what all examples keep to."""

import ast
import json
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest

import orbtouch
from orbtouch import plugins
from tests.support.examples import EXAMPLES, example


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


@pytest.mark.parametrize("name", ["forest", "gru", "template", "own_csv"])
def test_an_example_of_own_work_is_short(name: str) -> None:
    """25 lines of 100 columns, blank ones not counted."""
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line.strip()]
    assert len(lines) <= 25
    assert max(map(len, lines)) <= 100


def assert_public(code: ast.AST) -> None:
    """Of our packages, only the two of the interface are imported, and only their names used."""
    names = {*orbtouch.__all__, *plugins.__all__, "plugins"}
    for node in ast.walk(code):
        if isinstance(node, ast.Import | ast.ImportFrom):
            froms = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            for module in froms or [alias.name for alias in node.names]:
                assert module.partition(".")[0] not in {"controller", "host", "models", "tetris"}
                if module.startswith("orbtouch"):
                    assert module in {"orbtouch", "orbtouch.plugins"}
                    assert not froms or {alias.name for alias in node.names} <= names
        elif isinstance(node, ast.Attribute) and ast.unparse(node.value) in {"orbtouch", "plugins"}:
            assert node.attr in names


@pytest.mark.parametrize("path", sorted(EXAMPLES.rglob("*.py")), ids=lambda path: path.name)
def test_an_example_uses_the_public_interface_only(path: Path) -> None:
    assert_public(ast.parse(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    "line",
    [
        "import host.targets",
        "from controller import links",
        "from orbtouch import networks",
        "import orbtouch\nets = orbtouch.networks",
    ],
)
def test_a_private_import_is_noticed(line: str) -> None:
    with pytest.raises(AssertionError):
        assert_public(ast.parse(line))


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
