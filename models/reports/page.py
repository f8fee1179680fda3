"""The page: all sections in one HTML file that needs no network, light and dark, on paper too."""

from html import escape
from importlib import resources
from pathlib import Path

from models import text, user_files
from models.reports import evaluation_section, learning_section, store, training_section
from models.reports.data import ReportData
from models.results import missed_gestures
from models.results.training import Training

GRID = (5, 5)  # paper, section 3.2; where nothing says what the sensor is like


def html(data: ReportData) -> str:
    """Return the page of what was trained, tuned and judged.

    Raises:
        ValueError: There is nothing to show.
    """
    if data == ReportData():
        raise ValueError("there is nothing to report; train, tune or evaluate first")
    style = resources.files(__package__).joinpath("style.css").read_text(encoding="utf-8")
    title = escape(data.name)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{style}</style></head>\n<body><h1>{title}</h1>{_lead(data)}\n"
        f"{chr(10).join(part for part in _sections(data) if part)}\n"
        f"{_foot(data)}{store.pack(data)}</body></html>\n"
    )


def write(path: Path, data: ReportData) -> ReportData:
    """Write the page; what it shows already stays where `data` has nothing to replace it.

    Returns:
        What the page shows now.

    Raises:
        ValueError: The file is there, and is no report of this version; or there is nothing.
    """
    if (there := read(path)) is not None:
        data = store.merged(there, data)
    user_files.write_text(path, html(data))
    return data


def read(path: Path) -> ReportData | None:
    """Return what a page shows; None: there is none.

    Raises:
        ValueError: The file cannot be read or written, or is no report of this version.
    """
    if not user_files.target(path).exists():
        return None
    page = user_files.read_text(path)
    try:
        return store.unpack(page)
    except ValueError as error:
        raise ValueError(f"{path}: {error}; remove it, or choose another name") from None


def _lead(data: ReportData) -> str:
    """Return what the page is about, and the headline figures."""
    trained, found = data.training, data.evaluation
    known = trained.labels if trained is not None else found.labels if found is not None else ()
    names = text.joined([text.label(name) for name in known[1:]])
    said = [f"Gestures: {names}." if names else ""]
    if trained is not None and not trained.gesture:
        said.append("Only where touches are was trained; the gestures are another bundle’s.")
    cards = evaluation_section.cards(found) if found is not None else []
    if data.tuning is not None and found is None:
        cards = evaluation_section.tuned_cards(data.tuning)
    if trained is not None:
        own = training_section.cards(trained)
        cards = own + cards if found is None else cards + own
    return f'<p class="lead">{" ".join(said)}</p><div class="cards">{"".join(cards)}</div>'


def _sections(data: ReportData) -> list[str]:
    """Return all sections, the most useful first."""
    trained, tuned, found = data.training, data.tuning, data.evaluation
    grid = _grid(data)
    parts = []
    if trained is not None:
        advised = missed_gestures.of_all(found.results) if found is not None else []
        parts += [training_section.next_steps(trained, advised), training_section.honesty(trained)]
    if found is not None:
        parts.append(evaluation_section.play(found, _learned(trained)))
    if trained is not None:
        parts += [
            learning_section.classes(trained),
            learning_section.confusion(trained),
            learning_section.labels(trained),
        ]
    if tuned is not None:
        parts.append(evaluation_section.thresholds(tuned))
    if trained is not None:
        parts += [learning_section.calibration(trained), learning_section.places(trained, found)]
    if found is not None:
        parts += [evaluation_section.places(found, *grid), evaluation_section.broken(found, *grid)]
    if trained is not None:
        parts += [
            training_section.data(trained),
            training_section.progress(trained),
            training_section.made(trained),
        ]
    if found is not None:
        parts.append(evaluation_section.made(found))
    return parts


def _grid(data: ReportData) -> tuple[int, int]:
    """Return rows and columns of the sensor: what the training says, or else what was broken."""
    if data.training is not None:
        return data.training.rows, data.training.columns
    broken = data.evaluation.broken if data.evaluation is not None else ()
    taxels = [place for one in broken if (place := evaluation_section.taxel(one))]
    if not taxels:
        return GRID
    return 1 + max(row for row, _ in taxels), 1 + max(column for _, column in taxels)


def _learned(trained: Training | None) -> set[str]:
    """Return the names of the sessions that were learned from."""
    rows = trained.sessions if trained is not None else ()
    return {Path(row.path).stem for row in rows if not row.held_out}


def _foot(data: ReportData) -> str:
    """Return what closes the page."""
    by = f" {escape(data.training.software)}" if data.training is not None else ""
    return f"<footer>Written by OrbTouch{by}. This file needs nothing else.</footer>"
