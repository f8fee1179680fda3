"""Verdict of an evaluation: how many events of each gesture were understood, why not, what to do.

Terminal, card and JSON show the same words, the worst gesture first.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from typing import Final

from controller.shared.notices import notice

Table = Sequence[Sequence[int]]

# Why an event was not answered, and what would help.
REASONS: Final[Mapping[str, str]] = {
    notice("too_light"): notice("firmer"),
    notice("too_short"): notice("longer"),
    notice("undecided"): notice("less_alike"),
    notice("unclear"): notice("more_distinct"),
}
_UNKNOWN: Final = (notice("unanswered"), notice("firmer_longer"))
_SHARE: Final = 0.05  # of a gesture's events that may be missed without advice
_LEAST: Final = 2  # events: a single one may be chance
_STEP: Final = 10  # examples: more are advised in such steps


@dataclass(frozen=True, slots=True)
class GestureVerdict:
    """Verdict on one gesture."""

    label: str  # its name
    understood: int  # number of its events that were answered rightly
    of: int  # number of its events, at least one
    why: str  # what happened to the others: "too short"; "": there are none
    advice: str  # what would help; "" where few are missed

    def __str__(self) -> str:
        """Return it as a line: "knock: 13 of 20 understood, too short; 10 more examples"."""
        line = f"{self.label}: {self.understood} of {self.of} understood"
        line += f", {self.why}" if self.why else ""
        return line + (f"; {self.advice}" if self.advice else "")


Verdict = tuple[GestureVerdict, ...]


def judge(
    labels: Sequence[str],
    answered: Table,
    unanswered: Table = (),
) -> Verdict:
    """Return the verdict on every gesture that was made, the worst first.

    Args:
        labels: Classes, "null" first.
        answered: Events by answer, (classes, classes); column 0: no answer. () is no event.
        unanswered: Those without an answer by reason, (classes, `REASONS`); (): not known.
    """
    made = []
    for number, row in list(enumerate(answered))[1:]:
        if sum(row):
            reasons = unanswered[number] if unanswered else ()
            made.append(_gesture(labels, number, row, reasons))
    return tuple(sorted(made, key=lambda one: one.understood / one.of))


def _gesture(
    labels: Sequence[str],
    number: int,
    row: Sequence[int],
    reasons: Sequence[int],
) -> GestureVerdict:
    """Return the verdict on a class, of which a row of `answered` and of `unanswered` are given."""
    causes: list[tuple[int, str, str]] = [
        (count, notice("taken_for", label), notice("less_like", label))
        for other, count in enumerate(row)
        if count and other not in (0, number) and (label := notice("gesture", labels[other]))
    ]
    known = zip(reasons, REASONS.items(), strict=True) if reasons else [(row[0], _UNKNOWN)]
    causes += [(count, why, remedy) for count, (why, remedy) in known if count]
    causes.sort(key=lambda cause: -cause[0])
    total, missed = sum(row), sum(row) - row[number]
    whys = [notice("counted", count, why) if causes[1:] else why for count, why, _ in causes]
    why = reduce(partial(notice, "also"), whys) if whys else ""
    advice = ""
    if missed >= _LEAST and missed > _SHARE * total:
        examples = math.ceil(missed / _STEP) * _STEP
        advice = notice("more_or", examples, causes[0][2])
    return GestureVerdict(labels[number], row[number], total, why, advice)
