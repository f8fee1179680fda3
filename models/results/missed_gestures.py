"""Gestures that the device misses too often: counts, and advice on them."""

from collections.abc import Sequence
from typing import Final

from models.results.evaluation import Result

Table = Sequence[Sequence[int]]  # events: true class by answered class; 0: nothing, no answer

SHARE: Final = 0.05  # of a gesture's events that may be missed
LEAST: Final = 2  # events: a single one may be chance


def right(table: Table) -> tuple[int, int]:
    """Return how many gestures are answered rightly, and how many there are."""
    rows = list(enumerate(table))[1:]
    return sum(row[number] for number, row in rows), sum(sum(row) for _, row in rows)


def failing(table: Table) -> list[int]:
    """Return the classes that are missed too often, the worst first."""
    shares = {}
    for number, row in list(enumerate(table))[1:]:
        missed = sum(row) - row[number]
        if missed >= LEAST and missed > SHARE * sum(row):
            shares[number] = missed / sum(row)
    return sorted(shares, key=lambda number: -shares[number])


def counts(labels: Sequence[str], table: Table, number: int) -> str:
    """Return the score of a class in words: "knock: 13 of 20"."""
    return f"{labels[number]}: {table[number][number]} of {sum(table[number])}"


def advice(
    labels: Sequence[str], table: Table, number: int, *, more: int = 0, little: bool = False
) -> str:
    """Return the advice on a class that is missed too often, a sentence with its figures.

    With `more`, so many further examples would help; fewer than were missed are not named.
    With `little`, more examples are known to help little.
    """
    row, label = table[number], labels[number]
    others = [
        (count, f"{count} as {labels[other]}" if other else f"{count} not at all")
        for other, count in enumerate(row)
        if count and other != number
    ]
    how = ", ".join(words for _, words in sorted(others, reverse=True))
    named = more >= sum(row) - row[number]
    first = f"record {more} more, " if named else "record more of it, "
    first = "more of it would help little: " if little else first
    unlike = f"from {labels[worst]}" if (worst := _taken_for(row, number)) else "from rest"
    return (
        f"{label} is answered rightly in {row[number]} of {sum(row)} ({how}): {first}make it "
        f"firmer or more distinct {unlike}, or let models tune choose when it counts"
    )


def of_all(results: Sequence[Result]) -> list[str]:
    """Return the advice on every class that is missed too often, in all sets of sessions."""
    return [
        f"{result.name}: {advice(result.labels, result.answered, number)}"
        for result in results
        for number in failing(result.answered)
    ]


def _taken_for(row: Sequence[int], number: int) -> int:
    """Return the class that is answered most often in place of another; 0: none."""
    return max(range(len(row)), key=lambda other: 0 if other == number else row[other])
