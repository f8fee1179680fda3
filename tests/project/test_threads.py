"""No thread keeps a program from ending: each is a daemon, but for two that are soon done."""

import ast
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
SOON_DONE = [("host/app/orbs.py", "own orb"), ("host/injection/injector.py", "release")]


def test_every_thread_is_a_daemon_unless_it_must_finish() -> None:
    others, count = [], 0
    for package in ("controller", "host", "models", "tetris", "orbtouch"):
        for path in sorted((ROOT / package).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_bytes())):
                if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("Thread"):
                    options = {one.arg: ast.unparse(one.value) for one in node.keywords}
                    count += "target" in options
                    if "target" in options and options.get("daemon") != "True":
                        name = options.get("name", "").strip("'")
                        others.append((path.relative_to(ROOT).as_posix(), name))
    assert others == SOON_DONE
    assert count > 20
