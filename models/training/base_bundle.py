"""The other half: a bundle that lends the network that is not trained, and its mapping."""

import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from controller.bundles.bundle import Bundle
from controller.bundles.vocabulary import Vocabulary
from controller.recognition.mapping import NONE
from models.data.load import Data


def choose(
    base: Bundle, data: Data, *, gesture: bool, location: bool, named: Path | None
) -> Bundle | None:
    """Return the bundle of the network that is not trained; None if there is none.

    Args:
        base: The one that was named, or the one that ships.
        data: Examples that the other network is trained on.
        gesture: CNN-3D is trained.
        location: CNN-2D is trained.
        named: The file that was named; None: none was.

    Raises:
        ValueError: The named one does not fit, or there is none for the gestures.
    """
    if gesture and location:
        if named is not None:
            raise ValueError("--with lends a network that is not trained, and here both are")
        return None
    why = _misfit(base, data, location=location)
    if not why:
        return base
    if named is not None:
        raise ValueError(f"{named} cannot lend its network: {why}")
    if location:
        raise ValueError(
            f"the bundle that ships cannot lend its gesture network: {why}; name another with "
            "--with, or train --task both"
        )
    return None


def mapping(vocabulary: Vocabulary, lender: Bundle | None, *, located: bool) -> dict[str, Any]:
    """Return what each gesture asks for: as the vocabulary says, else as the lender does.

    Where nothing tells a touch's place, gestures that ask for something by their place do
    nothing, on purpose.
    """
    lent = table_of(lender) if lender is not None else {}
    table = {label: lent[label] for label in vocabulary.labels if label in lent}
    table |= vocabulary.table
    if located:
        return table
    return {
        label: NONE if isinstance(asks, list) and len(asks) > 1 else asks
        for label, asks in table.items()
    }


def table_of(lender: Bundle) -> dict[str, Any]:
    """Return a bundle's mapping as its TOML has it."""
    table: dict[str, Any] = {}
    for label, rules in lender.mapping.rules.items():
        if len(rules) == 1 and rules[0].everywhere:
            table[label] = rules[0].command
        else:
            table[label] = [
                {
                    key: value
                    for key, value in asdict(rule).items()
                    if isinstance(value, str) or math.isfinite(value)
                }
                for rule in rules
            ]
    return table


def _misfit(lender: Bundle, data: Data, *, location: bool) -> str:
    """Return why a bundle's other network does not fit; "": it does."""
    rows, columns = data.examples.images.shape[1:]
    own, new = lender.preprocess, data.settings
    if (lender.rows, lender.columns, lender.pitch_mm) != (rows, columns, data.pitch_mm):
        return (
            f"it is for {lender.rows}×{lender.columns} taxels {lender.pitch_mm:g} mm apart, the "
            f"recordings have {rows}×{columns}, {data.pitch_mm:g} mm apart"
        )
    if (own.normalise, own.scale) != (new.normalise, new.scale):
        return f"it sees images by {own.normalise}, the recordings are made into {new.normalise}"
    if location and own != new:
        return "its images are made in another way than the recordings' would be"
    if not location and not lender.locates:
        return "it has none"
    return ""
