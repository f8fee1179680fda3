"""Tables of the documentation, each rendered from stored results, and the page of each."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from models.reports import cards
from models.reports.tables import Table
from models.results.evaluation import Evaluation
from models.studies.paper import tables as paper
from tests.support.plain_results import from_plain

from .stored import Stored, caption

Found = Mapping[str, Stored]
_NONE: Final = ""
_WAYS: Final = {
    "virtual": "virtual orb's read-out",
    "column": 'driver, `"column"`',
    "taxel": 'driver, `"taxel"`',
}
_PRESETS: Final = ("nominal", "paper-snr")
# Of games in docs/play.md: the player's name there, and words and form of each figure.
_PLAYERS: Final = ("nominal", "paper-snr", "keyboard")
_PLAY: Final[dict[str, tuple[str, Callable[[float], str]]]] = {
    "right": ("recognised correctly", lambda share: f"{100 * share:.2f} %"),
    "alarms": ("false alarms per minute", lambda rate: f"{rate:.3f}"),
    "command": ("seconds per command", lambda seconds: f"{seconds:.2f}"),
    "latency": ("… from touch to command", lambda seconds: f"{seconds:.2f}"),
}


@dataclass(frozen=True, slots=True)
class Block:
    """A block of a page.

    Attributes:
        name: In the page's comment.
        page: Path from the root of the repository.
        parts: Stored results that it shows.
        render: Returns its Markdown.
        captioned: Whether command, bundle, date and machine follow.
    """

    name: str
    page: str
    parts: tuple[str, ...]
    render: Callable[[Found], str]
    captioned: bool = True

    def text(self, found: Found) -> str:
        """Return the content of the block."""
        under = [f"*{caption([found[name] for name in self.parts])}.*"] if self.captioned else []
        return "\n\n".join([self.render(found), *under])


def _evaluation(found: Found) -> Evaluation:
    card: Evaluation = from_plain(Evaluation, found["card"].results)
    return card


def card_bundle(found: Found) -> str:
    """Return labels, settings and origin of the bundle: the card above its notes."""
    card = _evaluation(found)
    above = cards.evaluation(card).partition(f"\n\n{card.notes[0]}")[0]
    return above.partition("\n\n")[2]  # the title stands above the block


def card(found: Found) -> str:
    """Return the figures of the card, with its notes."""
    card = _evaluation(found)
    return card.notes[0] + cards.evaluation(card).partition(card.notes[0])[2]


def tapping(preset: str) -> Callable[[Found], str]:
    """Return a renderer of presses understood once: the mean of four kinds, and the least."""

    def render(found: Found) -> str:
        rows = [row for row in _rows(found[f"tapping-{preset}"]) if row["gesture"] == "press"]
        rates = sorted({row["rate_hz"] for row in rows})
        lines = []
        for dwell_s in sorted({row["dwell_s"] for row in rows}):
            own = [row for row in rows if row["dwell_s"] == dwell_s]
            contact_s = float(np.mean([row["contact_s"] for row in own]))
            cells = ([row for row in own if row["rate_hz"] == rate] for rate in rates)
            lines.append([_ms(dwell_s), _ms(contact_s), *map(_mean_and_least, cells)])
        head = [f"`{preset}`: down for", "contact", *(f"{rate:g} a second" for rate in rates)]
        return Table(head, lines).markdown()

    return render


def tapping_longer(found: Found) -> str:
    """Return pinches and twists understood once, by time, preset and hand."""
    rows = [
        (preset, row)
        for preset in _PRESETS
        for row in _rows(found[f"tapping-{preset}"])
        if row["gesture"] != "press"
    ]
    kinds = dict.fromkeys((row["gesture"], row["dwell_s"]) for _, row in rows)
    lines = []
    for kind in kinds:
        own = [(of, row) for of, row in rows if (row["gesture"], row["dwell_s"]) == kind]
        contact_s = np.mean([row["contact_s"] for _, row in own])
        cells = [_counted([row for of, row in own if of == preset]) for preset in _PRESETS]
        lines.append([kind[0], _ms(kind[1]), _ms(float(contact_s)), *cells])
    return Table(["", "down for", "contact", *_PRESETS], lines).markdown()


def _rows(stored: Stored) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = stored.results["results"]
    return rows


def _ms(seconds: float) -> str:
    return f"{1000 * seconds:.0f} ms"


def _mean_and_least(rows: list[dict[str, Any]]) -> str:
    """Return the mean share of some kinds of touches, and the least if it is another."""
    if not rows:
        return _NONE
    shares = [row["value"] for row in rows]
    mean, least = (f"{one:.2f}".removeprefix("0") for one in (np.mean(shares), min(shares)))
    return mean if mean == least else f"{mean}, {least}"


def _counted(rows: list[dict[str, Any]]) -> str:
    touches = sum(row["touches"] for row in rows)
    return f"{sum(round(row['value'] * row['touches']) for row in rows)} of {touches}"


def driver(found: Found) -> str:
    """Return F1 and latency, a row a preset, a column a way of reading."""
    values = {
        (row["preset"], row["name"]): row for way in _WAYS for row in _rows(found[f"driver-{way}"])
    }
    lines = []
    for preset in _PRESETS:
        events = values[preset, "events_f1@virtual"]["events"]
        cells = [
            f"{values[preset, f'events_f1@{way}']['value']:.3f}, "
            f"{values[preset, f'latency@{way}']['value']:.2f} s"
            for way in _WAYS
        ]
        lines.append([f"`{preset}`, {events} gestures", *cells])
    return Table(["F1 of gestures, median latency", *_WAYS.values()], lines).markdown()


def play(found: Found) -> str:
    """Return what a player notices of the played games."""
    values = {(row["name"], row["preset"]): row["value"] for row in _rows(found["games"])}
    rows = [
        [words, *(form(values[name, who]) for who in _PLAYERS)]
        for name, (words, form) in _PLAY.items()
    ]
    return Table(["the demo's hand", *_PLAYERS], rows).markdown()


def study(name: str) -> Callable[[Found], str]:
    """Return a renderer of all tables of a stored study."""
    return lambda found: paper.text(found[name].results)


def command_cost(found: Found) -> str:
    """Return the lines of the demo's player by what a command costs it."""
    lines = [
        [
            f"{row['cost']:g}",
            f"{row['value']:.1f} ({row['low']:.1f}–{row['high']:.1f})",
        ]
        for row in _rows(found["command-cost"])
    ]
    return Table(["a command costs", "lines"], lines).markdown()


CARD, PAPER = "models/README.md", "docs/paper.md"
MEASUREMENTS: Final = "docs/measurements.md"
BLOCKS: Final = (
    Block("card-bundle", CARD, ("card",), card_bundle, captioned=False),
    Block("card", CARD, ("card",), card),
    *(
        Block(f"tapping-{one}", MEASUREMENTS, (f"tapping-{one}",), tapping(one))
        for one in _PRESETS
    ),
    Block(
        "tapping-longer", MEASUREMENTS, tuple(f"tapping-{one}" for one in _PRESETS),
        tapping_longer, captioned=False,
    ),
    Block("driver", MEASUREMENTS, tuple(f"driver-{way}" for way in _WAYS), driver),
    Block("command-cost", MEASUREMENTS, ("command-cost",), command_cost),
    Block("play", "docs/play.md", ("games",), play),
    Block("information", PAPER, ("information",), study("information")),
    Block("figure7", PAPER, ("figure7",), study("figure7")),
)  # fmt: skip
