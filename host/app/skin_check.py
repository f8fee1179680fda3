"""A quick check of the skin from telemetry: untouched for a while, then each quarter pressed.

It sees taxels that are much noisier than the others, and taxels that stay still in a quarter that
is pressed. It does not see swapped or shorted electrodes, weak taxels, or what the orb has mended:
a taxel that the orb takes for dead is estimated from its neighbours. `controller doctor` measures
the raw capacitance.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Deviation = NDArray[np.float32]  # (rows, columns), z - 1
Mask = NDArray[np.bool_]  # (rows, columns)

STEP: Final = 0.005  # of an image in telemetry
NOISY: Final = 4.0  # times the median noise
REST_S: Final = 4.0
PRESS_S: Final = 3.0  # of touching, in each quarter
PRESSED: Final = 0.04  # largest change of a quarter that counts as a press
STILL: Final = 0.15  # of the largest change of its quarter: less is no answer to a press
_TOUCHED: Final = 0.03  # largest change while it should not be touched
QUARTERS: Final = ("top_left", "top_right", "bottom_left", "bottom_right")


@dataclass(frozen=True, slots=True)
class Verdict:
    """Outcome; places are (row, column) from 0, from the top left."""

    noisy: tuple[tuple[int, int], ...] = ()
    still: tuple[tuple[int, int], ...] = ()
    touched: bool = False  # it was touched while it should rest, so that it says nothing


def noise(images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return each taxel's standard deviation about its slow change; images are (n, rows, columns).

    Half the median squared difference of successive images, so that a drift counts little.
    """
    if len(images) < 2:
        return np.zeros(images.shape[1:], np.float32)
    steps = np.diff(images, axis=0)
    return np.asarray(np.sqrt(np.mean(steps**2, axis=0) / 2), np.float32)


def noisy(level: NDArray[np.float32]) -> Mask:
    """Return which taxels are noisy, from the noise of all, (rows, columns)."""
    usual = max(float(np.median(level)), STEP / 2)
    return np.asarray(level > NOISY * usual)


def quarter(shape: tuple[int, int], name: str) -> Mask:
    """Return which taxels belong to a quarter; the middle ones belong to two or four."""
    rows, columns = np.indices(shape)
    middle_row, middle_column = (shape[0] - 1) / 2, (shape[1] - 1) / 2
    vertical = rows <= middle_row if name.startswith("top") else rows >= middle_row
    side = columns <= middle_column if name.endswith("left") else columns >= middle_column
    return np.asarray(vertical & side)


def still(images: NDArray[np.float32], place: Mask) -> Mask:
    """Return which taxels of a pressed quarter did not answer."""
    most = np.abs(images).max(axis=0)
    return np.asarray(place & (most < STILL * most[place].max()))


class SkinCheck:
    """Steps through the check, image by image.

    Attributes:
        stage: "rest", then the names of the quarters, then "over".
        verdict: What was found so far.
    """

    def __init__(self) -> None:
        """Begin with the rest."""
        self.stage = "rest"
        self.verdict = Verdict()
        self._images: list[Deviation] = []
        self._alive: set[tuple[int, int]] = set()
        self._last_s: float | None = None
        self._time_s = 0.0  # that counts in this stage

    @property
    def progress(self) -> float:
        """Share of the stage that is done, 0 to 1."""
        return min(1.0, self._time_s / (REST_S if self.stage == "rest" else PRESS_S))

    def step(self, image: Deviation, now_s: float) -> None:
        """Take an image, z - 1; in a quarter only time counts during which it is pressed."""
        passed_s = 0.0 if self._last_s is None else min(0.2, now_s - self._last_s)
        self._last_s = now_s
        if self.stage == "over":
            return
        resting = self.stage == "rest"
        place = np.full(image.shape, True) if resting else quarter(_shape(image), self.stage)
        change = np.abs(image)
        if not resting and change[place].max() < max(PRESSED, change.max()):
            return  # nothing is pressed, or another quarter is
        self._images.append(image.copy())
        self._time_s += passed_s
        if self.progress >= 1.0:
            self._conclude(np.array(self._images, np.float32), place)

    def _conclude(self, images: NDArray[np.float32], place: Mask) -> None:
        """End a stage."""
        found = self.verdict
        if self.stage == "rest":
            level = noise(images)
            loud = noisy(level)
            quiet = np.abs(images[:, ~loud])
            touched = bool(quiet.size and float(np.median(quiet.max(axis=1))) > _TOUCHED)
            self.verdict = Verdict(places(loud), (), touched)
            self.stage = "over" if touched else QUARTERS[0]
        else:
            silent = still(images, place)
            self._alive |= {*places(place & ~silent)}  # in this quarter or in one before
            left = {*found.still, *places(silent)} - self._alive
            self.verdict = Verdict(found.noisy, tuple(sorted(left)))
            after = [*QUARTERS[QUARTERS.index(self.stage) + 1 :], "over"]
            self.stage = after[0]
        self._images, self._time_s = [], 0.0


def places(mask: Mask) -> tuple[tuple[int, int], ...]:
    """Return the (row, column) of each marked taxel."""
    return tuple((int(row), int(column)) for row, column in np.argwhere(mask))


def named(found: Sequence[tuple[int, int]]) -> str:
    """Return places as the orb names them: row/column from 0."""
    return ", ".join(f"{row}/{column}" for row, column in found)


def _shape(image: Deviation) -> tuple[int, int]:
    return image.shape[0], image.shape[1]
