"""Runtime health monitor of the sensor: faults in sentences with their remedies.

It detects open leads, dead taxels, drift of the baseline with its cause, and touches that never
end. It only reports; `controller.recognition.images.preprocess` compensates. Pure.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images import drift
from controller.recognition.images.preprocess import Prepared
from controller.shared.aliases import Mask
from controller.shared.notices import notice
from controller.shared.taxel_measures import taxel_names

Map = NDArray[np.floating]  # (rows, columns)

MOST: Final = 8  # sentences at once

_EVERY_S: Final = 1.0
_LOST_S: Final = 1.0  # least duration of an open lead; a shorter one is intermittent
_CRACKLES: Final = 3  # losses within `_CRACKLING_S` that are reported, too
_CRACKLING_S: Final = 30.0
_UNREADY_S: Final = 10.0
_TOUCHED_S: Final = 60.0  # longer than any gesture
_LEFT_SHARE: Final = 0.3  # of its greatest deviation, below which a touch has left
# Least reported drift, ln C / C0. Sound orbs of both presets drift by 1 % in common, by 3 % a taxel
# (SD), so the mean of a line by 1.3 % against the others.
_COMMON: Final = 0.08
_LINE: Final = 0.12
_FILM: Final = 0.3
_LESS: Final = 0.7  # a drift stays reported down to this share of its limit


class HealthMonitor:
    """Health monitor of one session.

    Attributes:
        found: Faults in sentences, worst first; () if there are none.
        due: Whether `check` searches for faults after this frame.
    """

    def __init__(self, rate_hz: float, *, ratio: bool, before: Map | None = None) -> None:
        """Begin before the first frame.

        Args:
            rate_hz: Frames per second.
            ratio: Whether frames are capacitances, which drift by a factor.
            before: Calibrated baseline, (rows, columns); None: the first one of the session.
        """
        self.found: tuple[str, ...] = ()
        self.due = False
        self._every = max(1, round(_EVERY_S * rate_hz))
        self._rate_hz, self._ratio = rate_hz, ratio
        self._before = before
        self._drifted: set[object] = set()  # reported: "all", (line, index), or taxel index
        self._frame = 0
        self._busy_run, self._strongest = 0, 0.0  # frames of a touch; its greatest deviation
        self._lost_run: NDArray[np.int64] | None = None
        self._losses: list[int] = []  # frames in which a lead went off
        self._was_lost = False
        self._ready = False

    def notice(self, prepared: Prepared) -> None:
        """Take the next preprocessed frame: count frames and losses of open leads."""
        self._frame += 1
        self.due = self._frame % self._every == 0
        self._ready |= prepared.ready
        stays = not prepared.quiet and prepared.deviation >= _LEFT_SHARE * self._strongest
        self._busy_run = self._busy_run + 1 if prepared.ready and stays else 0
        self._strongest = max(prepared.deviation, self._strongest if stays else 0.0)
        if self._lost_run is None:
            self._lost_run = np.zeros(prepared.image.shape, dtype=np.int64)
        lost = prepared.lost
        if lost is not None:
            self._lost_run = np.where(lost, self._lost_run + 1, 0)
            if not self._was_lost:
                self._losses.append(self._frame)
        elif self._was_lost:
            self._lost_run[:] = 0
        self._was_lost = lost is not None

    def check(self, dead: Mask | None, rest: Map | None) -> tuple[str, ...]:
        """Return the faults found; they are searched once a second.

        Args:
            dead: Dead taxels, (rows, columns).
            rest: The baseline, (rows, columns); None: not known yet.
        """
        if self.due:
            silent = [] if dead is None else [notice("taxels_dead", taxel_names(dead))]
            lines = [*self._leads(), *silent, *self._hands(), *self._drift(rest)]
            self.found = tuple(lines[:MOST])
        return self.found

    def _leads(self) -> list[str]:
        assert self._lost_run is not None
        off = self._lost_run >= _LOST_S * self._rate_hz
        if off.any():
            return [notice("lead_off", taxel_names(off))]
        since = self._frame - _CRACKLING_S * self._rate_hz
        self._losses = [frame for frame in self._losses if frame > since]
        if len(self._losses) >= _CRACKLES:
            return [notice("lead_crackles")]
        return []

    def _hands(self) -> list[str]:
        if not self._ready and self._frame >= _UNREADY_S * self._rate_hz:
            return [notice("never_quiet")]
        if self._busy_run >= _TOUCHED_S * self._rate_hz:
            return [notice("touched_long", self._busy_run / self._rate_hz / 60.0)]
        return []

    def _drift(self, rest: Map | None) -> list[str]:
        """Return lines about the drift of the baseline, (rows, columns), by cause."""
        if rest is None or not self._ratio:
            return []
        if self._before is None:
            self._before = rest.copy()
            return []
        least = 1e-3
        found = drift.causes(np.maximum(self._before, least), np.maximum(rest, least))
        before, self._drifted = self._drifted, set()

        def drifted(what: object, size: float, limit: float) -> bool:
            """Return whether a drift is reported, with hysteresis, and record it."""
            far = abs(size) > limit * (_LESS if what in before else 1.0)
            if far:
                self._drifted.add(what)
            return far

        lines = [_air(found.common)] if drifted("all", found.common, _COMMON) else []
        for word, sizes in (("row", found.rows), ("column", found.columns)):
            for i, size in enumerate(sizes.tolist()):
                if drifted((word, i), size, _LINE):
                    lines.append(notice("line_drifted", notice(word, i), 100 * np.expm1(size)))
        flat = found.film.ravel()
        far = np.array([drifted(i, size, _FILM) for i, size in enumerate(flat.tolist())])
        if far.any():
            where = taxel_names(far.reshape(found.film.shape))
            lines.append(notice("film_drifted", where, 100 * np.expm1(np.median(flat[far]))))
        return lines


def _air(common: float) -> str:
    """Return the line for a drift of all taxels; C varies with the square of the pressure."""
    pressure = 100 * np.expm1(common / 2.0)
    return notice("pressure_down" if common < 0.0 else "pressure_up", abs(pressure))
