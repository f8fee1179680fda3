"""Tables of figure 7 as Markdown, for docs/paper.md."""

from collections.abc import Mapping
from typing import Any, Final

from models.reports import markdown

BEGIN: Final = "<!-- models figures -->"
END: Final = "<!-- so far models figures -->"


def tables(found: Mapping[str, Any]) -> str:
    """Return all tables of what models/studies/figure7/study.py measured."""
    return f"{ends(found)}\n\n{lateness(found)}"


def into(page: str, found: Mapping[str, Any]) -> str:
    """Return a page with the tables between its two marks, in place of what stood there.

    Raises:
        ValueError: The marks are not in it.
    """
    return markdown.between(page, BEGIN, END, tables(found))


def ends(found: Mapping[str, Any]) -> str:
    """Return the ends of all curves: the paper's protocol and ours, side by side."""
    lines = [
        "| orb | network | recipe | random test | another day | other people | gap | "
        "whole touches, another day | other people |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for key, part in found["parts"].items():
        preset, recipe, network = key.split()
        share = network != "CNN-2D"
        words = _percent if share else _error
        whole = "events" if share else "presses"
        end = {name: values[-1] for name, values in part["sizes"].items()}
        gap = end["random"] - end["day"] if share else end["day"] - end["random"]
        ours = "the paper’s" if recipe == "paper" else "ours"
        cells = [words(end[name]) if name in end else "–" for name in ("random", "day", "people")]
        names = (f"{name} {whole}" for name in ("day", "people"))
        after = [words(end[name]) if name in end else "–" for name in names]
        spread = f"{100 * gap:.1f} points" if share else f"{gap:.3f}".replace("-", "−")
        called = _NAMES.get(network, network)
        lines.append(
            f"| {preset} | {called} | {ours} | {' | '.join(cells)} | {spread} | "
            f"{' | '.join(after)} |"
        )
    return "\n".join(lines)


_NAMES: Final = {"users": "ten users"}


def lateness(found: Mapping[str, Any]) -> str:
    """Return how late the label button was, and what the repair does about it."""
    lines = [
        "| orb | down, estimated | down, truly | up, estimated | up, truly | frames labelled "
        "wrongly | after the repair |",
        "|---|---|---|---|---|---|---|",
    ]
    for preset, late in found["labels"].items():
        lags = [late[name] for name in ("begin_s", "true_begin_s", "end_s", "true_end_s")]
        wrong = [_percent(late[name]) for name in ("wrong", "wrong_after")]
        cells = [*(f"{lag:+.2f} s".replace("-", "−") for lag in lags), *wrong]
        lines.append(f"| {preset} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _error(value: float) -> str:
    return f"{value:.3f}"
