"""Tables of the estimates as Markdown: the answer, and those of docs/paper.md."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

from models.reports import markdown
from models.studies.information import scaling
from models.studies.information.histogram import (
    BITS,
    PAPER_H_Y,
    PAPER_H_Z,
    PAPER_INFORMATION,
    PAPER_STATIC,
)
from models.studies.information.results import of_set, sets_of

BEGIN: Final = "<!-- models information -->"
END: Final = "<!-- so far models information -->"
UNIFORM: Final = math.log(5)  # nats: the paper prints it in bits, 2.32

Found = Mapping[str, Any]


def text(found: Found) -> str:
    """Return all tables of what there is."""
    parts = (
        section_6(found), bins(found), windows(found), gestures(found), grown(found),
        places(found), games(found), vocabularies(found), checked(found),
    )  # fmt: skip
    return "\n\n".join(part for part in parts if part)


def into(page: str, found: Found) -> str:
    """Return a page with the tables between its two marks, in place of what stood there.

    Raises:
        ValueError: The marks are not in it.
    """
    return markdown.between(page, BEGIN, END, text(found))


def section_6(found: Found) -> str:
    """Return the paper's statistics beside its figures, and what is wrong with them."""
    names = _with(found, "histogram")
    if not names:
        return ""
    rows: list[tuple[str, float | None, str]] = [
        ("H(y) if all were as frequent", UNIFORM, "h_uniform"),
        ("H(y), labels", PAPER_H_Y, "h_y"),
        ("H(z), a sensor", PAPER_H_Z, "h_z"),
        ("I(z; y), a sensor, the paper’s scaling", PAPER_INFORMATION, "information"),
        ("the same, 1 frame of 1,000 cut off at either end", None, "information_clipped"),
        ("I(z; y), one scaling for all", None, "information_global"),
        ("the same, bias taken off", None, "information_corrected"),
        ("… the sensor that says least", None, "least"),
        ("… the sensor that says most", None, "most"),
        ("labels shuffled: nothing is known", None, "null"),
        ("labels moved in time: only drift is known", None, "null_slow"),
    ]
    lines = [
        _row(["", "the paper (nats, bits)", *(f"{name} (nats, bits)" for name in names)]),
        _rule(2 + len(names)),
    ]
    mean = {name: of_set(found, name, "histogram")["mean"] for name in names}
    static = [f"{100 * mean[name]['p_static']:.1f} %" for name in names]
    lines.append(_row(["frames without a gesture", f"{100 * PAPER_STATIC:.0f} %", *static]))
    for words, paper, key in rows:
        own = [_both(mean[name][key]) for name in names]
        lines.append(_row([words, "" if paper is None else _both(paper, 2), *own]))
    return "\n".join(lines)


def bins(found: Found) -> str:
    """Return what the histogram says by the number of its bins."""
    names = _with(found, "histogram")
    if not names:
        return ""
    head = ["bins"]
    for name in names:
        head += [f"{name}: H(z)", "I, one scaling", "bias taken off", "shuffled"]
    lines = [_row(head), _rule(len(head))]
    tables = [of_set(found, name, "histogram")["bins"] for name in names]
    for several in zip(*tables, strict=True):
        cells = [f"{several[0]['bins']}"]
        for one in several:
            cells += [_bits(one[key]) for key in ("h_z", "information", "corrected", "null")]
        lines.append(_row(cells))
    return "\n".join(lines) + "\n\nAll in bits, means over the sensors."


def windows(found: Found) -> str:
    """Return the estimates of I(window; label), bits."""
    names = [name for name in sets_of(found) if of_set(found, name, "classifier")]
    near = [name for name in sets_of(found) if of_set(found, name, "neighbours")]
    names = list(dict.fromkeys([*names, *near]))
    if not names:
        return ""
    lines = [_row(["I(window; label), bits", *names]), _rule(1 + len(names))]

    def add(words: str, of: Callable[[str], Any]) -> None:
        cells = [of(name) for name in names]
        if any(cells):
            lines.append(_row([words, *(_sure(cell) if cell else "–" for cell in cells)]))

    def h_y(name: str) -> Any:
        part = of_set(found, name, "classifier") or of_set(found, name, "neighbours")
        return [part["h_y"]] if part else None

    add("all there is to know, H(y)", h_y)
    points = list(
        dict.fromkeys(key for name in near for key in of_set(found, name, "neighbours")["rows"])
    )
    for key in points:
        for kind, words in (
            ("leaky", "neighbours in time allowed"),
            ("apart", "left out"),
            ("days", "of other days only"),
        ):
            if kind != "apart" and key not in ("image", "20 components"):
                continue

            def ross(name: str, key: str = key, kind: str = kind) -> Any:
                part = of_set(found, name, "neighbours")
                return part["rows"].get(key, {}).get(kind) if part else None

            shown = key if key.startswith("image") else f"window, {key}"
            add(f"Ross, {shown}; {words}", ross)
    for key, words in CLASSIFIERS:
        for kind in ("raw", "scaled"):

            def bound(name: str, key: str = key, kind: str = kind) -> Any:
                part = of_set(found, name, "classifier")
                return part["rows"].get(key, {}).get(kind) if part else None

            add(f"≥ {words}{', temperature' if kind == 'scaled' else ''}", bound)
    add(
        "≥ InfoNCE, other days",
        lambda name: (of_set(found, name, "contrast") or {}).get("found"),
    )
    return "\n".join(lines)


CLASSIFIERS: Final = (
    ("linear, rest first", "linear, other days, the paper’s rest"),
    ("linear, rest followed", "linear, other days"),
    ("mlp, rest first", "two layers, other days, the paper’s rest"),
    ("mlp, rest followed", "two layers, other days"),
    ("the bundle that ships", "the bundle that ships (other people)"),
)


def gestures(found: Found) -> str:
    """Return the bounds for whole gestures, bits."""
    names = [name for name in sets_of(found) if of_set(found, name, "classifier")]
    if not names:
        return ""
    lines = [_row(["bits per gesture on another day, at least", *names]), _rule(1 + len(names))]
    parts = {name: of_set(found, name, "classifier") for name in names}
    ideal = [f"{parts[name]['h_gesture'] * BITS:.3f} ({parts[name]['gestures']})" for name in names]
    lines.append(_row(["all there is to know (gestures)", *ideal]))
    for key, words in CLASSIFIERS:
        cells = [parts[name]["rows"].get(key, {}).get("gesture") for name in names]
        if any(cells):
            lines.append(_row([words, *(_sure(cell) if cell else "–" for cell in cells)]))
    return "\n".join(lines)


def grown(found: Found) -> str:
    """Return how information grows, bits: windows, and whole gestures."""
    tables = []
    for kind in scaling.KINDS:
        names = _with(found, f"growth {kind}")
        if not names:
            continue
        head = [kind, *(f"{name}: {what}" for name in names for what in ("window", "gesture"))]
        rows: dict[str, dict[str, Any]] = {}
        for name in names:
            for one in of_set(found, name, f"growth {kind}"):
                rows.setdefault(one["name"], {})[name] = one
        lines = [_row(head), _rule(len(head))]
        for words, own in rows.items():
            cells = [
                _sure(own[name][what]) if name in own else "–"
                for name in names
                for what in ("window", "gesture")
            ]
            lines.append(_row([words, *cells]))
        tables.append("\n".join(lines))
    return "\n\n".join(tables)


def places(found: Found) -> str:
    """Return what presses tell about where they are."""
    names = [name for name in sets_of(found) if of_set(found, name, "places")]
    if not names:
        return ""
    parts = {name: of_set(found, name, "places") for name in names}
    lines = [
        _row(["I(image of a press; its place), bits (presses)",
              *(f"{name} ({parts[name]['presses']})" for name in names)]),
        _rule(1 + len(names)),
    ]  # fmt: skip
    for key in next(iter(parts.values()))["rows"]:
        rows = [parts[name]["rows"][key] for name in names]
        lines.append(_row([f"Kraskov, {key}", *(_sure(row["plain"]) for row in rows)]))
        fixed = [[value + row["missed"] for value in row["plain"]] for row in rows]
        lines.append(_row([f"… corrected for {key}", *map(_sure, fixed)]))
    lines.append(
        _row(["≥ InfoNCE, other days", *(_sure(parts[name]["contrast"]) for name in names)])
    )
    return "\n".join(lines)


def games(found: Found) -> str:
    """Return what played games carry."""
    players = found["games"]
    if not players:
        return ""
    rows: Sequence[tuple[str, Callable[[Mapping[str, Any]], str]]] = (
        ("commands meant, minutes", lambda p: f"{p['gestures']}, {p['minutes']:.0f}"),
        ("understood rightly", lambda p: f"{100 * p['right']:.2f} %"),
        ("commands that nobody meant, a minute", lambda p: f"{p['alarms'] / p['minutes']:.3f}"),
        ("bits per command as played", lambda p: _sure(p["played"])),
        ("… with the best use (capacity)", lambda p: _bits(p["capacity"])),
        ("… of log2 of the commands", lambda p: f"{math.log2(len(p['commands'])):.3f}"),
        ("seconds per command", lambda p: f"{p['mean_s']:.2f}"),
        ("… from touch to command", lambda p: f"{p['late_s']:.2f}"),
        ("bits per minute as played", lambda p: f"{p['played_per_min'] * BITS:.0f}"),
        ("… with the fastest use", lambda p: f"{p['fastest_per_min'] * BITS:.0f}"),
    )
    lines = [_row(["played games", *players]), _rule(1 + len(players))]
    lines += [_row([words, *(of(p) for p in players.values())]) for words, of in rows]
    return "\n".join(lines)


def vocabularies(found: Found) -> str:
    """Return what vocabularies of two gestures, three, ... are worth."""
    sizes = sizes_of(found)
    if not sizes:
        return ""
    names = list(sizes)
    head = ["gestures", "without confusion"]
    for name in names:
        head += [f"{name}: right", "bits per gesture", "s per gesture", "bits per minute"]
    lines = [_row(head), _rule(len(head))]
    for size in sorted({size for own in sizes.values() for size in own}):
        labels = next(own[size]["labels"] for own in sizes.values() if size in own)
        shown = ", ".join(labels) if size == 2 else f"+ {labels[-1]}"
        cells = [f"{size}: {shown}", f"{math.log2(size):.2f}"]
        for name in names:
            one = sizes[name].get(size)
            if one is None:
                cells += ["–"] * 4
                continue
            cells += [
                f"{100 * one['right']:.1f} %",
                _bits(one["capacity"]),
                f"{one['fastest_s']:.2f}",
                f"{one['fastest_per_min'] * BITS:.0f}",
            ]
        lines.append(_row(cells))
    return "\n".join(lines)


def sizes_of(found: Found) -> dict[str, dict[int, Any]]:
    """Return what was found of vocabularies, by set and size."""
    made: dict[str, dict[int, Any]] = {}
    for key, part in found["parts"].items():
        name, _, what = key.partition("|")
        if what.startswith("vocabulary "):
            made.setdefault(name, {})[int(what.split()[1])] = part
    return made


def checked(found: Found) -> str:
    """Return how far off each estimator is where the truth is known."""
    rows = found["check"]
    if not rows:
        return ""
    lines = [
        _row(["cases that are known", "dimensions", "cases", "worst, nats", "of the truth",
              "within the goal"]),
        _rule(6),
    ]  # fmt: skip
    groups: dict[tuple[str, str, int], list[Mapping[str, Any]]] = {}
    for row in rows:
        kind = "mixtures" if "classes" in row["case"] else row["case"].partition(",")[0]
        groups.setdefault((row["estimator"], kind, row["dimensions"]), []).append(row)
    for (estimator, kind, dimensions), own in sorted(groups.items(), key=_first):
        worst = max(own, key=lambda row: _off(row) / allowed(row))
        close = sum(_off(row) <= allowed(row) for row in own)
        by = worst["found"] - worst["truth"]
        size = f"{dimensions}" if kind == "mixtures" else f"{dimensions} + {dimensions}"
        lines.append(
            _row([f"{estimator}, {kind}", size, str(len(own)), f"{by:+.3f}".replace("-", "−"),
                  f"{100 * by / worst['truth']:+.1f} %".replace("-", "−"),
                  f"{close} of {len(own)}"])
        )  # fmt: skip
    return "\n".join(lines)


def allowed(row: Mapping[str, Any]) -> float:
    """Return how far off an estimate may be, nats."""
    from models.studies.information.check import Row

    return Row(**row).allowed


def _off(row: Mapping[str, Any]) -> float:
    return float(abs(row["found"] - row["truth"]))


def _first(group: tuple[tuple[str, str, int], Any]) -> tuple[str, str, int]:
    return group[0]


def _with(found: Found, part: str) -> list[str]:
    return [name for name in sets_of(found) if of_set(found, name, part)]


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _rule(columns: int) -> str:
    return "|---" * columns + "|"


def _both(nats: float, digits: int = 3) -> str:
    """Return nats and bits."""
    digits = digits if nats >= 0.1 else 4
    return f"{nats:.{digits}f}, {nats * BITS:.{digits}f}"


def _bits(nats: float | None) -> str:
    if nats is None or math.isnan(nats):
        return "–"
    return f"{nats * BITS:.3f}".replace("-", "−")


def _sure(figure: Sequence[float]) -> str:
    """Return a figure in nats as bits, with its interval."""
    if len(figure) < 3 or math.isnan(figure[1]):
        return _bits(figure[0])
    value, low, high = (f"{one * BITS:.2f}".replace("-", "−") for one in figure)
    return f"{value} ({low}–{high})"
