"""The card of a bundle: what it is, how it was made, and how well it does on unseen sessions."""

from controller.bundle import Bundle
from models.evaluate import Report


def text(name: str, bundle: Bundle, result: Report, sessions: int, minutes: float) -> str:
    """Return the card as Markdown."""
    size = (len(bundle.gesture_npz) + len(bundle.location_npz)) // 1024
    made = [f"| {key.replace('_', ' ')} | {value} |" for key, value in bundle.card.items()]
    figures = [f"| {key} | {value} |" for key, value in result.table()]
    names = bundle.labels
    confusion = [
        f"| **{names[i]}** | " + " | ".join(str(n) for n in result.confusion[i, 1:]) + " |"
        for i in range(1, len(names))
    ]
    debounce = bundle.debounce
    return "\n".join(
        [
            f"# {name}",
            "",
            f"A {bundle.rows}×{bundle.columns} orb at {bundle.rate_hz:g} Hz, windows of "
            f"{bundle.window} images; labels {', '.join(names)}. {size} KiB of weights. Debouncer: "
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
            "| figure | value |",
            "|---|---|",
            *figures,
            "",
            "| true \\ recognised | " + " | ".join(names[1:]) + " |",
            "|---" * len(names) + "|",
            *confusion,
        ]
    )
