"""Make small mistakes in a copy of the code, one by one, and run the tests that know the file.

What the closest tests do not catch is tried on all tests of their folders; a test that caught one
must pass without it. The tables beside this file name the closest tests of each source file, and
the mutations that no test can catch.
POSIX only. The exit status is 0 if 90 % are caught and no entry of the tables is out of date.
"""

import argparse
import importlib.util
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from .mutate import Mutation, draw, mutations

ROOT: Final = Path(__file__).parent.parent.parent
HERE: Final = Path(__file__).parent
GOAL: Final = 0.9  # share caught, of those that are not equivalent
LIMIT_S: Final = 400.0  # for the closest tests, which take seconds: beyond it a mutation is caught
FOLDERS_LIMIT_S: Final = 1200.0  # for all tests of the folders
_PYTEST: Final = (
    *(sys.executable, "-m", "pytest", "-x", "-q", "-n0", "-p", "no:cacheprovider"),
    "--hypothesis-profile=mutants",  # see tests/conftest.py
)
_NOT_COPIED: Final = (".git", ".venv", "__pycache__", ".*_cache", ".hypothesis")
Reasons = dict[tuple[str, str, str], str]  # file, text, its replacement: why no test catches it


def main(argv: list[str] | None = None) -> int:
    """Run the mutations that the command line asks for; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("source", nargs="*", help="files to mutate (default: all of related.toml)")
    parser.add_argument("--seed", type=int, default=1, help="of the draw (default: %(default)s)")
    parser.add_argument("--count", type=int, default=100, help="mutations (default: %(default)s)")
    options = parser.parse_args(argv)
    tests, reasons = related(), equivalent()
    if old := stale(reasons):
        parser.error(f"equivalent.toml is out of date; remove or mend these entries: {old}")
    found = [
        one for file in options.source or tests for one in mutations(file, _source(file))
        if (file, one.was, one.becomes) not in reasons
    ]  # fmt: skip
    verdicts = []
    for mutation, verdict in run(draw(found, options.seed, options.count), tests):
        verdicts.append(verdict)
        print(f"{mutation.file}:{mutation.line}: {verdict}\n    - {mutation.was}", flush=True)
        print(f"    + {mutation.becomes}", flush=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    share = sum(verdict != "survived" for verdict in verdicts) / max(len(verdicts), 1)
    minutes = (used.ru_utime + used.ru_stime) / 60
    print(f"seed {options.seed}: {len(verdicts)} mutations, {share:.0%} caught, {minutes:.0f} min")
    return 0 if share >= GOAL else 1


def related() -> dict[str, list[str]]:
    """Return the paths of the tests of each source file: "a/b" is tests/a/test_b.py.

    The last is `test_golden.py` of the file's package, if there is one.
    """
    table = tomllib.loads((HERE / "related.toml").read_text())
    tests = {}
    for file, names in table.items():
        all_names = [*names.split(), f"{Path(file).parent}/golden"]
        paths = [Path("tests", name) for name in all_names]
        found = [str(path.with_name(f"test_{path.name}.py")) for path in paths]
        tests[file] = found if (ROOT / found[-1]).exists() else found[:-1]
    return tests


def equivalent() -> Reasons:
    """Return the reasons why mutations are equivalent."""
    table = tomllib.loads((HERE / "equivalent.toml").read_text())
    return {(file, was, becomes): why for file, rows in table.items() for was, becomes, why in rows}


def stale(reasons: Reasons) -> list[tuple[str, str, str]]:
    """Return the entries of the list that are no mutations of their files any more."""
    files = {file for file, _, _ in reasons if (ROOT / file).exists()}
    known = {(m.file, m.was, m.becomes) for file in files for m in mutations(file, _source(file))}
    return [key for key in reasons if key not in known]


def run(drawn: list[Mutation], tests_of: dict[str, list[str]]) -> Iterator[tuple[Mutation, str]]:
    """Yield each mutation with its verdict, from a copy of the tree."""
    with tempfile.TemporaryDirectory(prefix="mutants-", ignore_cleanup_errors=True) as place:
        tree = Path(place) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(*_NOT_COPIED))
        for mutation in drawn:
            tests = tests_of[mutation.file]
            verdict = judge(tree, mutation, tests, LIMIT_S)
            if verdict == "survived":
                folders = sorted({str(Path(test).parent) for test in tests})
                verdict = judge(tree, mutation, folders, FOLDERS_LIMIT_S)
            yield mutation, verdict


def judge(tree: Path, mutation: Mutation, tests: list[str], limit_s: float) -> str:
    """Return what the tests say to a mutation of the tree; the tree is as before afterwards."""
    path = tree / mutation.file
    source = path.read_bytes()
    try:
        _write(path, mutation.applied(source))
        code, output = pytest(tree, tests, limit_s)
    finally:
        _write(path, source)
    if code is None:
        return "caught by the time limit"
    if code == 0:
        return "survived"
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", output, re.MULTILINE)
    by = [failed[1].partition("[")[0]] if failed else tests
    if pytest(tree, by, None)[0]:
        raise SystemExit(f"{by} fail without the mutation, too; mend them\n{output}")
    return f"caught by {failed[1] if failed else f'status {code}'}"


def pytest(tree: Path, tests: list[str], limit_s: float | None) -> tuple[int | None, str]:
    """Run tests up to the first that fails; return pytest's status, None beyond the limit."""
    with tempfile.TemporaryFile("w+", errors="replace") as output:
        process = subprocess.Popen(
            [*_PYTEST, *tests], cwd=tree, stdin=subprocess.DEVNULL, stdout=output,
            stderr=subprocess.STDOUT, env={**os.environ, "PYTHONPATH": str(tree),
            "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        try:
            process.wait(timeout=limit_s)
        except subprocess.TimeoutExpired:
            return None, ""
        finally:
            _end_programs_of(tree)
            process.wait()
        output.seek(0)
        return process.returncode, output.read()


def _end_programs_of(tree: Path) -> None:
    """Kill every process that runs the copy, also those in other process groups, or stopped."""
    for environment in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            if f"PYTHONPATH={tree}".encode() in environment.read_bytes():
                os.kill(int(environment.parent.name), signal.SIGKILL)


def _source(file: str) -> bytes:
    return (ROOT / file).read_bytes()


def _write(path: Path, source: bytes) -> None:
    """Write a source file, and forget its byte code: size and time may be those of before."""
    path.write_bytes(source)
    Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)


if __name__ == "__main__":
    sys.exit(main())
