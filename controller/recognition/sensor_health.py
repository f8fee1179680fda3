"""Runtime health monitor of the sensor: faults in sentences with what to do.

Frame by frame: taxels that have no lead or feel nothing, rest that drifts and why, a hand that
never leaves. It only reports; what keeps play going is `controller.recognition.preprocess`. Pure.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition import drift
from controller.recognition.preprocess import Prepared
from controller.recognition.taxel_text import names

Map = NDArray[np.floating]  # (rows, columns)
Mask = NDArray[np.bool_]  # (rows, columns)

MOST: Final = 8  # sentences at once
LETTERS: Final = 120  # of each

_EVERY_S: Final = 1.0
_LOST_S: Final = 1.0  # a lead that is off for less crackles
_CRACKLES: Final = 3  # losses within `_CRACKLING_S` that are told as well
_CRACKLING_S: Final = 30.0
_UNREADY_S: Final = 10.0
_TOUCHED_S: Final = 60.0  # no gesture lasts so long
# The drift that is told, as ln C / C0. Sound orbs of both presets wander by 1 % together and by 3 %
# each (SD), so a line's mean by 1.3 % against the others.
_COMMON: Final = 0.08
_LINE: Final = 0.12
_FILM: Final = 0.3
_LESS: Final = 0.7  # what was told is told until it is so much less


class _Told:
    """What was last said, so that it is not said and unsaid again and again."""

    def __init__(self) -> None:
        self.common = False
        self.lines: frozenset[tuple[str, int]] = frozenset()
        self.film: frozenset[int] = frozenset()


class HealthMonitor:
    """Watches one session.

    Attributes:
        found: What is not as it should be, worst first; () while all is well.
    """

    def __init__(self, rate_hz: float, *, ratio: bool, before: Map | None = None) -> None:
        """Begin before the first frame.

        Args:
            rate_hz: Frames per second.
            ratio: Frames are capacitances, so that they can drift by a factor.
            before: Rest as it was calibrated; the session's first one if not given.
        """
        self.found: tuple[str, ...] = ()
        self._rate_hz, self._ratio = rate_hz, ratio
        self._before = before
        self._told = _Told()
        self._frame = 0
        self._busy_run = 0
        self._lost_run: NDArray[np.int64] | None = None
        self._losses: list[int] = []  # frames in which a lead went off
        self._was_lost = False
        self._ready = False

    def notice(self, prepared: Prepared) -> None:
        """Take what the next frame became, which the preprocessor says."""
        self._frame += 1
        self._ready |= prepared.ready
        self._busy_run = self._busy_run + 1 if prepared.ready and not prepared.quiet else 0
        self._count(prepared.lost, prepared.image.shape)

    def look(self, dead: Mask | None, rest: Map | None) -> tuple[str, ...]:
        """Return what is found; once a second it is looked for anew.

        Args:
            dead: Taxels that do not answer to touch.
            rest: The preprocessor's rest image; None: not known yet.
        """
        if self._frame % max(1, round(_EVERY_S * self._rate_hz)) == 0:
            told = [
                *self._leads(),
                *self._silent(dead),
                *self._hands(),
                *self._drift(rest),
            ]
            self.found = tuple(line[:LETTERS] for line in told[:MOST])
        return self.found

    def _count(self, lost: Mask | None, shape: tuple[int, ...]) -> None:
        """Count for how long leads have been off, and how often."""
        if self._lost_run is None:
            self._lost_run = np.zeros(shape, dtype=np.int64)
        if lost is None:
            self._lost_run[:] = 0
        else:
            self._lost_run = np.where(lost, self._lost_run + 1, 0)
            if not self._was_lost:
                self._losses.append(self._frame)
        self._was_lost = lost is not None

    def _leads(self) -> list[str]:
        assert self._lost_run is not None
        off = self._lost_run >= _LOST_S * self._rate_hz
        if off.any():
            return [f"{names(off)}: no signal, play goes on without; fasten the lead"]
        since = self._frame - _CRACKLING_S * self._rate_hz
        self._losses = [frame for frame in self._losses if frame > since]
        if len(self._losses) >= _CRACKLES:
            return ["a lead crackles: it was off and on again several times; fasten leads and plug"]
        return []

    def _silent(self, dead: Mask | None) -> list[str]:
        if dead is None:
            return []
        return [f"{names(dead)}: no answer to touch, filled in; run: controller doctor"]

    def _hands(self) -> list[str]:
        if not self._ready and self._frame >= _UNREADY_S * self._rate_hz:
            return ["no quiet second since the start; take hands and things off the orb"]
        if self._busy_run >= _TOUCHED_S * self._rate_hz:
            minutes = self._busy_run / self._rate_hz / 60.0
            return [f"something has touched the orb for {minutes:.0f} min; take it off"]
        return []

    def _drift(self, rest: Map | None) -> list[str]:
        """Say how far rest has drifted, by cause."""
        if rest is None or not self._ratio:
            return []
        if self._before is None:
            self._before = rest.copy()
            return []
        least = 1e-3
        told, why = self._told, drift.causes(
            np.maximum(self._before, least), np.maximum(rest, least)
        )  # fmt: skip
        lines = []
        told.common = abs(why.common) > _COMMON * (_LESS if told.common else 1.0)
        if told.common:
            lines.append(_air(why.common))
        marked = []
        for word, sizes in (("row", why.rows), ("column", why.columns)):
            for i, size in enumerate(sizes.tolist()):
                if abs(size) > _LINE * (_LESS if (word, i) in told.lines else 1.0):
                    marked.append((word, i))
                    percent = 100 * np.expm1(size)
                    lines.append(f"{word} {i} has drifted by {percent:+.0f} %; look at its lead")
        told.lines = frozenset(marked)
        flat = why.film.ravel()
        limits = [_FILM * (_LESS if i in told.film else 1.0) for i in range(flat.size)]
        far = np.abs(flat) > limits
        told.film = frozenset(np.flatnonzero(far).tolist())
        if far.any():
            percent = 100 * np.expm1(np.median(flat[far]))
            where = names(far.reshape(why.film.shape))
            lines.append(f"{where}: drifted by {percent:+.0f} %; the film may be cracking")
        return lines


def _air(common: float) -> str:
    """Say what all taxels have in common; C goes with the square of the pressure."""
    pressure = 100 * np.expm1(common / 2.0)
    if common < 0.0:
        return f"pressure down {-pressure:.0f} %: pump (or the orb has cooled)"
    return f"pressure up {pressure:.0f} %: let air out (or the orb has warmed)"
