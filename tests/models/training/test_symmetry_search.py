"""Symmetries that nobody declared, found by trial."""

from dataclasses import replace

import pytest

pytest.importorskip("torch", reason="needs the [train] extra")

from controller.bundles import vocabulary
from controller.bundles.vocabulary import Vocabulary
from models.training import symmetry_search

BARE = vocabulary.of(("null", "press", "stroke"), orb=False)


def test_only_the_orb_s_labels_lend_their_symmetries() -> None:
    press, stroke = BARE.entries
    assert (press.rotations, press.mirror, press.shifts) == ("none", "none", False)
    assert (stroke.rotations, stroke.mirror) == ("none", "none")
    assert press.located  # a place that was recorded is still learned
    assert vocabulary.of(("null", "press")).entries[0].rotations == "all"


def test_what_helps_people_held_out_is_kept_with_its_points() -> None:
    tried: list[tuple[bool, str, str]] = []

    def judge(one: Vocabulary) -> tuple[float, float]:
        entry = one.entries[0]
        tried.append((entry.shifts, entry.mirror, entry.rotations))
        loss = 0.8 - 0.2 * entry.shifts + 0.1 * (entry.mirror == "self")
        return loss, 0.7 + 0.08 * entry.shifts - 0.05 * (entry.mirror == "self")

    found, words = symmetry_search.search(judge, BARE)
    assert tried == [
        (False, "none", "none"),
        (True, "none", "none"),
        (True, "self", "none"),  # hurts, and is left out of the next trial
        (True, "none", "half"),  # changes nothing
    ]
    assert found == replace(
        BARE, entries=tuple(replace(entry, shifts=True) for entry in BARE.entries)
    )
    assert words == "shifts = true (+8.0 points)"


@pytest.mark.parametrize(
    ("gain", "words"),
    [
        (0.0, "no symmetry helps"),
        (0.004, "no symmetry helps"),  # chance
        (0.006, 'rotations = "half" (+0.6 points)'),
    ],
)
def test_nothing_is_proposed_where_nothing_helps(gain: float, words: str) -> None:
    def judge(one: Vocabulary) -> tuple[float, float]:
        turned = one.entries[0].rotations == "half"
        return 0.5 - 0.1 * turned, 0.8 + gain * turned

    assert symmetry_search.search(judge, BARE)[1] == words
