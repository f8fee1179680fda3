"""Size and shape of the source tree: lines, files, commands, imports, documentation.

    python -m tests.benchmarks.layout [--root DIR] [--json]

    lines       of all Python files of the product, blank ones and comments included
    elsewhere   lines that stand beside them: tests, examples, TOML, pages, sketches
    files       Python files; `longest` is the one with the most lines
    loose       folders with more than 14 Python files, without __init__ and __main__
    fmt         comments that switch the formatter off
    function    median length of functions and methods, lines from `def` to the end
    documented  share of public functions, methods and classes that have a docstring
    shapes      of the functions that take or return arrays (NDArray or an alias), the share whose
                shapes are named, by an alias with its shape in a comment or in the docstring
    arrows      pairs (a, b) of modules and packages directly inside a package, of which a imports b
    circles     groups of modules that import each other, imports of types and in functions included
    verbs       of all programs: each program without a verb, and each verb, or its own verbs
    options     of all verbs, one that two verbs share counted twice; `distinct`: by program, once
    words       of README.md and docs/*.md

--root measures another tree by the same rules; its programs run with it as their path.
"""

import ast
import json
import os
import re
import statistics
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from .results import command_line

PACKAGES: Final = ("controller", "host", "models", "orbtouch", "tetris")
PROGRAMS: Final = ("controller", "host", "models", "tetris")  # `orbtouch` has their verbs
LOOSE_FILES: Final = 14  # the most that a folder should have
ELSEWHERE: Final = {
    "tests": "tests/**/*.py",
    "examples": "examples/**/*.py",
    "toml": "[chmoat]*/**/*.toml",
    "pages": "[hma]*/**/*.html",
    "sketches": "firmware/**/*.ino",
}
_SHAPE: Final = re.compile(r"\(\s*[A-Za-z0-9_.* +/-]+\s*,[^()]*\)|shape", re.IGNORECASE)
_ARRAY: Final = re.compile(r"\b(NDArray|ndarray|ArrayLike)\b")
_OPTION: Final = re.compile(r"^  (?:-\w, )?(--[a-z][a-z-]*)", re.MULTILINE)
_VERBS: Final = re.compile(r"^(?:commands:|  COMMAND)\n((?: {2,}.*\n)+)", re.MULTILINE)
_VERB: Final = re.compile(r"^ {2,4}([a-z][a-z_-]*)(?: {2,}|$)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Module:
    """One source file."""

    path: str  # relative to the root, as in "controller/shared/files.py"
    text: str
    tree: ast.Module  # its syntax tree

    @property
    def lines(self) -> int:
        """Number of lines."""
        return len(self.text.splitlines())

    @property
    def name(self) -> str:
        """Dotted name, as in "controller.shared.files"."""
        return self.path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def main() -> int:
    here = Path(__file__).resolve().parents[2]
    options = command_line(__doc__, root=here).parse_args()
    root = options.root.resolve()
    figures = sources(root) | commands(root)
    print(json.dumps(figures) if options.json else _text(figures))
    return 0


def sources(root: Path) -> dict[str, Any]:
    """Return what the sources alone show."""
    modules = [module for package in PACKAGES for module in read(root, package)]
    longest = max(modules, key=lambda module: module.lines)
    shaped, others = array_aliases(modules)
    functions = [length for module in modules for length in function_lengths(module.tree)]
    documented = [has for module in modules for has in docstrings(module.tree)]
    shapes = [named for module in modules for named in array_functions(module.tree, shaped, others)]
    graph = imports(modules)
    pages = [root / "README.md", *sorted((root / "docs").glob("*.md"))]
    return {
        "lines": sum(module.lines for module in modules),
        "lines_of": {
            p: sum(m.lines for m in modules if m.path.startswith(p + "/")) for p in PACKAGES
        },
        "elsewhere": {kind: _lines(root, pattern) for kind, pattern in ELSEWHERE.items()},
        "files": len(modules),
        "longest": [longest.path, longest.lines],
        "over_350": sum(module.lines > 350 for module in modules),
        "loose": loose(modules),
        "fmt": sum(len(re.findall(r"# fmt: (?:skip|off)", module.text)) for module in modules),
        "function_median": statistics.median(functions),
        "documented": round(sum(documented) / len(documented), 4),
        "array_functions": len(shapes),
        "shapes": round(sum(shapes) / len(shapes), 4),
        "arrows": {package: len(arrows(graph, package)) for package in PACKAGES},
        "circles": circles(graph),
        "words": sum(len(page.read_text("utf-8").split()) for page in pages),
    }


def read(root: Path, package: str) -> list[Module]:
    """Return the modules of a package, by path."""
    found = []
    for path in sorted((root / package).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        found.append(Module(path.relative_to(root).as_posix(), text, ast.parse(text)))
    return found


def _lines(root: Path, pattern: str) -> int:
    return sum(len(p.read_text("utf-8").splitlines()) for p in root.glob(pattern) if p.is_file())


def loose(modules: list[Module]) -> dict[str, int]:
    """Return how many files lie directly in each folder that has too many."""
    counts: dict[str, int] = {}
    for module in modules:
        folder, _, name = module.path.rpartition("/")
        if name not in ("__init__.py", "__main__.py"):
            counts[folder] = counts.get(folder, 0) + 1
    return {folder: n for folder, n in counts.items() if n > LOOSE_FILES}


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


def array_aliases(modules: list[Module]) -> tuple[set[str], set[str]]:
    """Return the names of array types such as `Frame`: those with a shape beside them, others."""
    shaped: set[str] = set()
    others = {"NDArray", "ndarray", "ArrayLike"}
    for module in modules:
        lines = module.text.splitlines()
        for node in module.tree.body:
            if isinstance(node, ast.Assign) and _ARRAY.match(ast.unparse(node.value)):
                names = {target.id for target in node.targets if isinstance(target, ast.Name)}
                (shaped if "# (" in lines[node.lineno - 1] else others).update(names)
    return shaped - others, others


def array_functions(tree: ast.Module, shaped: set[str], others: set[str]) -> Iterator[bool]:
    """Yield for each function with arrays whether their shapes are named."""
    plain, alias = (re.compile(rf"\b({'|'.join(sorted(names))})\b") for names in (others, shaped))
    classes = [node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    owners = {child: node for node in classes for child in node.body}
    for node in ast.walk(tree):
        if not isinstance(node, ast.FunctionDef):
            continue
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        notes = [a.annotation for a in arguments if a.annotation is not None]
        text = " ".join(ast.unparse(note) for note in (*notes, *filter(None, [node.returns])))
        if not (plain.search(text) or alias.search(text)):
            continue
        doc = ast.get_docstring(node) or ""
        if node.name == "__init__" and node in owners:
            doc += ast.get_docstring(owners[node]) or ""
        yield not plain.search(text) or bool(_SHAPE.search(doc))


def imports(modules: list[Module]) -> dict[str, set[str]]:
    """Return, by module, the modules of the project that it imports, anywhere in its file."""
    graph: dict[str, set[str]] = {module.name: set() for module in modules}
    for module in modules:
        for node in ast.walk(module.tree):
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names = {f"{node.module}.{alias.name}" for alias in node.names}
                graph[module.name] |= {n if n in graph else node.module for n in names}
            elif isinstance(node, ast.Import):
                graph[module.name] |= {alias.name for alias in node.names}
    return {name: (found & graph.keys()) - {name} for name, found in graph.items()}


def arrows(graph: dict[str, set[str]], package: str) -> set[tuple[str, str]]:
    """Return the pairs of direct members of a package of which the first imports the second."""
    inside = {name: name.split(".")[1] for name in graph if name.startswith(package + ".")}
    pairs = {(inside[a], inside[b]) for a in inside for b in graph[a] if b in inside}
    return {(a, b) for a, b in pairs if a != b}


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return the groups of modules that reach each other by imports."""
    reach: dict[str, set[str]] = {}
    for start in graph:
        seen: set[str] = set()
        ahead = list(graph[start])
        while ahead:
            name = ahead.pop()
            if name not in seen:
                seen.add(name)
                ahead += graph[name]
        reach[start] = seen
    groups = {
        frozenset(b for b in reach[a] if a in reach[b]) for a in graph if a in reach[a]
    }  # a module in its own reach is part of a circle
    return sorted(sorted(group) for group in groups)


def commands(root: Path) -> dict[str, Any]:
    """Return the verbs of the programs, and how many options they have."""
    verbs, options, distinct = [], 0, 0
    for program in PROGRAMS:
        seen: set[str] = set()
        ahead: list[tuple[str, ...]] = [(program,)]
        while ahead:
            words = ahead.pop(0)
            text = help_of(root, words)
            inner = [verb for block in _VERBS.findall(text) for verb in _VERB.findall(block)]
            ahead += [(*words, verb) for verb in inner]
            own = set(_OPTION.findall(text)) - {"--help", "--version"}
            if own or not inner:
                verbs.append(" ".join(words))
            options += len(own)
            seen |= own
        distinct += len(seen)
    return {"verbs": len(verbs), "verb_names": verbs, "options": options, "distinct": distinct}


def help_of(root: Path, words: tuple[str, ...]) -> str:
    """Return the help of a program or one of its verbs."""
    command = [sys.executable, "-m", words[0], *words[1:], "--help"]
    environment = os.environ | {"PYTHONPATH": str(root), "COLUMNS": "100"}
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
    return done.stdout


def _text(figures: dict[str, Any]) -> str:
    return "\n".join(
        textwrap.fill(f"{name:16}{value}", 100, subsequent_indent=" " * 16)
        for name, value in figures.items()
    )


if __name__ == "__main__":
    sys.exit(main())
