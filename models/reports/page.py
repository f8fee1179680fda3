"""Page writer: reports as one HTML file that needs no network, light and dark, on paper too.

Pages are Jinja2 templates in `templates/`, with autoescape. A page keeps its data inside, so that a
later command can add to it.
"""

import json
import re
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from controller.bundles.bundle import Bundle
from controller.shared import config
from models import formatting
from models.reports import cards, figures, sections, tables
from models.results import storage
from models.results.evaluation import Evaluation, Tuning
from models.results.training import Training, UserResult

OPENING: Final = '<script type="application/json" id="data">'
CLOSING: Final = "</script>"
MOST_TOUCHES: Final = 1000  # of a position map; more would make the page heavy, not clearer


@dataclass(frozen=True, slots=True)
class ReportData:
    """Content of a report page."""

    training: Training | None = None  # results of `models train`; None: nothing was trained
    # results of `models train --epochs 0`; None: the debounce settings were not chosen
    tuning: Tuning | None = None
    evaluation: Evaluation | None = None  # results of `models evaluate`; None: nothing was judged

    @property
    def name(self) -> str:
        """File name of the bundle."""
        if self.training is not None:
            return self.training.name
        if self.tuning is not None:
            return self.tuning.bundle
        return self.evaluation.bundle if self.evaluation is not None else ""


def html(data: ReportData) -> str:
    """Return the report page of what was trained, tuned and judged; ValueError: nothing was."""
    if data == ReportData():
        raise ValueError("there is nothing to report; train, tune or evaluate first")
    template = _environment().get_template("report.html")
    return template.render(data=data, packed=Markup(pack(data)))


def write(path: Path, data: ReportData) -> None:
    """Write the report page; parts that `data` lacks are kept from the page that is there.

    A new training begins a new page. Raises ValueError for a file that is no such page.
    """
    there = read(path)
    if there is not None and data.training is None:
        given = {f.name: part for f in fields(data) if (part := getattr(data, f.name)) is not None}
        data = replace(there, **given)
    storage.write_text(path, html(data))


def write_training(out: Path, loaded: Bundle, found: Training) -> None:
    """Write NAME.md, NAME.json and NAME.html beside the bundle NAME.orb."""
    storage.write_text(out.with_suffix(".md"), f"{cards.training(loaded, found)}\n")
    storage.write_json(out.with_suffix(".json"), found)
    storage.write_text(out.with_suffix(".html"), html(ReportData(training=found)))


def write_users(out: Path, found: UserResult) -> None:
    """Write NAME.md and NAME.json beside the bundle NAME.orb of identified users."""
    storage.write_text(out.with_suffix(".md"), f"{cards.users(found)}\n")
    storage.write_json(out.with_suffix(".json"), found)


def read(path: Path) -> ReportData | None:
    """Return the content of a report page (None: no file); raise ValueError if it is none."""
    if not storage.target(path).exists():
        return None
    page = storage.read_text(path)
    try:
        return unpack(page)
    except ValueError as error:
        raise ValueError(f"{path}: {error}; remove it, or choose another name") from None


def pack(data: ReportData) -> str:
    """Return the data as an element of the page; of many touches some, evenly spread."""
    text = json.dumps(_thinned(storage.plain(data)), allow_nan=False, ensure_ascii=False)
    return OPENING + text.replace("<", "\\u003c") + CLOSING  # no text can end the element


def unpack(page: str) -> ReportData:
    """Return the data of a page; raise ValueError if it holds none, or that of another version."""
    found = re.search(re.escape(OPENING) + "(.*?)" + re.escape(CLOSING), page, re.DOTALL)
    if found is None:
        raise ValueError("it is no report of this program")
    try:
        made = storage.from_plain(ReportData, config.parse_json(found[1], len(found[1])))
    except (TypeError, KeyError, ValueError, AttributeError):
        raise ValueError("it is a report of another version") from None
    assert isinstance(made, ReportData)
    return made


def _thinned(value: Any) -> Any:
    """Return JSON with at most `MOST_TOUCHES` entries in each list of touches."""
    if isinstance(value, dict):
        return {
            key: one[:: max(1, -(-len(one) // MOST_TOUCHES))] if key == "touches" else _thinned(one)
            for key, one in value.items()
        }
    return [_thinned(one) for one in value] if isinstance(value, list) else value


@cache
def _environment() -> Environment:
    """Return the templates with the filters and functions that they use."""
    made = Environment(
        loader=PackageLoader("models.reports"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    for function in (
        formatting.label, formatting.percent, formatting.number, formatting.count,
        formatting.seconds, formatting.duration, formatting.lateness, formatting.joined,
        formatting.several,
    ):  # fmt: skip
        made.filters[function.__name__] = function
    made.filters["interval"] = _interval
    style = resources.files("models.reports").joinpath("style.css").read_text(encoding="utf-8")
    made.globals.update(figures=figures, tables=tables, sections=sections, style=Markup(style))
    return made


def _interval(cell: str) -> str:
    """Return a table's cell with its interval, "(0.97–0.99)", in small print."""
    if isinstance(cell, Markup):
        return cell
    parts = re.fullmatch(r"(\S.*) \((-?[\d.]+–-?[\d.]+)\)(.*)", cell)
    if parts is None:
        return cell
    return Markup('{} <span class="interval">{}</span>{}').format(parts[1], parts[2], parts[3])
