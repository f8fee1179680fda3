"""Tables of the estimates: for the terminal and docs/paper.md as Markdown, and for the report."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

from models.formatting import NONE
from models.reports import markdown
from models.reports.tables import Table
from models.studies.information.histogram import (
    BITS,
    PAPER_H_Y,
    PAPER_H_Z,
    PAPER_INFORMATION,
    PAPER_STATIC,
)
from models.studies.information.results import sets_with, value, vocabularies

COMMAND: Final = "models information"  # its marks enclose the tables in a page
UNIFORM: Final = math.log(5)  # nats: the paper prints it in bits, 2.32

# Row, the paper's figure in nats, and key of ours.
SECTION_6: Final[tuple[tuple[str, float | None, str], ...]] = (
    ("H(y) of equally frequent labels", UNIFORM, "h_uniform"),
    ("H(y), labels", PAPER_H_Y, "h_y"),
    ("H(z), a sensor", PAPER_H_Z, "h_z"),
    ("I(z; y), a sensor, the paper’s scaling", PAPER_INFORMATION, "information"),
    ("the same, 1 frame of 1,000 clipped at either end", None, "information_clipped"),
    ("I(z; y), one scaling for all gestures", None, "information_global"),
    ("the same, bias removed", None, "information_corrected"),
    ("… least informative sensor", None, "least"),
    ("… most informative sensor", None, "most"),
    ("labels shuffled (no relation)", None, "null"),
    ("labels shifted in time (drift only)", None, "null_slow"),
)
BINNED: Final = {"h_z": "{name}: H(z)", "information": "I, one scaling",
                 "corrected": "bias removed", "null": "shuffled"}  # fmt: skip
CLASSIFIERS: Final = {
    "linear, rest first": "linear, other days, the paper’s fixed baseline",
    "linear, rest followed": "linear, other days",
    "mlp, rest first": "two layers, other days, the paper’s fixed baseline",
    "mlp, rest followed": "two layers, other days",
    "the bundle that ships": "the bundle that ships (other people)",
}
NEIGHBOURS: Final = {"leaky": "neighbours in time allowed", "apart": "neighbours in time excluded",
                     "days": "neighbours of other days only"}  # fmt: skip
COMPARED: Final = ("image", "20 components")  # points for which all kinds of neighbours are shown
GAMES: Final[dict[str, Callable[[Mapping[str, Any]], str]]] = {
    "intended commands, minutes": lambda p: f"{p['gestures']}, {p['minutes']:.0f}",
    "recognised correctly": lambda p: f"{100 * p['right']:.2f} %",
    "false alarms per minute": lambda p: f"{p['alarms'] / p['minutes']:.3f}",
    "bits per command as played": lambda p: _interval(p["played"]),
    "… with the best use (capacity)": lambda p: _bits(p["capacity"]),
    "… log2 of the number of commands": lambda p: f"{math.log2(len(p['commands'])):.3f}",
    "seconds per command": lambda p: f"{p['mean_s']:.2f}",
    "… from touch to command": lambda p: f"{p['late_s']:.2f}",
    "bits per minute as played": lambda p: f"{p['played_per_min'] * BITS:.0f}",
    "… with the fastest use": lambda p: f"{p['fastest_per_min'] * BITS:.0f}",
}
VOCABULARY: Final[dict[str, Callable[[Mapping[str, Any]], str]]] = {
    "{name}: correct": lambda one: f"{100 * one['right']:.1f} %",
    "bits per gesture": lambda one: _bits(one["capacity"]),
    "s per gesture": lambda one: f"{one['fastest_s']:.2f}",
    "bits per minute": lambda one: f"{one['fastest_per_min'] * BITS:.0f}",
}

Found = Mapping[str, Any]
Rows = list[list[str]]


def text(found: Found) -> str:
    """Return all tables with rows, as Markdown."""
    made = (of(found) for of in (section_6, bins, windows, gestures, places, games, vocabulary))
    return "\n\n".join(markdown.table(table) for table in made if table.rows)


def section_6(found: Found) -> Table:
    """Return the paper's statistics beside ours, and their corrections."""
    names = sets_with(found, "histogram")
    mean = [value(found, name, "histogram", "mean") for name in names]
    head = ["", "the paper (nats, bits)", *(f"{name} (nats, bits)" for name in names)]
    static = [f"{100 * own['p_static']:.1f} %" for own in mean]
    rows = [["frames without a gesture", f"{100 * PAPER_STATIC:.0f} %", *static]]
    for words, paper, key in SECTION_6:
        theirs = "" if paper is None else _nats_and_bits(paper, 2)
        rows.append([words, theirs, *(_nats_and_bits(own[key]) for own in mean)])
    return Table(head, rows if names else [])


def bins(found: Found) -> Table:
    """Return the histogram estimates by the number of bins."""
    names = sets_with(found, "histogram")
    head = ["bins (in bits, means over the sensors)"]
    head += [title.format(name=name) for name in names for title in BINNED.values()]
    several = zip(*(value(found, name, "histogram", "bins") for name in names), strict=True)
    rows = [
        [f"{own[0]['bins']}", *(_bits(one[key]) for one in own for key in BINNED)]
        for own in several
    ]
    return Table(head, rows)


def windows(found: Found) -> Table:
    """Return the estimates of I(window; label), bits."""
    names = list(dict.fromkeys([*sets_with(found, "classifier"), *sets_with(found, "neighbours")]))
    points = dict.fromkeys(
        key for name in names for key in value(found, name, "neighbours", "rows") or ()
    )
    estimates = {
        ("neighbours", key, kind):
        f"Ross, {key if key.startswith('image') else f'window, {key}'}; {words}"
        for key in points
        for kind, words in NEIGHBOURS.items()
        if kind == "apart" or key in COMPARED
    } | {
        ("classifier", key, kind): f"≥ {words}{', temperature' if kind == 'scaled' else ''}"
        for key, words in CLASSIFIERS.items()
        for kind in ("raw", "scaled")
    }  # fmt: skip
    rows = _measured(
        (words, [value(found, name, part, "rows", key, kind) for name in names])
        for (part, key, kind), words in estimates.items()
    )
    if names:
        entropy = [
            _bits(value(found, n, "classifier", "h_y") or value(found, n, "neighbours", "h_y"))
            for n in names
        ]
        rows.insert(0, ["entropy of the label, H(y)", *entropy])
    return Table(["I(window; label), bits", *names], rows)


def gestures(found: Found) -> Table:
    """Return the bounds for whole gestures, bits."""
    names = sets_with(found, "classifier")
    own = [value(found, name, "classifier") for name in names]
    ideal = [f"{part['h_gesture'] * BITS:.3f} ({part['gestures']})" for part in own]
    bounds = _measured(
        (words, [part["rows"].get(key, {}).get("gesture") for part in own])
        for key, words in CLASSIFIERS.items()
    )
    rows = [["entropy of the gesture (number of gestures)", *ideal], *bounds] if names else []
    return Table(["bits per gesture on another day, at least", *names], rows)


def places(found: Found) -> Table:
    """Return the information of presses about their places, bits."""
    names = sets_with(found, "places")
    own = [value(found, name, "places") for name in names]
    counts = [f"{name} ({part['presses']})" for name, part in zip(names, own, strict=True)]
    rows: Rows = []
    for key in own[0]["rows"] if own else ():
        several = [part["rows"][key] for part in own]
        fixed = [[bound + row["missed"] for bound in row["plain"]] for row in several]
        rows.append([f"Kraskov, {key}", *(_interval(row["plain"]) for row in several)])
        rows.append([f"… corrected for {key}", *map(_interval, fixed)])
    return Table(["I(image of a press; its place), bits (presses)", *counts], rows)


def games(found: Found) -> Table:
    """Return the channels of played games."""
    players = found["games"]
    rows = [[words, *map(of, players.values())] for words, of in GAMES.items()] if players else []
    return Table(["played games", *players], rows)


def vocabulary(found: Found) -> Table:
    """Return the channels of vocabularies of two gestures, three, ..."""
    by_set = vocabularies(found)
    head = ["gestures", "without confusion"]
    head += [title.format(name=name) for name in by_set for title in VOCABULARY]
    rows = []
    for size in sorted({size for own in by_set.values() for size in own}):
        labels = next(own[size]["labels"] for own in by_set.values() if size in own)
        shown = ", ".join(labels) if size == 2 else f"+ {labels[-1]}"
        cells = [f"{size}: {shown}", f"{math.log2(size):.2f}"]
        for own in by_set.values():
            cells += [of(own[size]) if size in own else NONE for of in VOCABULARY.values()]
        rows.append(cells)
    return Table(head, rows)


def _measured(wanted: Iterable[tuple[str, Sequence[Any]]]) -> Rows:
    """Return a row of intervals for all words that have a value in one of the sets."""
    return [
        [words, *(_interval(one) if one else NONE for one in values)]
        for words, values in wanted
        if any(values)
    ]


def _nats_and_bits(nats: float, digits: int = 3) -> str:
    digits = digits if nats >= 0.1 else 4
    return f"{nats:.{digits}f}, {nats * BITS:.{digits}f}"


def _bits(nats: float | None) -> str:
    if nats is None or math.isnan(nats):
        return NONE
    return f"{nats * BITS:.3f}".replace("-", "−")


def _interval(figure: Sequence[float]) -> str:
    """Return [value, low, high] in nats as bits, with the interval if there is one."""
    if math.isnan(figure[1]):
        return _bits(figure[0])
    middle, low, high = (f"{one * BITS:.2f}".replace("-", "−") for one in figure)
    return f"{middle} ({low}–{high})"
