"""Report of an information study: drawings, and one HTML page with them inside."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from matplotlib.figure import Figure

from models.formatting import joined
from models.reports import page
from models.reports.drawing import save, styled, svg
from models.reports.tables import Table
from models.results import storage
from models.studies.information import figures, results, tables
from models.studies.information.histogram import BITS, PAPER_INFORMATION

PAGE: Final = "information.html"
TITLE: Final = "Information in the signals of an orb"

Found = Mapping[str, Any]

# Title, drawing ("": none), table and explanation of each section.
SECTIONS: Final[tuple[tuple[str, str, Callable[[Found], Table], str], ...]] = (
    (
        "Statistics of the paper",
        "figure9",
        tables.section_6,
        "Section 6 puts each sensor’s signal into 25 bins. Its figures are nats although they are "
        "called bits. It scales each gesture on its own, which leaks the label into the bins, "
        "and it records class by class, so that drift agrees with the labels: shifted in time "
        "against the signals, they still seem to be related.",
    ),
    (
        "Number of bins",
        "",
        tables.bins,
        "The entropy of a signal depends on the bins, not on gestures. The information of a sensor "
        "about the label hardly depends on them, until chance fills the bins.",
    ),
    (
        "Information of a window about its label",
        "information-window",
        tables.windows,
        "Intervals are 95 %, by resampling whole touches. An estimate by neighbours is right "
        "where density is even around each point, and too low in many dimensions. A bound (≥) "
        "holds whatever the data are like, on days that were not trained on: a better "
        "classifier only raises it.",
    ),
    ("Information of a gesture on another day", "", tables.gestures, ""),
    (
        "Information of a press about its place",
        "",
        tables.places,
        "Two to the power of this is the number of places that could be told apart without error.",
    ),
    (
        "Information of play",
        "capacity",
        tables.games,
        "A gesture is one use of a channel from intended to recognised commands; its duration "
        "includes the pause before the next. Commands are taken to be independent of one another; "
        "in a game they are not, so a game carries less than this.",
    ),
    ("Size of the vocabulary", "", tables.vocabulary, ""),
)


def write(folder: Path, found: Found) -> list[Path]:
    """Write the drawings as SVG and PNG and the page with them inside, and return their paths."""
    drawn = figures.draw(found)
    paths = [
        save(figure, folder / f"{name}.{kind}")
        for name, figure in drawn.items()
        for kind in ("svg", "png")
    ]
    path = folder / PAGE
    storage.write_text(path, _page(found, drawn))
    return [*paths, path]


@styled
def _page(found: Found, drawn: Mapping[str, Figure]) -> str:
    """Return the page with drawings by name."""
    sections = []
    for title, drawing, of, below in SECTIONS:
        if (table := of(found)).rows:
            shown = [page.Drawing(svg(drawn[drawing], title))] if drawing in drawn else []
            sections.append(page.Section(title, [*([below] if below else []), *shown, table]))
    names = results.sets_with(found)
    lead = f"Measured on {joined(names)}." if names else ""
    headlines = list(_headlines(found))
    return page.study(TITLE, sections, lead=lead, headlines=headlines, command="models information")


def _headlines(found: Found) -> Iterator[tuple[str, str, str]]:
    """Yield the headline figures: value, meaning, and a line below."""
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
