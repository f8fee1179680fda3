"""The report of an information study: one page that needs no network, drawings inside it."""

from collections.abc import Mapping
from html import escape
from importlib import resources
from pathlib import Path
from typing import Any, Final

from models import text as words
from models import user_files
from models.studies.information import tables
from models.studies.information.histogram import BITS, PAPER_INFORMATION
from models.studies.information.results import of_set, sets_of

PAGE: Final = "information.html"
TITLE: Final = "How much an orb can say"

Found = Mapping[str, Any]

STATES: Final = (
    (
        "What the paper counts",
        "figure9",
        "section_6",
        "Section 6 puts each sensor’s signal into 25 bins. Its figures are nats although they are "
        "called bits. It scales each gesture on its own, which tells the bins what the label is, "
        "and it records class by class, so that whatever drifts agrees with the labels: moved in "
        "time against the signals, they still seem to be known.",
    ),
    (
        "How fine the bins are",
        "information-bins",
        "bins",
        "The entropy of a signal follows the bins and says nothing about gestures. What a sensor "
        "says about the label hardly does, until chance fills the bins.",
    ),
    (
        "What a window says",
        "information-window",
        "windows",
        "Intervals are 95 %, by drawing whole touches anew. An estimate by neighbours is right "
        "where density is even around each point, and too low in many dimensions. A bound (≥) "
        "holds whatever the data are like, on days that nothing was learned from: a better "
        "classifier only raises it.",
    ),
    ("What a gesture says on another day", "", "gestures", ""),
    (
        "What more of the sensor would bring",
        "information-growth",
        "grown",
        "Each point is the held-out bound of two layers, all else equal.",
    ),
    (
        "What a press says about its place",
        "",
        "places",
        "A whole number of places could be told apart without error if their number is two to the "
        "power of this.",
    ),
    (
        "What playing carries",
        "capacity",
        "games",
        "A gesture is one use of a channel: what came out, given what was meant, and how long it "
        "took, the pause to look included. Commands are taken to be independent of one another; "
        "in a game they are not, so a game says less than this.",
    ),
    ("How large a vocabulary is worth teaching", "", "vocabularies", ""),
    (
        "Whether estimators may be believed",
        "",
        "checked",
        "10,000 points whose information is known. The goal is 5 % or 0.02 nats, whichever is "
        "larger, up to five dimensions, and 15 % beyond.",
    ),
)


def write(folder: Path, found: Found) -> Path:
    """Write the page beside its drawings, and return its path."""
    path = folder / PAGE
    user_files.write_text(path, html(found, folder))
    return path


def html(found: Found, folder: Path) -> str:
    """Return the page; drawings are taken from a folder, where they are there."""
    style = resources.files("models.reports").joinpath("style.css").read_text(encoding="utf-8")
    parts = []
    for title, drawing, table, below in STATES:
        shown = getattr(tables, table)(found)
        if shown:
            drawn = words.figure(_inline(folder / f"{drawing}.svg")) if drawing else ""
            parts.append(words.section(title, words.paragraph(escape(below)), drawn, _html(shown)))
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{TITLE}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{style}{_OWN}</style></head>\n<body><h1>{TITLE}</h1>{_lead(found)}\n"
        f"{chr(10).join(parts)}\n"
        "<footer>Written by models information. This file needs nothing else.</footer>"
        "</body></html>\n"
    )


# The drawings are dark on white, whatever the page is.
_OWN: Final = "figure svg.drawn { background: #fff; border-radius: 8px; }"


def _lead(found: Found) -> str:
    """Return the headline figures."""
    names = sets_of(found)
    cards = []
    for name in names:
        if part := of_set(found, name, "classifier"):
            best = max((row["gesture"] for row in part["rows"].values()), key=lambda one: one[0])
            low, high = (f"{one * BITS:.2f}" for one in best[1:])
            cards.append(
                words.card(
                    f"{best[0] * BITS:.2f} bits",
                    f"a gesture, on another day: {escape(name)}",
                    f"of {part['h_gesture'] * BITS:.2f}; 95 %: {low}–{high}",
                )
            )
        elif part := of_set(found, name, "histogram"):
            value = part["mean"]["information_corrected"]
            cards.append(
                words.card(
                    f"{value * BITS:.2f} bits",
                    f"a sensor about the label: {escape(name)}",
                    f"the paper: {PAPER_INFORMATION * BITS:.2f}",
                )
            )
    for name, one in found["games"].items():
        cards.append(
            words.card(f"{one['played_per_min'] * BITS:.0f} bits", f"a minute of play: {name}")
        )
    about = words.joined([escape(name) for name in names])
    lead = f'<p class="lead">Measured on {about}.</p>' if about else ""
    return f'{lead}<div class="cards">{"".join(cards)}</div>'


def _inline(path: Path) -> str:
    """Return a drawing as part of the page; "": there is none."""
    if not path.exists():
        return ""
    text = path.read_text(encoding="utf-8")
    drawn = text[text.index("<svg") :].replace("<svg", '<svg class="drawn" role="img"', 1)
    # Names inside one drawing must not meet those of another.
    for mark in ('id="', 'xlink:href="#', "url(#"):
        drawn = drawn.replace(mark, f"{mark}{path.stem}-")
    return drawn


def _html(markdown: str) -> str:
    """Return Markdown tables, and sentences between them, as HTML."""
    made = []
    for block in markdown.split("\n\n"):
        lines = block.splitlines()
        if not lines[0].startswith("|"):
            made.append(words.paragraph(escape(block)))
            continue
        cells = [[escape(cell.strip()) for cell in line.strip("|").split("|")] for line in lines]
        made.append(words.table(cells[0], cells[2:]))
    return "".join(made)
