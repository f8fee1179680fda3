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
        for package in ("assets", "controller", "host", "models", "tetris", "orbtouch")
        for suffix in ("py", "toml")
        for path in (ROOT / package).rglob(f"*.{suffix}")
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


# A reader's task, the start page that the front page links to, and where that page leads.
TASKS = {
    "play without hardware": ("play.html", "#play-tetris-with-the-virtual-orb"),
    "play with a phone": ("play.html", "#with-a-phone"),
    "teach a gesture with no hardware": ("teach.html", "#in-the-window"),
    "correct the last touch": ("teach.html", "#corrections-during-play"),
    "run the networks in Python": ("researcher.html", "api.html#networks"),
    "record and train on another skin": ("researcher.html", "#another-skin"),
    "import recordings of another sensor": ("researcher.html", "recording.html#other-sensors"),
    "cite": ("researcher.html", "paper.html#citation"),
    "use an MPR121": ("builder.html", "sensors.html#mpr121"),
    "read a board that prints numbers": ("builder.html", "sensors.html#a-skin-of-your-own"),
    "connect over USB": ("builder.html", "hid.html#usb"),
    "calibrate": ("builder.html", "doctor.html#calibrate"),
    "write a target": ("developer.html", "sensors.html#a-package-of-your-own"),
    "find what to edit": ("developer.html", "architecture.html#what-to-edit"),
}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; links and anchors are checked, and nothing is fetched."""
    if find_spec("zensical") is None:
        pytest.skip("needs the [docs] extra")
    work = tmp_path_factory.mktemp("site")
    shutil.copytree(DOCS, work / "docs")
    for name in ("orbtouch", "controller", "host", "models", "tetris"):
        (work / name).symlink_to(ROOT / name)
    (work / "mkdocs.yml").write_bytes((ROOT / "mkdocs.yml").read_bytes())
    built = subprocess.run(
        [sys.executable, "-m", "zensical", "build", "--strict"],
        cwd=work,
        capture_output=True,
        text=True,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    return work / "site"


def article(site: Path, page: str) -> str:
    """Return what a page says, without the navigation around it."""
    return (site / page).read_text(encoding="utf-8").partition("<article")[2]


def test_the_site_fetches_nothing_and_describes_the_interface(site: Path) -> None:
    home = (site / "index.html").read_text(encoding="utf-8")
    assert not re.search(r'<(?:script|link|img)[^>]+(?:src|href)="https?://', home)
    assert "orbtouch.Recording" in article(site, "api.html")


@pytest.mark.parametrize("task", TASKS)
def test_a_task_is_two_clicks_from_the_front_page(site: Path, task: str) -> None:
    start, heading = TASKS[task]
    page, _, anchor = heading.partition("#")
    assert f'href="{start}"' in article(site, "index.html")
    assert not page or f'href="{heading}"' in article(site, start)
    assert re.search(rf'<h\d id="{anchor}"', article(site, page or start))


def test_terms_and_measurements_are_linked_from_the_front_page(site: Path) -> None:
    for page in ("glossary.html", "measurements.html", "paper.html#citation"):
        assert f'href="{page}"' in article(site, "index.html")


@pytest.mark.parametrize("name", sorted(pages()))
def test_steps_of_a_list_are_indented_for_the_site_as_well(name: str) -> None:
    """Python-Markdown ends a list at a paragraph of fewer than four spaces; others do not."""
    parts = re.split(r"^```.*?^```$", pages()[name], flags=re.MULTILINE | re.DOTALL)
    short = re.compile(r"^(?:\d+\.|-) .*\n(?: .*\n|\n(?= {4}))*(?:\n {1,3}\S| {1,3}```)", re.M)
    assert [found[0] for part in parts if (found := short.search(part))] == []


@pytest.mark.parametrize("name", sorted(pages()))
def test_an_empty_line_ends_an_indented_block_before_the_next_step(name: str) -> None:
    """Python-Markdown takes the step for more of the block's paragraph; others do not."""
    parts = re.split(r"^```.*?^```$", pages()[name], flags=re.MULTILINE | re.DOTALL)
    joined = re.compile(r"\n\n(?: {4}.*\n)+(?:\d+\.|[-*]) .*")
    assert [found[0] for part in parts for found in joined.finditer(part)] == []


def test_every_benchmark_that_a_page_names_can_be_run() -> None:
    named = {
        name for text in pages().values() for name in re.findall(r"tests\.benchmarks\.(\w+)", text)
    }
    assert len(named) > 20
    missing = [one for one in named if not (ROOT / "tests" / "benchmarks" / f"{one}.py").exists()]
    assert missing == []


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
