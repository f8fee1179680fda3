"""The mutation testing of `python -m tests.mutants`, on a project of one function."""

import os
import select
import shutil
import sys
from pathlib import Path

import pytest

from tests.mutants import __main__ as mutants
from tests.mutants.mutate import Mutation, draw, mutations

SOURCE = '''"""Counts down from 3."""

import logging

log = logging.getLogger(__name__)


def late(now_s: int, due_s: int = 10) -> bool:
    """Return whether it is more than 10 seconds late, or not now."""
    if now_s < 0:
        raise ValueError(f"{now_s + 1} is negative" + "!")
    log.info("%d of %d", now_s + 1, 5)
    while now_s > 2 * due_s:
        now_s = now_s - due_s
    return now_s > due_s
'''
TEST = """from late import late


def test_late_is_what_comes_after_it_is_due() -> None:
    assert late(11)
    assert not late(10)
    assert late(31)
"""
TESTS = ["tests/test_late.py"]


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A project to mutate."""
    (tmp_path / "tests").mkdir()
    (tmp_path / "late.py").write_text(SOURCE)
    (tmp_path / "tests" / "test_late.py").write_text(TEST)
    shutil.copy(mutants.ROOT / "tests" / "conftest.py", tmp_path / "tests")
    return tmp_path


def mutation(was: str, becomes: str) -> Mutation:
    found = mutations("late.py", SOURCE.encode())
    return next(one for one in found if (one.was, one.becomes) == (was, becomes))


HARMFUL = mutation("return now_s > due_s", "return (now_s >= due_s)")
UNSEEN = mutation("if now_s < 0:", "if now_s < -1:")


def test_code_is_mutated_and_what_only_people_read_is_not() -> None:
    assert {one.becomes for one in mutations("late.py", SOURCE.encode())} == {
        "def late(now_s: int, due_s: int = 11) -> bool:",
        "def late(now_s: int, due_s: int = 9) -> bool:",
        "if not (now_s < 0):",
        "if (now_s <= 0):",
        "if (now_s >= 0):",
        "if now_s < -1:",
        "if now_s < 1:",
        "while (now_s <= 2 * due_s):",
        "while (now_s >= 2 * due_s):",
        "while now_s > 1 * due_s:",
        "while now_s > 3 * due_s:",
        "while now_s > (2 / due_s):",
        "now_s = (now_s + due_s)",
        "return not (now_s > due_s)",
        "return (now_s <= due_s)",
        "return (now_s >= due_s)",
    }


@pytest.mark.parametrize(
    ("source", "becomes"),
    [
        ("x = a and not b\n", {"x = (a or not b)", "x = a and (b)"}),
        ("x = a is not None\n", {"x = (a is None)"}),
        ("x = (a) in (b)\n", {"x = (a not in b)"}),
        ("x = a if b else c\n", {"x = a if not (b) else c"}),
        ("x = y[n:]\n", {"x = y[None:]"}),
        ("x += 2\n", {"x -= 2", "x += 3", "x += 1"}),
        ("x = True\n", {"x = False"}),
        ("def f() -> list[int]:\n    return a\n", {"return (a)[:0]"}),
        ("def f() -> int | None:\n    return a\n", {"return None"}),
        ("class C:\n    __slots__ = ('x', 1)\n    x: Literal[1]\n", set()),
        ("assert x > 1\nKind = Number | Field\nz = cast(A | B, y)\n", set()),
        ("for x in zip(a, b, strict=True):\n    f'{x + 1}'\n", set()),
        ("Thread(target=f, daemon=True).join(timeout=5.0)\n", set()),
    ],
)
def test_each_kind_of_mutation(source: str, becomes: set[str]) -> None:
    assert {one.becomes for one in mutations("x.py", source.encode())} == becomes


def test_a_seed_draws_the_same_mutations_each_of_another_line() -> None:
    found = mutations("late.py", SOURCE.encode())
    drawn = draw(found, seed=7, count=4)
    assert drawn == draw(found, seed=7, count=4)
    assert len({one.line for one in drawn}) == 4
    assert len(draw(found, seed=7, count=99)) == len({one.line for one in found})


def test_a_mutation_that_a_test_notices_is_caught_by_that_test(tree: Path) -> None:
    verdict = mutants.judge(tree, HARMFUL, TESTS, 60.0)
    assert verdict == "caught by tests/test_late.py::test_late_is_what_comes_after_it_is_due"
    assert mutants.judge(tree, UNSEEN, TESTS, 60.0) == "survived"
    assert (tree / "late.py").read_text() == SOURCE


def test_a_mutation_that_never_ends_is_caught(tree: Path) -> None:
    endless = mutation("now_s = now_s - due_s", "now_s = (now_s + due_s)")
    assert mutants.judge(tree, endless, TESTS, 3.0) == "caught by the time limit"


def test_a_stopped_process_of_another_session_does_not_outlive_its_tests(tree: Path) -> None:
    (tree / "tests" / "test_late.py").write_text(
        "import os, pathlib, signal, subprocess\n"
        "def test_it() -> None:\n"
        f"    child = subprocess.Popen([{sys.executable!r}, '-c', 'input()'],\n"
        "        stdin=subprocess.PIPE, start_new_session=True)\n"
        "    child.send_signal(signal.SIGSTOP)\n"
        "    pathlib.Path('pid').write_text(str(child.pid))\n"
        "    os._exit(0)\n"
    )
    mutants.judge(tree, HARMFUL, TESTS, 60.0)
    try:
        process = os.pidfd_open(int((tree / "pid").read_text()))
    except ProcessLookupError:
        return
    try:
        assert select.select([process], [], [], 10.0)[0]  # ends when the kernel comes to it
    finally:
        os.close(process)


def test_an_entry_for_a_line_that_is_no_more_is_out_of_date(
    tree: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mutants, "ROOT", tree)
    current = ("late.py", UNSEEN.was, UNSEEN.becomes)
    old = ("late.py", "if now_s < 5:", "if now_s < 4:")
    assert mutants.stale({current: "no time is negative", old: "so it was once"}) == [old]
    monkeypatch.setattr(mutants, "equivalent", lambda: {old: "so it was once"})
    with pytest.raises(SystemExit):
        mutants.main([])
    assert "if now_s < 5:" in capsys.readouterr().err


def test_a_test_that_fails_without_the_mutation_ends_the_run(tree: Path) -> None:
    (tree / "tests" / "test_late.py").write_text("def test_it() -> None:\n    assert False\n")
    with pytest.raises(SystemExit, match="fail without the mutation, too"):
        mutants.judge(tree, HARMFUL, TESTS, 60.0)


def test_equivalent_mutations_are_not_drawn(
    tree: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mutants, "ROOT", tree)
    monkeypatch.setattr(mutants, "related", lambda: {"late.py": TESTS})
    every = mutations("late.py", SOURCE.encode())
    others = {(m.file, m.was, m.becomes): "not tried here" for m in every if m != HARMFUL}
    monkeypatch.setattr(mutants, "equivalent", lambda: others)
    assert mutants.main([]) == 0
    said = capsys.readouterr().out
    assert "caught by tests/test_late.py::test_late" in said
    assert "1 mutations, 100% caught" in said


def test_all_that_the_tables_name_exists() -> None:
    related = mutants.related()
    tests = {path for paths in related.values() for path in paths}
    assert [path for path in (*related, *tests) if not (mutants.ROOT / path).exists()] == []
    assert mutants.stale(mutants.equivalent()) == []
