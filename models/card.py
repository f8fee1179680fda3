"""The card of a bundle: what it is, how it was made, and how well it does on unseen sessions."""

from collections.abc import Mapping

from controller.bundle import Bundle
from models.evaluate import Report


def text(
    name: str, bundle: Bundle, results: Mapping[str, Report], sessions: int, minutes: float
) -> str:
    """Return the card as Markdown.

    Args:
        name: The bundle's file name.
        bundle: The bundle.
        results: Its report on each preset.
        sessions: How many sessions of each preset were played.
        minutes: Their length.
    """
    size = (len(bundle.gesture_npz) + len(bundle.location_npz)) // 1024
    made = [f"| {key.replace('_', ' ')} | {value} |" for key, value in bundle.card.items()]
    columns = [dict(report.table()) for report in results.values()]
    figures = [
        f"| {figure} | " + " | ".join(column[figure] for column in columns) + " |"
        for figure in columns[0]
    ]
    labels, debounce = bundle.labels, bundle.debounce
    lines = [
        f"# {name}",
        "",
        f"A {bundle.rows}×{bundle.columns} orb at {bundle.rate_hz:g} Hz, windows of "
        f"{bundle.window} images; labels {', '.join(labels)}. {size} KiB of weights. Debouncer: "
        f"newest frame {debounce.smoothing:g}, fires at {debounce.on:g}, re-arms at "
        f"{debounce.off:g}. SHA-256 `{bundle.hash[:16]}…`",
        "",
        "| made | |",
        "|---|---|",
        *made,
        "",
        f"## On {sessions} simulated sessions of {minutes:g} minutes that training never saw",
        "",
        "Other seeds, users, orbs and placements; every fourth is a mouse instead of a hand. "
        "Simulated recordings say nothing about a physical orb. This card is written by "
        "`models evaluate --card`.",
        "",
        "| figure | " + " | ".join(results) + " |",
        "|---" * (1 + len(results)) + "|",
        *figures,
    ]
    for preset, report in results.items():
        lines += ["", f"| {preset}: true \\ recognised | " + " | ".join(labels[1:]) + " |"]
        lines.append("|---" * len(labels) + "|")
        for i in range(1, len(labels)):
            counts = " | ".join(str(n) for n in report.confusion[i, 1:])
            lines.append(f"| **{labels[i]}** | {counts} |")
    return "\n".join(lines)
