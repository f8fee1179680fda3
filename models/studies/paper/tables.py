"""Tables of the paper's figures and section 6 as Markdown, from the results of `study.measure`.

Information is in nats there, and shown in bits. Intervals are [value, low, high].
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from models.formatting import NONE, number, percent, points
from models.reports.tables import Table
from models.studies.paper.section6 import (
    BITS,
    PAPER_H_Y,
    PAPER_H_Z,
    PAPER_INFORMATION,
    PAPER_STATIC,
)

UNIFORM: Final = math.log(5)  # nats: the paper prints it in bits, 2.32
# Row, the paper's figure in nats, and key of ours.
SECTION_6: Final[tuple[tuple[str, float | None, str], ...]] = (
    ("H(y) of equally frequent labels", UNIFORM, "h_uniform"),
    ("H(y), labels", PAPER_H_Y, "h_y"),
    ("H(z), a sensor", PAPER_H_Z, "h_z"),
    ("I(z; y), a sensor, the paper’s scaling", PAPER_INFORMATION, "information"),
    ("I(z; y), one scaling for all gestures", None, "information_global"),
    ("the same, bias removed", None, "information_corrected"),
    ("… least informative sensor", None, "least"),
    ("… most informative sensor", None, "most"),
    ("labels shuffled (no relation)", None, "null"),
    ("labels shifted in time (drift only)", None, "null_slow"),
)
BOUNDS: Final[dict[str, Callable[[Mapping[str, Any]], str]]] = {
    "entropy of the label of a window": lambda of: _bits(of["h_y"]),
    "≥ I(window; label)": lambda of: interval(of["window"]),
    "entropy of a whole gesture": lambda of: _bits(of["h_gesture"]),
    "≥ I(gesture; label)": lambda of: interval(of["gesture"]),
    "gestures": lambda of: str(of["gestures"]),
}
RECIPES: Final = {"paper": "the paper’s", "default": "ours"}
# Name in the tables, and score of a whole touch; the paper's error is in "mm", which are grid
# units: docs/paper.md.
NETWORKS: Final = {"CNN-3D": "events", "users": "events", "CNN-2D": "presses"}

Found = Mapping[str, Any]


def part(found: Found, name: str) -> dict[str, Any]:
    """Return the values of a part by the names of the sets that have it."""
    keys = {key: key.rpartition("|") for key in found["parts"]}
    return {of: found["parts"][key] for key, (of, _, own) in keys.items() if own == name}


def text(found: Found) -> str:
    """Return all tables with rows, as Markdown."""
    made = (of(found) for of in (figure7, section6, bounds))
    return "\n\n".join(table.markdown() for table in made if table.rows)


def figure7(found: Found) -> Table:
    """Return the ends of the curves of figure 7: the paper's protocol and ours, side by side."""
    head = ("orb", "network", "recipe", "random test", "another day", "other people", "gap")
    curves = [
        (orb, network, recipe, own)
        for orb in dict.fromkeys(key.partition("|")[0] for key in found["parts"])
        for network in NETWORKS
        for recipe in RECIPES
        if (own := found["parts"].get(f"{orb}|figure7 {recipe} {network}"))
    ]
    rows = []
    for orb, network, recipe, own in curves:
        end = {name: values[-1] for name, values in own["sizes"].items()}
        share, whole = network != "CNN-2D", NETWORKS[network]
        gap = end["random"] - end["day"] if share else end["day"] - end["random"]
        cells = [
            NONE if name not in end else f"{100 * end[name]:.1f} %" if share else number(end[name])
            for name in ("random", "day", "people", f"day {whole}", f"people {whole}")
        ]
        spread = points(gap) if share else number(gap).replace("-", "−")
        name = "ten users" if network == "users" else network
        rows.append([orb, name, RECIPES[recipe], *cells[:3], spread, *cells[3:]])
    return Table((*head, "whole touches, another day", "other people"), rows)


def section6(found: Found) -> Table:
    """Return the paper's statistics beside ours, and their corrections."""
    of = part(found, "section6")
    head = ["", "the paper (nats, bits)", *(f"{name} (nats, bits)" for name in of)]
    static = [percent(own["p_static"]) for own in of.values()]
    rows = [["frames without a gesture", f"{100 * PAPER_STATIC:.0f} %", *static]]
    for words, paper, key in SECTION_6:
        theirs = "" if paper is None else _nats_and_bits(paper, 2)
        rows.append([words, theirs, *(_nats_and_bits(own[key]) for own in of.values())])
    return Table(head, rows if of else [])


def bounds(found: Found) -> Table:
    """Return the information that the bundle's answers carry on other people, bits."""
    of = part(found, "bound")
    rows = [[words, *map(cell, of.values())] for words, cell in BOUNDS.items()] if of else []
    return Table(["bits, on other people", *of], rows)


def interval(figure: Sequence[Any]) -> str:
    """Return [value, low, high] in nats as bits, with the interval if there is one."""
    if figure[1] is None or math.isnan(figure[1]):  # null in the file
        return _bits(figure[0])
    middle, low, high = (f"{one * BITS:.2f}".replace("-", "−") for one in figure)
    return f"{middle} ({low}–{high})"


def _nats_and_bits(nats: float, digits: int = 3) -> str:
    digits = digits if nats >= 0.1 else 4
    return f"{nats:.{digits}f}, {nats * BITS:.{digits}f}"


def _bits(nats: float) -> str:
    return f"{nats * BITS:.3f}".replace("-", "−")
