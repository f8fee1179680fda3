"""Size and shape of the source tree, and how many modules and calls one frame takes.

    python -m tests.benchmarks.layout [--root DIR] [--static] [--json]

    lines       of all Python files of the product, blank ones and comments included
    files       Python files; `longest` is the one with the most lines
    entries     modules and packages directly inside a package, without __init__ and __main__
    function    median length of functions and methods, lines from `def` to the end
    documented  share of public functions, methods and classes that have a docstring
    shapes      of the functions that take or return arrays (NDArray or an alias), the share whose
                shapes are named, by an alias with its shape in a comment or in the docstring
    path        modules whose functions every frame enters on its way from the sensor's read to the
                stroke of a key, without those that stand for the hardware and the finger
    calls       calls of the project's own functions from one read of the sensor to the next, in
                `controller --replay assets/demo.npz`: the median

--root measures another tree by the same rules; its programs then run with it as their path.
"""

import ast
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from .results import command_line

PACKAGES: Final = ("controller", "host", "models", "orbtouch", "tetris")
STROKES: Final = 12  # frames that press a key, of which the path is taken
PATIENCE_S: Final = 120.0
_EMULATED: Final = "controller/sensors/emulated.py"
_HARDWARE: Final = (
    _EMULATED, "controller/sensors/hardware/emulated/", "controller/sensors/virtual",
    "controller/simulator/",
)  # fmt: skip
_STROKE: Final = "a stroke"  # in place of a file
_QUEUES: Final = ("/protocol/retransmit.py", "/protocol/outbox.py", "controller/outbox.py")
_SHAPE: Final = re.compile(r"\(\s*[A-Za-z0-9_.* +/-]+\s*,[^()]*\)|shape", re.IGNORECASE)
_ARRAY: Final = re.compile(r"\b(NDArray|ndarray|ArrayLike)\b")
_MAPPING: Final = """
[everywhere]
drop = { arm = true }

[profile.keys]
left = "left"
right = "right"
down = "down"
rotate_cw = "up"
rotate_ccw = "z"
"""
# Runs a program and notes when it enters a function of the tree: nanoseconds, file, function.
_TRACED: Final = """
import atexit, json, runpy, sys, threading, time
root, out, sys.argv = sys.argv[1], sys.argv[2], sys.argv[3:]
PACKAGES = ("controller/", "host/", "models/", "tetris/")
events, files = [], {}
def note(frame, event, arg, now=time.monotonic_ns):
    if event == "call":
        code = frame.f_code
        path = files.get(code.co_filename)
        if path is None:
            name = code.co_filename
            path = name[len(root) + 1 :] if name.startswith(root) else ""
            files[name] = path = path if path.startswith(PACKAGES) else ""
        if path and code.co_name[0] != "<":
            events.append((now(), path, code.co_name))
def keep():
    sys.setprofile(None)
    threading.setprofile(None)
    with open(out, "w") as file:
        json.dump(events, file)
atexit.register(keep)
if sys.argv[0] == "host":
    import itertools
    write = sys.stdout.write
    def note_stroke(text):
        if text.startswith("press "):
            events.append((time.monotonic_ns(), "a stroke", ""))
        return write(text)
    sys.stdout.write = note_stroke
    from controller.shared.protocol.messages import Perform
    from host.connection.receiver import Receiver
    begin = Receiver.start
    def start(self):
        begin(self)
        def perform():
            touches = itertools.cycle([("press", 0.6), ("press", 3.4)])
            time.sleep(6.0)
            self.send(Perform(1, "pinch", 2.0, 2.0))
            for number, (label, x) in enumerate(touches, 2):
                time.sleep(1.5)
                self.send(Perform(number, label, x, 2.0))
        threading.Thread(target=perform, daemon=True).start()
    Receiver.start = start
threading.setprofile(note)
sys.setprofile(note)
runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
"""


@dataclass(frozen=True, slots=True)
class Module:
    """One source file."""

    path: str  # relative to the root, as in "controller/shared/files.py"
    lines: int  # how many
    tree: ast.Module  # its syntax tree


def main() -> int:
    here = Path(__file__).resolve().parents[2]
    options = command_line(__doc__, root=here, static=False).parse_args()
    root = options.root.resolve()
    figures = static(root)
    if not options.static:
        figures |= running(root)
    print(json.dumps(figures) if options.json else _text(figures))
    return 0


def static(root: Path) -> dict[str, Any]:
    """Return what the source alone shows."""
    modules = [module for package in PACKAGES for module in read(root, package)]
    tests = read(root, "tests")
    longest = max(modules, key=lambda module: module.lines)
    shaped, others = array_aliases(root, modules)
    functions = [length for module in modules for length in function_lengths(module.tree)]
    documented = [has for module in modules for has in docstrings(module.tree)]
    shapes = [named for module in modules for named in array_functions(module.tree, shaped, others)]
    return {
        "lines": sum(module.lines for module in modules),
        "lines_of": {
            p: sum(m.lines for m in modules if m.path.startswith(p + "/")) for p in PACKAGES
        },
        "files": len(modules),
        "longest": [longest.path, longest.lines],
        "over_350": sum(module.lines > 350 for module in modules),
        "entries": {package: entries(root / package) for package in PACKAGES},
        "tests_lines": sum(module.lines for module in tests),
        "tests_files": len(tests),
        "function_median": statistics.median(functions),
        "documented": round(sum(documented) / len(documented), 4),
        "array_functions": len(shapes),
        "shapes": round(sum(shapes) / len(shapes), 4),
    }


def read(root: Path, package: str) -> list[Module]:
    """Return the modules of a package, by path."""
    found = []
    for path in sorted((root / package).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        name = path.relative_to(root).as_posix()
        found.append(Module(name, len(text.splitlines()), ast.parse(text)))
    return found


def entries(folder: Path) -> int:
    """Return how many modules and packages lie directly in a package."""
    if not folder.is_dir():
        return 0
    modules = {p.stem for p in folder.glob("*.py")} - {"__init__", "__main__"}
    packages = {p.name for p in folder.iterdir() if p.is_dir() and any(p.glob("*.py"))}
    return len(modules | packages)


def function_lengths(tree: ast.Module) -> Iterator[int]:
    """Yield the lines of each function and method."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield (node.end_lineno or node.lineno) - node.lineno + 1


def docstrings(tree: ast.Module) -> Iterator[bool]:
    """Yield for each public function, method and class whether it has a docstring."""
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                if not node.name.startswith("_"):
                    yield ast.get_docstring(node) is not None


def array_aliases(root: Path, modules: list[Module]) -> tuple[set[str], set[str]]:
    """Return the names of array types such as `Frame`: those with a shape beside them, others."""
    shaped: set[str] = set()
    others = {"NDArray", "ndarray", "ArrayLike"}
    for module in modules:
        lines = (root / module.path).read_text(encoding="utf-8").splitlines()
        for node in module.tree.body:
            if isinstance(node, ast.Assign) and _ARRAY.match(ast.unparse(node.value)):
                names = {target.id for target in node.targets if isinstance(target, ast.Name)}
                (shaped if "# (" in lines[node.lineno - 1] else others).update(names)
    return shaped - others, others


def array_functions(tree: ast.Module, shaped: set[str], others: set[str]) -> Iterator[bool]:
    """Yield for each function with arrays whether their shapes are named."""
    plain, alias = (re.compile(rf"\b({'|'.join(sorted(names))})\b") for names in (others, shaped))
    methods = {
        child: node.name
        for node in ast.walk(tree) if isinstance(node, ast.ClassDef) for child in node.body
    }  # fmt: skip
    classes = {n.name: n for n in ast.walk(tree) if isinstance(n, ast.ClassDef)}
    for node in ast.walk(tree):
        if not isinstance(node, ast.FunctionDef):
            continue
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        notes = [a.annotation for a in arguments if a.annotation is not None]
        text = " ".join(ast.unparse(note) for note in (*notes, *filter(None, [node.returns])))
        if not (plain.search(text) or alias.search(text)):
            continue
        doc = ast.get_docstring(node) or ""
        if node.name == "__init__" and node in methods:
            doc += ast.get_docstring(classes[methods[node]]) or ""
        yield not plain.search(text) or bool(_SHAPE.search(doc))


def running(root: Path) -> dict[str, Any]:
    """Return the modules on the path of a frame, and the calls that a frame takes."""
    with tempfile.TemporaryDirectory() as folder:
        path = key_path(root, Path(folder))
        return {"path": len(path), "path_modules": path, "calls": replay_calls(root, Path(folder))}


def replay_calls(root: Path, folder: Path) -> float:
    """Return how many calls a frame of the demo's replay takes, in the median."""
    out = folder / "replay.json"
    command = _command(root, out, "controller", "--replay", str(root / "assets" / "demo.npz"))
    subprocess.run(
        command, check=True, cwd=folder, env=_environment(root), stdout=subprocess.DEVNULL
    )
    events = json.loads(out.read_text())
    reads = [
        i
        for i, (_, path, name) in enumerate(events)
        if (path[-10:], name) == ("/replay.py", "read")
    ]
    return statistics.median(b - a for a, b in pairwise(reads))


def key_path(root: Path, folder: Path) -> list[str]:
    """Return the modules that a frame enters on its way from the sensor to a key."""
    mapping = folder / "keys.toml"
    mapping.write_text(_MAPPING)
    device, host = folder / "device.json", folder / "host.json"
    command = _command(
        root, device, "controller", "--sensor", "emulated", "--link", "listen://127.0.0.1:0"
    )
    orb = subprocess.Popen(
        command, cwd=folder, env=_environment(root), stdout=subprocess.PIPE, text=True
    )
    try:
        player = subprocess.Popen(
            _command(
                root, host, "host", "--target", "keyboard", "--dry-run", "--headless",
                "--keys", str(mapping), "--link", f"socket://127.0.0.1:{_port(orb)}",
            ),
            cwd=folder, env=_environment(root), stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        try:
            _await_strokes(player)
        finally:
            player.terminate()
            player.communicate(timeout=PATIENCE_S)
    finally:
        orb.terminate()
        orb.communicate(timeout=PATIENCE_S)
    return _entered(json.loads(device.read_text()), json.loads(host.read_text()))


def _command(root: Path, out: Path, *words: str) -> list[str]:
    """Return the command that runs a program of the tree and traces it into a file."""
    return [sys.executable, "-c", _TRACED, str(root), str(out), *words]


def _environment(root: Path) -> dict[str, str]:
    return {
        **os.environ, "PYTHONPATH": str(root), "PYTHONUNBUFFERED": "1", "SDL_VIDEODRIVER": "dummy",
        "OMP_NUM_THREADS": "1",
    }  # fmt: skip


def _port(orb: subprocess.Popen[str]) -> int:
    """Return the port that the device prints."""
    assert orb.stdout is not None
    for line in orb.stdout:
        if found := re.search(r"127\.0\.0\.1:(\d+)", line):
            return int(found[1])
    raise SystemExit("the device printed no port")


def _await_strokes(player: subprocess.Popen[str]) -> None:
    """Return when enough keys have gone down."""
    assert player.stdout is not None
    found = 0
    end_s = time.monotonic() + PATIENCE_S
    for line in player.stdout:
        found += line.startswith("press ")
        if found == STROKES or time.monotonic() > end_s:
            break


Event = tuple[int, str, str]  # nanoseconds, file, function


def _entered(device: list[Event], host: list[Event]) -> list[str]:
    """Return the files in which every frame entered a function, from its read to its stroke."""
    reads = [t for t, path, name in device if name == "read" and path == _EMULATED]
    commands = [t for t, path, name in device if path.endswith(_QUEUES) and name == "put"]
    strokes = [t for t, path, _ in host if path == _STROKE]
    sets = []
    for command, following in pairwise([*commands, sys.maxsize]):
        stroke = min((t for t in strokes if command < t < following), default=None)
        if stroke is None:
            continue
        read = max(t for t in reads if t < command)
        end = min([stroke, *(t for t in reads if t > command)])
        sets.append(
            {path for t, path, _ in device if read <= t <= end}
            | {path for t, path, _ in host if command <= t <= stroke}
        )
    if not sets:
        raise SystemExit("no command led to a stroke")
    return sorted(
        path for path in set.intersection(*sets) if not path.startswith((*_HARDWARE, _STROKE))
    )


def _text(figures: dict[str, Any]) -> str:
    return "\n".join(
        textwrap.fill(f"{name:16}{value}", 100, subsequent_indent=" " * 16)
        for name, value in figures.items()
    )


if __name__ == "__main__":
    sys.exit(main())
