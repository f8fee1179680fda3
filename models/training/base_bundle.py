"""Base bundle: source of the network that is not trained, and of its mapping."""

from pathlib import Path
from typing import Any

from controller import files
from controller.bundles import bundle
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


def mapping(vocabulary: Vocabulary, lent: dict[str, Any], *, located: bool) -> dict[str, Any]:
    """Return the mapping of a new bundle: as the vocabulary has it, else as the base has it.

    If the bundle does not locate touches, gestures whose command depends on the place do nothing.

    Args:
        vocabulary: The gestures.
        lent: Mapping of the base; {} if there is none.
        located: The bundle locates touches.
    """
    table = {label: lent[label] for label in vocabulary.labels if label in lent}
    table |= vocabulary.table
    if located:
        return table
    return {
        label: NONE if isinstance(rules, list) and len(rules) > 1 else rules
        for label, rules in table.items()
    }


def mapping_of(base: Path | None) -> dict[str, Any]:
    """Return a bundle's mapping as its manifest has it; None is the bundle that ships."""
    parts = bundle.unpack(files.read_bytes(base or bundle.default_path(), bundle.MAX_BYTES))
    return dict(bundle.manifest(parts[bundle.MANIFEST])["mapping"])


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
