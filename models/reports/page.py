"""Page writer: reports as one HTML file that needs no network, light and dark, on paper too.

Pages are Jinja2 templates in `templates/`, with autoescape.
"""

import re
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from controller.bundles.bundle import Bundle
from controller.shared.errors import count
from models import formatting
from models.reports import cards, figures, sections, tables
from models.results import storage
from models.results.evaluation import Evaluation
from models.results.training import Training, UserResult

# Functions of `models.formatting` that templates use.
FILTERS: Final = [
    "label",
    "percent",
    "number",
    "count",
    "seconds",
    "duration",
    "lateness",
    "joined",
]


def html(found: Training | Evaluation) -> str:
    """Return the report page of a training or an evaluation."""
    name = "training" if isinstance(found, Training) else "evaluation"
    return _environment().get_template(f"{name}.html").render(found=found)


def write(path: Path, found: Training | Evaluation) -> None:
    """Write the report page."""
    storage.write_text(path, html(found))


def write_training(out: Path, loaded: Bundle, found: Training) -> None:
    """Write NAME.md, NAME.json and NAME.html beside the bundle NAME.orb."""
    storage.write_text(out.with_suffix(".md"), f"{cards.training(loaded, found)}\n")
    storage.write_json(out.with_suffix(".json"), found)
    write(out.with_suffix(".html"), found)


def write_users(out: Path, found: UserResult) -> None:
    """Write NAME.md and NAME.json beside the bundle NAME.orb of identified users."""
    storage.write_text(out.with_suffix(".md"), f"{cards.users(found)}\n")
    storage.write_json(out.with_suffix(".json"), found)


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
    for name in FILTERS:
        made.filters[name] = getattr(formatting, name)
    made.filters |= {"interval": _interval, "several": count}
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
