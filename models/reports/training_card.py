"""Files beside a bundle that was just trained: its card, its figures and its report."""

import math
from pathlib import Path

from controller.bundles.bundle import Bundle
from models import user_files
from models.reports import page
from models.reports.data import ReportData
from models.results import missed_gestures
from models.results.training import Honesty, Training


def write(out: Path, loaded: Bundle, result: Training) -> None:
    """Write NAME.md, NAME.json and NAME.html beside the bundle NAME.orb."""
    user_files.write_text(out.with_suffix(".md"), f"{text(loaded, result)}\n")
    user_files.write_text(out.with_suffix(".json"), f"{result.text()}\n")
    report = out.with_suffix(".html")
    report.unlink(missing_ok=True)  # what it says of an earlier bundle is not true of this one
    page.write(report, ReportData(training=result))


def text(loaded: Bundle, result: Training) -> str:
    """Return the card as Markdown."""
    weights = (len(loaded.gesture_onnx) + len(loaded.location_onnx)) // 1024
    lines = [
        f"# {result.name}",
        "",
        f"{result.rows}×{result.columns} taxels at {result.rate_hz:g} Hz, windows of "
        f"{loaded.window} images; labels {', '.join(loaded.labels)}. {weights} KiB of networks. "
        f"SHA-256 `{loaded.hash[:16]}…`",
        "",
        "| made | |",
        "|---|---|",
        *(f"| {key} | {value} |" for key, value in loaded.card.items()),
        "",
        *(f"- {line}" for line in (*result.how, *result.symmetries)),
        *headline(result),
    ]
    if result.gesture is not None:
        lines += ["", "| class | examples | seconds | right windows | right events | |"]
        lines.append("|---|---|---|---|---|---|")
        lines += [
            f"| {row.label} | {row.examples or ''} | {row.seconds:.0f} | {_percent(row.recall)} | "
            f"{_percent(row.event_recall)} | {row.advice} |"
            for row in result.classes
        ]
    if result.advice:
        lines += ["", *(f"- {line}" for line in result.advice)]
    if result.notes:
        lines += ["", *(f"- {line}" for line in result.notes)]
    return "\n".join(lines)


def headline(result: Training) -> list[str]:
    """Return the honest figures with the paper's protocol beside them, as a table."""
    lines = [
        "",
        "| | unseen | windows at random, as the paper's protocol | gap |",
        "|---|---|---|---|",
    ]
    if (gesture := result.gesture) is not None:
        honest = gesture.honesty
        lines.append(
            f"| right windows | {_percent(honest.unseen)}{_interval(honest)} | "
            f"{_percent(honest.random)} | {_points(honest.gap)} |"
        )
        binary = honest.random_binary - honest.unseen_binary
        lines.append(
            f"| right outputs (“binary”) | {_percent(honest.unseen_binary)} | "
            f"{_percent(honest.random_binary)} | {_points(binary)} |"
        )
        lines.append(f"| right events | {_percent(gesture.event_accuracy)} | | |")
        right, events = missed_gestures.right(gesture.answered)
        lines.append(f"| answered rightly, as in play | {right} of {events} | | |")
    if (location := result.location) is not None:
        honest = location.honesty
        lines.append(
            f"| error of a place, grid units | {honest.unseen:.3f}{_between(honest)} | "
            f"{honest.random:.3f} | {-honest.gap:+.3f} |"
        )
        sites = f"{location.on_site:.3f}, {location.off_site:.3f}"
        lines.append(f"| on the sites, off them | {sites} | | |")
    unseen = [result.split, *([result.location.unseen] if result.location else [])]
    return [*lines, "", " ".join(f"Unseen: {what}." for what in unseen if what)]


def _interval(honest: Honesty) -> str:
    if not math.isfinite(honest.low):
        return ""
    return f" ({_percent(honest.low)}–{_percent(honest.high)})"


def _between(honest: Honesty) -> str:
    return f" ({honest.low:.3f}–{honest.high:.3f})" if math.isfinite(honest.low) else ""


def _percent(share: float) -> str:
    return f"{100.0 * share:.2f} %" if math.isfinite(share) else ""


def _points(share: float) -> str:
    return f"{100.0 * share:+.2f} points" if math.isfinite(share) else ""
