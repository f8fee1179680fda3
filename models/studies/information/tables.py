"""Results of an information study as plain data in a file, and its tables as Markdown.

"settings" of each set; "parts": under "SET|PART" the values of a part of study.py, in nats;
"games": under a name the figures of channel.py. Intervals are [value, low, high].
"""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from models.formatting import NONE
from models.reports import markdown
from models.reports.tables import Table
from models.results import storage
from models.studies.information.histogram import (
    BITS,
    PAPER_H_Y,
    PAPER_H_Z,
    PAPER_INFORMATION,
    PAPER_STATIC,
)

MEASURED: Final = "information.json"
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
GAMES: Final[dict[str, Callable[[Mapping[str, Any]], str]]] = {
    "intended commands, minutes": lambda p: f"{p['gestures']}, {p['minutes']:.0f}",
    "recognised correctly": lambda p: f"{100 * p['right']:.2f} %",
    "false alarms per minute": lambda p: f"{p['alarms'] / p['minutes']:.3f}",
    "bits per command as played": lambda p: interval(p["played"]),
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

Results = dict[str, Any]
Found = Mapping[str, Any]


def load(path: Path | None) -> Results:
    """Return the results in a file, empty ones where there is none; or raise UserFileError."""
    found = None if path is None else storage.read_tables(path, "settings", "parts", "games")
    return {"settings": {}, "parts": {}, "games": {}} if found is None else dict(with_nan(found))


def keep(path: Path | None, found: Results) -> None:
    """Write the results to a file, if there is one."""
    if path is not None:
        storage.write_json(path, found)


def with_nan(inside: Any) -> Any:
    """Return plain data with NaN where a list of numbers has null."""
    if isinstance(inside, dict):
        return {key: with_nan(one) for key, one in inside.items()}
    if isinstance(inside, list):
        return [math.nan if one is None else with_nan(one) for one in inside]
    return inside


def part(found: Found, name: str) -> dict[str, Any]:
    """Return the values of a part by the names of the sets that have it."""
    keys = {key: key.rpartition("|") for key in found["parts"]}
    return {of: found["parts"][key] for key, (of, _, own) in keys.items() if own == name}


def vocabularies(found: Found) -> dict[int, dict[str, Any]]:
    """Return the channels of vocabularies, by size and set."""
    sized = {size: part(found, f"vocabulary {size}") for size in range(2, 100)}
    return {size: own for size, own in sized.items() if own}


def text(found: Found) -> str:
    """Return all tables with rows, as Markdown."""
    made = (of(found) for of in (section_6, windows, gestures, places, games, vocabulary))
    return "\n\n".join(markdown.table(table) for table in made if table.rows)


def section_6(found: Found) -> Table:
    """Return the paper's statistics beside ours, and their corrections."""
    of = part(found, "histogram")
    head = ["", "the paper (nats, bits)", *(f"{name} (nats, bits)" for name in of)]
    static = [f"{100 * own['p_static']:.1f} %" for own in of.values()]
    rows = [["frames without a gesture", f"{100 * PAPER_STATIC:.0f} %", *static]]
    for words, paper, key in SECTION_6:
        theirs = "" if paper is None else _nats_and_bits(paper, 2)
        rows.append([words, theirs, *(_nats_and_bits(own[key]) for own in of.values())])
    return Table(head, rows if of else [])


def windows(found: Found) -> Table:
    """Return the estimates of I(window; label), bits."""
    near, bounds = part(found, "neighbours"), part(found, "classifier")
    names = list({**near, **bounds})
    rows = [
        [f"Ross, {key}", *(interval(near[name]["rows"][key]) if name in near else NONE
                           for name in names)]
        for key in next(iter(near.values()), {"rows": {}})["rows"]
    ]  # fmt: skip
    rows += [[f"≥ {words}", *cells] for words, *cells in _bounds(bounds, names, "window")]
    entropy = [_bits((bounds.get(name) or near[name])["h_y"]) for name in names]
    head = ["I(window; label), bits", *names]
    return Table(head, [["entropy of the label, H(y)", *entropy], *rows] if names else [])


def gestures(found: Found) -> Table:
    """Return the bounds for whole gestures, bits."""
    of = part(found, "classifier")
    ideal = [f"{own['h_gesture'] * BITS:.3f} ({own['gestures']})" for own in of.values()]
    rows = [["entropy of the gesture (number of gestures)", *ideal], *_bounds(of, of, "gesture")]
    head = ["bits per gesture on another day, at least", *of]
    return Table(head, rows if of else [])


def _bounds(of: Found, names: Sequence[str] | Found, kind: str) -> list[list[str]]:
    """Return a row for each classifier: its name, and its bounds for some sets."""
    every = dict.fromkeys(key for own in of.values() for key in own["rows"])
    return [
        [key, *(interval(of[name]["rows"][key][kind])
                if name in of and key in of[name]["rows"] else NONE for name in names)]
        for key in every
    ]  # fmt: skip


def places(found: Found) -> Table:
    """Return the information of presses about their places, bits."""
    of = {name: own for name, own in part(found, "places").items() if own}
    row = ["Kraskov, 4 components", *(interval(own["information"]) for own in of.values())]
    counts = [f"{name} ({own['presses']})" for name, own in of.items()]
    return Table(["I(image of a press; its place), bits (presses)", *counts], [row] if of else [])


def games(found: Found) -> Table:
    """Return the channels of played games."""
    players = found["games"]
    rows = [[words, *map(of, players.values())] for words, of in GAMES.items()] if players else []
    return Table(["played games", *players], rows)


def vocabulary(found: Found) -> Table:
    """Return the channels of vocabularies of two gestures, three, ..."""
    sized = vocabularies(found)
    names = list(dict.fromkeys(name for own in sized.values() for name in own))
    head = ["gestures", "without confusion"]
    head += [title.format(name=name) for name in names for title in VOCABULARY]
    rows = []
    for size, own in sized.items():
        labels = next(iter(own.values()))["labels"]
        shown = ", ".join(labels) if size == 2 else f"+ {labels[-1]}"
        cells = [of(own[name]) if name in own else NONE
                 for name in names for of in VOCABULARY.values()]  # fmt: skip
        rows.append([f"{size}: {shown}", f"{math.log2(size):.2f}", *cells])
    return Table(head, rows)


def _nats_and_bits(nats: float, digits: int = 3) -> str:
    digits = digits if nats >= 0.1 else 4
    return f"{nats:.{digits}f}, {nats * BITS:.{digits}f}"


def _bits(nats: float) -> str:
    return f"{nats * BITS:.3f}".replace("-", "−")


def interval(figure: Sequence[float]) -> str:
    """Return [value, low, high] in nats as bits, with the interval if there is one."""
    if math.isnan(figure[1]):
        return _bits(figure[0])
    middle, low, high = (f"{one * BITS:.2f}".replace("-", "−") for one in figure)
    return f"{middle} ({low}–{high})"
