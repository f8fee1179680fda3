"""Corrections in play: the player labels the latest touch, and the network learns it."""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from controller.adapt import few_shot, process
from controller.adapt.examples import NULL_LABEL, Example, touched
from controller.adapt.few_shot import CORRECTED, AdaptError
from controller.bundles import bundle as bundles
from controller.bundles.deploy.store import INCOMING, BundleStore
from controller.shared.aliases import Images
from controller.shared.notices import notice

LATEST_S: Final = 2.5  # greatest age of the corrected touch
GAP_S: Final = 0.4  # between two touches; that of a double tap is shorter
LEAD_S: Final = 1.3  # of images before the touch
MOST: Final = 40  # corrections in a bundle


def example(label: str, images: Images, rate_hz: float) -> Example:
    """Return the latest touch in images as an example; AdaptError: none, or a weak one."""
    cut = latest(images, rate_hz)
    if cut is None:
        raise AdaptError(notice("late", LATEST_S))
    found = Example(label, cut).found(rate_hz)
    if found is None:
        raise AdaptError(notice("weak_touch"))
    if label == NULL_LABEL:
        return Example(label, cut, span=(0.0, float(len(cut))))
    return found


def latest(images: Images, rate_hz: float) -> Images | None:
    """Return the images around the latest touch, (frames, rows, columns); None without a touch."""
    touches = touched(images, GAP_S * rate_hz) if len(images) >= 3 else []
    if not touches or touches[-1].span[1] < len(images) - LATEST_S * rate_hz:
        return None
    before = math.ceil(touches[-2].span[1]) if len(touches) > 1 else 0
    first = math.ceil(touches[-1].span[0]) - round(LEAD_S * rate_hz)
    return images[max(before, first) :]


def correct(
    label: str,
    images: Images,
    rate_hz: float,
    store: BundleStore,
    install: Callable[[Path, str], str],
) -> str:
    """Learn the label of the latest touch, take the new bundle into use, and return a sentence.

    Training takes seconds: call this in a thread of its own. The label "null" is no gesture, and ""
    takes the last correction back. `install` tests a file and takes it into use, given the name of
    the bundle that it corrects.

    Raises:
        BundleError, AdaptError, OSError: Nothing has changed; the message has the reason.
    """
    if not label:
        left = _corrections(store.path(store.undo(correction=True).current))
        return notice("taken_back", left)
    before = store.record().current
    path = store.path(before, rate_hz)
    count = _corrections(path)
    if count >= MOST:
        raise AdaptError(notice("many_corrections", MOST))
    shown = [example(label, images, rate_hz)]
    word = notice("nothing") if label == NULL_LABEL else notice("gesture", label)
    change = partial(few_shot.teach, examples=shown, note=CORRECTED + word)
    process.alter(change, path, store.folder / INCOMING, lambda out: install(out, before))
    return notice("corrected", word, count + 1)


def _corrections(path: Path) -> int:
    """Return the number of corrections in a bundle."""
    return sum(str(note).startswith(CORRECTED) for note in bundles.read(path).card.get("added", []))
