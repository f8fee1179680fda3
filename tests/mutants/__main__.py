"""Mutation testing: make small mistakes in a copy of the code, one by one, and run the tests.

    python -m tests.mutants [--seed N] [--count 60] [--resume FILE] [SOURCE ...]

Each mutation runs the tests that `related.toml` names for its file, up to the first that fails; a
run that takes five times as long as usual counts as caught. `equivalent.toml` lists the mutations
that no test can catch. With --resume the verdicts are kept in FILE, and mutations that it calls
caught are not run again. It needs POSIX. The exit status is 0 if 90 % are caught.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, NamedTuple

from .mutate import Mutation, draw, mutations

ROOT: Final = Path(__file__).parent.parent.parent
HERE: Final = Path(__file__).parent
GOAL: Final = 0.9  # caught, of those that are not equivalent
SLOWER: Final = 5  # times as long as without the mutation: it hangs
GRACE_S: Final = 20.0  # on top of that, for a machine that is busy
MEMORY: Final = 8 << 30  # bytes of address space of a test run
_PYTEST: Final = (
    *(sys.executable, "-m", "pytest", "-x", "-n0", "-p", "no:cacheprovider"),
    "--hypothesis-profile=mutants",  # see tests/conftest.py
)
_NOT_COPIED: Final = (".git", ".venv", "__pycache__", ".*_cache", ".hypothesis")
_FAILED: Final = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)

Key = tuple[str, str, str]  # file, what its lines were, what they become


class Result(NamedTuple):
    """What became of a mutation: "survived", "caught by ..." or "equivalent: ..."."""

    mutation: Mutation
    verdict: str


def main(argv: list[str] | None = None) -> int:
    """Run the mutations that the command line asks for; return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.mutants", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("source", nargs="*", help="files to mutate (default: all of related.toml)")
    parser.add_argument("--seed", type=int, default=1, help="of the draw (default: %(default)s)")
    parser.add_argument("--count", type=int, default=60, help="mutations (default: %(default)s)")
    parser.add_argument("--resume", type=Path, metavar="FILE", help="keep the verdicts in FILE")
    options = parser.parse_args(argv)
    tests = related()
    unknown = set(options.source) - set(tests)
    if unknown:
        parser.error(f"related.toml names no tests for {sorted(unknown)[0]}; add a line there")
    found = {file: mutations(file, (ROOT / file).read_bytes()) for file in options.source or tests}
    drawn = draw([one for file in found.values() for one in file], options.seed, options.count)
    reasons = equivalent()
    results: list[Result] = []
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        results.extend(run(drawn, tests, reasons, options.resume))
    except KeyboardInterrupt:
        print(f"interrupted after {len(results)} of {len(drawn)}", file=sys.stderr)
    print(report(results))
    for file, was, becomes in stale(reasons, found):
        print(f"equivalent.toml is out of date: {file} has no {was!r} -> {becomes!r}")
    if len(results) < len(drawn):
        return 130
    return 0 if score(results) >= GOAL else 1


def related() -> dict[str, list[str]]:
    """Return the names of the tests of each source file."""
    return tomllib.loads((HERE / "related.toml").read_text())


def equivalent() -> dict[Key, str]:
    """Return the reasons why mutations are equivalent."""
    listed = tomllib.loads((HERE / "equivalent.toml").read_text()).get("mutation", [])
    return {(each["file"], each["was"], each["becomes"]): each["why"] for each in listed}


def stale(reasons: dict[Key, str], found: dict[str, list[Mutation]]) -> list[Key]:
    """Return the entries of the list that are no mutations of their files any more."""
    known = {_key(one) for file in found.values() for one in file}
    return [key for key in reasons if key[0] in found and key not in known]


def test_file(name: str) -> str:
    """Return the path of a test file of `related.toml`: "a/b" is tests/a/test_b.py."""
    *folders, module = name.split("/")
    return "/".join(("tests", *folders, f"test_{module}.py"))


def run(
    drawn: list[Mutation],
    tests_of: dict[str, list[str]],
    reasons: dict[Key, str],
    resume: Path | None = None,
) -> Iterator[Result]:
    """Yield the result of each mutation, and show the progress on standard error."""
    kept = _kept(resume)
    start_s = time.monotonic()
    with copied(ROOT) as tree:
        clean_s: dict[str, float] = {}  # seconds that the tests of a file take
        for number, mutation in enumerate(drawn, 1):
            verdict = kept.get((*_key(mutation), mutation.line), "")
            if why := reasons.get(_key(mutation)):
                verdict = f"equivalent: {why}"
            elif not verdict.startswith("caught"):
                tests = [test_file(name) for name in tests_of[mutation.file]]
                if mutation.file not in clean_s:
                    clean_s[mutation.file] = _clean_s(tree, tests)
                verdict = judge(tree, mutation, tests, clean_s[mutation.file] * SLOWER + GRACE_S)
                if resume is not None:
                    with resume.open("a") as file:
                        file.write(json.dumps([*_key(mutation), mutation.line, verdict]) + "\n")
            left_min = (time.monotonic() - start_s) / number * (len(drawn) - number) / 60
            print(
                f"{number}/{len(drawn)} {mutation.file}:{mutation.line} {verdict}"
                f" (about {left_min:.0f} min left)",
                file=sys.stderr,
            )
            yield Result(mutation, verdict)


@contextmanager
def copied(root: Path) -> Iterator[Path]:
    """Give a copy of the tree, which is removed afterwards."""
    caches = shutil.ignore_patterns(*_NOT_COPIED)

    def ignored(folder: str, names: list[str]) -> set[str]:
        return caches(folder, names) | ({"recordings"} if Path(folder) == root else set())

    with tempfile.TemporaryDirectory(prefix="mutants-", ignore_cleanup_errors=True) as place:
        tree = Path(place) / "tree"
        shutil.copytree(root, tree, ignore=ignored)
        yield tree


def judge(tree: Path, mutation: Mutation, tests: list[str], limit_s: float) -> str:
    """Return what the tests say to a mutation of the tree; the tree is as before afterwards."""
    path = tree / mutation.file
    source = path.read_bytes()
    try:
        _write(path, mutation.edit.applied(source))
        code, output = _pytest(tree, tests, limit_s)
    finally:
        _write(path, source)
    if code is None:
        return "caught by the time limit"
    failed = _FAILED.search(output)
    return "survived" if code == 0 else f"caught by {failed[1] if failed else f'status {code}'}"


def score(results: list[Result]) -> float:
    """Return how many of those that are not equivalent are caught, 0 to 1."""
    counted = [verdict for _, verdict in results if not verdict.startswith("equivalent")]
    return sum(verdict != "survived" for verdict in counted) / max(len(counted), 1)


def report(results: list[Result]) -> str:
    """Return the table of the results and the score."""
    lines = []
    for mutation, verdict in sorted(results):
        lines += [f"{mutation.file}:{mutation.line}: {verdict}"]
        lines += [f"    - {mutation.was}", f"    + {mutation.becomes}"]
    kinds = [verdict.split(maxsplit=1)[0].rstrip(":") for _, verdict in results]
    counts = ", ".join(f"{kinds.count(k)} {k}" for k in ("caught", "survived", "equivalent"))
    lines += ["", f"{len(results)} mutations: {counts}; {score(results):.0%} caught"]
    return "\n".join(lines)


def _key(mutation: Mutation) -> Key:
    return mutation.file, mutation.was, mutation.becomes


def _kept(resume: Path | None) -> dict[tuple[str, str, str, int], str]:
    """Return the verdicts of an earlier run."""
    if resume is None or not resume.exists():
        return {}
    rows = [json.loads(line) for line in resume.read_text().splitlines()]
    return {(file, was, becomes, line): verdict for file, was, becomes, line, verdict in rows}


def _clean_s(tree: Path, tests: list[str]) -> float:
    """Return how long tests take that must pass, seconds."""
    start_s = time.monotonic()
    code, output = _pytest(tree, tests, None)
    if code != 0:
        raise SystemExit(f"{' '.join(tests)} fail without any mutation; mend them first\n{output}")
    return time.monotonic() - start_s


def _write(path: Path, source: bytes) -> None:
    """Write a source file, and forget its byte code: size and time may be those of before."""
    path.write_bytes(source)
    Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)


def _pytest(tree: Path, tests: list[str], limit_s: float | None) -> tuple[int | None, str]:
    """Run tests up to the first that fails; return pytest's status, None beyond the limit."""
    with subprocess.Popen(
        [*_PYTEST, *tests],
        cwd=tree,
        env={**os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)),
    ) as process:
        try:
            output, _ = process.communicate(timeout=limit_s)
        except subprocess.TimeoutExpired:
            return None, ""
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    return process.returncode, output


if __name__ == "__main__":
    sys.exit(main())
