"""HTML report of an information study: one page with its drawings inside, without network use."""

from collections.abc import Callable, Iterator, Mapping
from importlib import resources
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from models import user_files
from models.studies.information import results, tables
from models.studies.information.histogram import BITS, PAPER_INFORMATION

PAGE: Final = "information.html"
TITLE: Final = "How much an orb can say"

Found = Mapping[str, Any]
Card = tuple[str, str, str]  # a figure, its meaning, and a line below

# Title, drawing ("": none), table and explanation of each section.
SECTIONS: Final[tuple[tuple[str, str, Callable[[Found], tables.Table], str], ...]] = (
    (
        "What the paper counts",
        "figure9",
        tables.section_6,
        "Section 6 puts each sensor’s signal into 25 bins. Its figures are nats although they are "
        "called bits. It scales each gesture on its own, which tells the bins what the label is, "
        "and it records class by class, so that whatever drifts agrees with the labels: moved in "
        "time against the signals, they still seem to be known.",
    ),
    (
        "How fine the bins are",
        "",
        tables.bins,
        "The entropy of a signal follows the bins and says nothing about gestures. What a sensor "
        "says about the label hardly does, until chance fills the bins.",
    ),
    (
        "What a window says",
        "information-window",
        tables.windows,
        "Intervals are 95 %, by resampling whole touches. An estimate by neighbours is right "
        "where density is even around each point, and too low in many dimensions. A bound (≥) "
        "holds whatever the data are like, on days that were not trained on: a better "
        "classifier only raises it.",
    ),
    ("What a gesture says on another day", "", tables.gestures, ""),
    (
        "What a press says about its place",
        "",
        tables.places,
        "A whole number of places could be told apart without error if their number is two to the "
        "power of this.",
    ),
    (
        "What playing carries",
        "capacity",
        tables.games,
        "A gesture is one use of a channel: what came out, given what was meant, and how long it "
        "took, the pause to look included. Commands are taken to be independent of one another; "
        "in a game they are not, so a game says less than this.",
    ),
    ("How large a vocabulary is worth teaching", "", tables.vocabulary, ""),
)


def write(folder: Path, found: Found) -> Path:
    """Write the page beside its drawings, which it includes, and return its path."""
    environment = Environment(
        loader=PackageLoader("models.studies.information", "."), autoescape=True
    )
    style = resources.files("models.reports").joinpath("style.css").read_text(encoding="utf-8")
    page = environment.get_template("report.html").render(
        title=TITLE,
        style=Markup(style),
        sets=results.sets_with(found),
        cards=list(_cards(found)),
        sections=[
            (heading, below, _inline(folder / f"{drawing}.svg"), table)
            for heading, drawing, of, below in SECTIONS
            if (table := of(found)).rows
        ],
    )
    path = folder / PAGE
    user_files.write_text(path, page)
    return path


def _cards(found: Found) -> Iterator[Card]:
    """Yield the headline figures."""
    for name in results.sets_with(found):
        if part := results.value(found, name, "classifier"):
            best = max((row["gesture"] for row in part["rows"].values()), key=lambda one: one[0])
            bits, low, high = (f"{one * BITS:.2f}" for one in best)
            below = f"of {part['h_gesture'] * BITS:.2f}; 95 %: {low}–{high}"
            yield f"{bits} bits", f"a gesture, on another day: {name}", below
        elif mean := results.value(found, name, "histogram", "mean"):
            bits, paper = (
                f"{one * BITS:.2f}" for one in (mean["information_corrected"], PAPER_INFORMATION)
            )
            yield f"{bits} bits", f"a sensor about the label: {name}", f"the paper: {paper}"
    for name, one in found["games"].items():
        yield f"{one['played_per_min'] * BITS:.0f} bits", f"a minute of play: {name}", ""


def _inline(path: Path) -> Markup:
    """Return a drawing as an element of the page, its identities unique; "" without a file."""
    if not path.exists():
        return Markup("")
    text = path.read_text(encoding="utf-8")
    drawn = text[text.index("<svg") :].replace("<svg", '<svg class="drawn" role="img"', 1)
    for mark in ('id="', 'xlink:href="#', "url(#"):
        drawn = drawn.replace(mark, f"{mark}{path.stem}-")
    return Markup(drawn)
