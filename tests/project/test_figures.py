"""Figures of the documentation are those that were stored, and of the bundle that ships."""

import json
import re
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.benchmarks import docs, docs_parts, stored
from tests.benchmarks.docs_parts import Part
from tests.benchmarks.docs_tables import BLOCKS, Block
from tests.benchmarks.stored import FOLDER, Stored
from tests.support import ROOT
from tests.support.pytest_types import Patch

PAGES = [
    path
    for path in (*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "models" / "README.md")
    if "<!-- " in path.read_text(encoding="utf-8")
]
TINY = Part("tiny", ('python -c \'print("first"); print("[1, 2]")\'',))
PAGE = "# A\n\n<!-- figures: tiny -->\n\nold\n\n<!-- /figures -->\n\nafter\n"
SHOWN = Block("tiny", "page.md", ("tiny",), lambda found: f"{found['tiny'].results}")


@pytest.mark.parametrize("block", BLOCKS, ids=lambda one: one.name)
def test_a_page_shows_what_was_stored_and_of_what_ships(block: Block) -> None:
    """After another bundle ships: python -m tests.benchmarks.docs."""
    if block.name == "figure7" and find_spec("matplotlib") is None:
        pytest.skip("needs the [train] extra")
    assert docs.problem(block) is None


def test_every_block_of_every_page_is_rendered() -> None:
    found = {
        (path.relative_to(ROOT).as_posix(), name)
        for path in PAGES
        for name in re.findall(r"<!-- figures: ([\w-]+) -->", path.read_text(encoding="utf-8"))
    }
    assert found == {(block.page, block.name) for block in BLOCKS}


def test_no_stored_result_names_a_path_or_is_left_over() -> None:
    files = sorted(FOLDER.glob("*.json"))
    assert {path.stem for path in files} == {part.name for part in docs_parts.PARTS}
    for path in files:
        found = json.loads(path.read_text(encoding="utf-8"))
        assert not re.search(r"/(home|work|tmp|root|Users)\b", json.dumps(found)), path.name


def test_every_measured_section_is_current_or_a_dated_study() -> None:
    """A table of figures has its command's block, or its section or chapter says *Study, date*."""
    text = (ROOT / "docs" / "measurements.md").read_text(encoding="utf-8")
    bare = []
    for chapter in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        intro, *sections = re.split(r"^### ", chapter, flags=re.MULTILINE)
        for section in (intro, *sections):
            typed = stored.BLOCK.sub("", section)
            measured = re.search(r"^ *\|.*\d[\d.,]* *(?:%|s|ms|µs)? *\|", typed, re.MULTILINE)
            dated = re.search(r"^\*Study, .*\d+ \w+ 20\d\d, ", f"{intro}\n{section}", re.MULTILINE)
            if measured and not dated:
                bare.append(section.partition("\n")[0])
    assert bare == []


@pytest.fixture
def page(tmp_path: Path, monkeypatch: Patch) -> Path:
    """A page with a block, rendered, of a small part that was measured."""
    monkeypatch.setattr(docs, "PARTS", (TINY,))
    monkeypatch.setattr(docs, "BLOCKS", (SHOWN,))
    docs.measure([TINY], tmp_path)
    (tmp_path / "page.md").write_text(PAGE, encoding="utf-8")
    docs.render(tmp_path, tmp_path)
    assert problem(tmp_path) is None
    return tmp_path / "page.md"


def problem(folder: Path) -> str | None:
    return docs.problem(SHOWN, folder, folder)


def test_a_block_is_result_and_caption_and_nothing_around_it_changes(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    before, _, after = text.partition("[1, 2]")
    assert before == "# A\n\n<!-- figures: tiny -->\n\n"
    assert after.endswith("*\n\n<!-- /figures -->\n\nafter\n")
    assert docs_parts.measured(TINY)[:8] in after
    assert "python -c" in after


def test_a_value_changed_by_hand_is_found_in_the_page_and_in_the_result(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    page.write_text(text.replace("[1, 2]", "[1, 3]"), encoding="utf-8")
    assert problem(page.parent) == "differs from its stored result"
    path = stored.path_of("tiny", page.parent)
    result = path.read_text(encoding="utf-8")
    path.write_text(result.replace("[1, 2]", "[1, 3]"), encoding="utf-8")
    assert problem(page.parent) == "tiny is missing, or changed by hand"


def test_a_result_of_another_bundle_is_found_and_measured_again(
    page: Path, monkeypatch: Patch
) -> None:
    monkeypatch.setattr(docs_parts, "measured", lambda _: "f00d" * 16)
    assert "of bundle" in str(problem(page.parent))
    docs.measure([TINY], page.parent)
    docs.render(page.parent, page.parent)
    assert problem(page.parent) is None
    assert "`f00df00d`" in page.read_text(encoding="utf-8")


def test_what_is_stored_is_not_measured_again(page: Path, monkeypatch: Patch) -> None:
    ran: list[str] = []

    def measure(part: Part) -> Stored:
        ran.append(part.name)
        return Stored(part.name, part.command, "2026-01-01", "", docs_parts.measured(part), 0.0, [])

    monkeypatch.setattr(docs_parts, "measure", measure)
    other = replace(TINY, name="other")
    docs.measure([TINY, other], page.parent)
    assert ran == ["other"]


def test_a_bundle_that_is_replaced_meanwhile_spoils_the_measurement(monkeypatch: Patch) -> None:
    prints = iter(["one", "two"])
    monkeypatch.setattr(docs_parts, "measured", lambda _: next(prints))
    with pytest.raises(docs_parts.PartError, match="replaced meanwhile"):
        docs_parts.measure(TINY)


def test_a_command_that_fails_is_named() -> None:
    with pytest.raises(docs_parts.PartError, match="ended with status 3"):
        docs_parts.measure(Part("bad", ("python -c 'raise SystemExit(3)'",)))
