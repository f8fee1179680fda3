"""The documentation: one site, its links, and sentences that the program really says."""

import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import orbtouch

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
_LINK = re.compile(r"\]\(([^)#\s]+\.md)")
_STRINGS = re.compile(r'"\s*\n\s*f?r?"')  # literals that Python joins


def pages() -> dict[str, str]:
    return {path.name: path.read_text(encoding="utf-8") for path in DOCS.glob("*.md")}


def test_troubleshooting_quotes_what_the_program_says() -> None:
    said = " ".join(
        _STRINGS.sub("", path.read_text(encoding="utf-8"))
        for package in ("controller", "host", "models", "tetris", "orbtouch")
        for path in (ROOT / package).rglob("*.py")
    )
    quoted = re.findall(r'^\| "([^"]+)" \|', pages()["troubleshooting.md"], re.MULTILINE)
    assert len(quoted) > 20
    assert [text for text in quoted if text not in said] == []


def test_every_page_is_two_links_from_the_front_page() -> None:
    """Five kinds of readers start at the front page; none searches longer than two clicks."""
    found = pages()
    first = set(_LINK.findall(found["README.md"]))
    second = {link for page in first for link in _LINK.findall(found[page])}
    assert {"play.md", "teach.md", "researcher.md", "builder.md", "developer.md"} <= first
    assert set(found) - {"README.md"} <= first | second


def test_every_page_is_in_the_navigation() -> None:
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2]
    assert sorted(re.findall(r"[\w-]+\.md", navigation)) == sorted(pages())


@pytest.mark.skipif(find_spec("zensical") is None, reason="needs the [docs] extra")
def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    """Links and anchors are checked; nothing is fetched."""
    shutil.copytree(DOCS, tmp_path / "docs")
    for name in ("orbtouch", "controller", "host", "models", "tetris"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "mkdocs.yml").write_bytes((ROOT / "mkdocs.yml").read_bytes())
    built = subprocess.run(
        [sys.executable, "-m", "zensical", "build", "--strict"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    home = (tmp_path / "site" / "index.html").read_text(encoding="utf-8")
    assert not re.search(r'<(?:script|link|img)[^>]+(?:src|href)="https?://', home)
    assert "orbtouch.Recording" in (tmp_path / "site" / "api.html").read_text(encoding="utf-8")


def test_the_citation_has_the_version_of_the_program() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(r"^version: (\S+)$", text, re.MULTILINE)[1] == orbtouch.__version__  # type: ignore[index]


def test_the_readme_fits_and_has_both_commands() -> None:
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 120
    assert any(line.strip().endswith("&& .venv/bin/host") for line in lines[:20])
    assert any(line.strip().endswith("&& .venv/bin/pytest") for line in lines[:25])


def test_no_page_links_to_what_the_site_lacks() -> None:
    assert [name for name, text in pages().items() if "](../" in text] == []
