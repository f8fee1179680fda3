"""Cards as Markdown: of an evaluation, of a training, and of a user identification."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from controller.bundles.bundle import Bundle
from controller.shared.errors import count
from models.reports import tables
from models.reports.tables import Table
from models.results import storage
from models.results.evaluation import Evaluation
from models.results.training import Training, UserResult

USERS_WARNING = (
    "User identification is a convenience: a person with similar touches is taken for another. It "
    "locks nothing, and nothing may be locked with it."
)


def evaluation(found: Evaluation) -> str:
    """Return the card of an evaluation."""
    debounce = ", ".join(f"{name} {value:g}" for name, value in found.debounce.items())
    parts = [
        f"# {found.bundle}",
        f"Labels {', '.join(found.labels)}. Debouncer: {debounce}. SHA-256 `{found.hash[:16]}…`",
        _made(found.card),
        *found.notes,
        tables.figures(found.results).markdown(),
    ]
    for result in found.results:
        parts += [f"## {result.name}", _listed(map(str, result.verdict))]
        parts.append(tables.answered(result).markdown())
        parts.append(tables.gestures(result).markdown())
        if result.users > 1:
            parts.append(tables.sessions("user", result.by_user).markdown())
        if result.sessions > 1:
            parts.append(tables.sessions("session", result.by_session).markdown())
    return "\n\n".join(parts)


def training(loaded: Bundle, found: Training, drawn: Iterable[Path] = ()) -> str:
    """Return the card of a training, with its drawings, files beside the card."""
    weights = (len(loaded.embedding_onnx) + len(loaded.location_onnx)) // 1024
    parts = [
        f"# {found.name}",
        f"{found.rows}×{found.columns} taxels at {found.rate_hz:g} Hz, windows of "
        f"{loaded.window} images; labels {', '.join(loaded.labels)}. {weights} KiB of networks. "
        f"SHA-256 `{loaded.hash[:16]}…`",
        _made(loaded.card),
        _listed((*found.how, *found.symmetries)),
        headline(found),
        tables.classes(found).markdown() if found.gesture is not None else "",
        _listed(map(str, found.gesture.verdict)) if found.gesture is not None else "",
        _listed(found.advice),
        _listed(found.notes),
        *(f"![{path.stem}]({path.name})" for path in drawn),
    ]
    return "\n\n".join(filter(None, parts))


def headline(found: Training) -> str:
    """Return the scores of a training beside those of the paper's protocol."""
    held = [found.split, *([found.location.unseen] if found.location else [])]
    unseen = " ".join(f"Unseen: {part}." for part in held if part)
    return "\n\n".join(filter(None, [tables.honesty(found).markdown(), unseen]))


def users(found: UserResult) -> str:
    """Return the card of a user identification."""
    parts = [
        f"# {found.name}: {count(len(found.people), 'person', 'people')}",
        f"`{found.command}`",
        f"Identified by {', '.join(found.gestures)}. Held out: the last session of each; the "
        "network in the bundle learned from all.",
        *found.notes,
        *(one.markdown() for one in tables.users(found)),
        USERS_WARNING,
    ]
    return "\n\n".join(parts)


def write(out: Path, card: str, found: Training | UserResult) -> None:
    """Write NAME.md and NAME.json beside the bundle NAME.orb."""
    storage.write_text(out.with_suffix(".md"), f"{card}\n")
    storage.write_json(out.with_suffix(".json"), found)


def _made(card: Mapping[str, object]) -> str:
    rows = [[key.replace("_", " "), str(value)] for key, value in card.items()]
    return Table(["made", ""], rows).markdown()


def _listed(lines: Iterable[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)
