"""Contacts that lie on the sensor while another one begins, which is answered by its own.

A thumb that rests and the fingers of a pinch that is held are in every image; a press beside them
is what is added. So where images were steady for .2 s and then gain at another place and lose at
none, what they showed is subtracted from all that follow, until it has left. A finger that slides
loses where it was; one that presses deeper gains where it is; pressure changes all taxels alike.

On a noisy sensor a finger's part of a few images cannot be told from noise. While a pinch is held,
networks may find a press likely all the same: what lay there some time before is subtracted then.
"""

import math
from collections import deque
from typing import Final

import numpy as np

from controller.recognition.images.frames import Image, Window
from controller.shared.aliases import Change, State

_LANDING_S: Final = 0.1  # a finger that lands is seen after it
_STEADY_S: Final = 0.2  # of images before that
_LOOKBACK_S: Final = 0.6  # from the first of them until networks find a press beside it likely
# Share of what lies by which these may differ, and of a new contact's gain that others may lose
_UNSTEADY, _LOST = 0.2, 0.4
_LEFT: Final = 0.4  # share of what lies, with which it has left
_UNDER: Final = 0.65  # share of its strength from which on a taxel is under what lies
_LEAST: Final = 0.08  # norm of z - 1 of what counts as lying
_WHOLE: Final = 0.7  # share of it, with which all of it is there: a contact beside it weakens it
_QUIET: Final = 0.03  # noise above which a finger's part of an image is not seen soon enough
_CLEAR: Final = 3.0  # deviations of its noise: a change that is none of it
_TO_SIGMA: Final = float(np.sqrt(np.pi / 2.0))  # of a normal deviate's mean magnitude


class LyingContact:
    """What lies on the sensor, and for how long it has been subtracted."""

    def __init__(self, rows: int, columns: int, rate_hz: float, share: float) -> None:
        """Begin with nothing.

        Args:
            rows: Rows of taxels.
            columns: Columns of taxels.
            rate_hz: Images a second.
            share: Of the strength of what lies, that another contact adds at least; 0: none is
                looked for.
        """
        self._share = share
        self._landing = max(2, round(_LANDING_S * rate_hz))
        self._steady = max(1, round(_STEADY_S * rate_hz))
        self._recent: deque[Change] = deque(maxlen=round(_LOOKBACK_S * rate_hz))  # z - 1 in order
        self._lies: Change = np.zeros((rows, columns))
        self._since = 0  # images since something began or ended to lie; 0: long ago

    def step(self, image: Image, idle: float, *, pressed: bool = False) -> bool:
        """Take the next image; return whether another contact has begun beside what lies.

        Args:
            image: z, (rows, columns); a touch lowers it.
            idle: Mean of |z - 1| while nothing touches.
            pressed: The networks find a press beside it likely.
        """
        if self._share == 0.0:
            return False
        signal = image.astype(np.float64) - 1.0
        self._recent.append(signal)
        self._since += self._since > 0
        if self._lies.any() and float(self._there(signal)) < _LEFT:
            self._lies, self._since = np.zeros_like(self._lies), 1
        most = self._landing + self._steady
        if len(self._recent) < most or (idle > _QUIET and not pressed):
            return False
        recent = np.array(self._recent)[0 if pressed else -most :]
        if not (pressed or self._begins(recent, idle)):
            return False
        steady = recent[: self._steady]
        self._lies = np.minimum(steady.mean(axis=0), 0.0)
        self._since = self._landing + self._steady // 2
        self._recent.clear()
        return True

    def _begins(self, recent: Change, idle: float) -> bool:
        """Whether the newest images gain at another place than steady ones before them show."""
        before, newest = recent[: self._steady], recent[-2:].mean(axis=0)
        lies, variance = np.minimum(before.mean(axis=0), 0.0), (_TO_SIGMA * idle) ** 2
        strength = _above(lies - np.median(lies), variance / len(before))
        unsteady = _above(before - lies, variance) / math.sqrt(len(before))
        if strength < _LEAST or unsteady > _UNSTEADY * strength:
            return False
        noise, gain = variance * (0.5 + 1.0 / len(before)), newest - lies
        own = gain - np.median(gain)  # pressure changes all taxels alike
        deeper = max(0.0, float((own * lies).sum()) / float(np.square(lies).sum()))
        own -= deeper * lies
        if _above(own, noise) < self._share * strength:
            return False
        if lies.flat[own.argmin()] < _UNDER * lies.min():  # it is the same that slides or deepens
            return False
        added, lost = np.minimum(gain, 0.0), np.maximum(gain, 0.0)
        return _above(lost, noise / 2) <= _LOST * _above(added, noise / 2)

    def added(self, images: Image) -> Image:
        """Return images, z, (..., rows, columns), without what lies and is still there."""
        if not self._lies.any():
            return images
        share = self._there(images.astype(np.float64) - 1.0)[..., None, None]
        return np.asarray(images - share * self._lies, dtype=np.float32)

    def window(self, window: Window) -> Window:
        """Return a window, (n, rows, columns), without what lies or has just left."""
        if self._since == 0 or (self._since > len(window) and not self._lies.any()):
            return window
        shown = self.added(window).copy()
        shown[: max(0, len(window) - self._since)] = 1.0
        return shown

    def _there(self, signals: Change) -> Change:
        """Return the share of what lies that is in each z - 1, (..., rows, columns), 0 to 1."""
        core = self._lies <= 0.5 * self._lies.min()  # where a contact elsewhere changes little
        whole = _WHOLE * float(self._lies[core].sum())
        return np.asarray(np.clip((signals * core).sum(axis=(-2, -1)) / whole, 0.0, 1.0))

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        if self._share == 0.0:
            return {}
        recent = np.array(self._recent) if self._recent else np.empty((0, *self._lies.shape))
        since = np.array([float(self._since)])
        return {"recently": recent, "lies": self._lies.copy(), "since": since}

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        if self._share == 0.0:
            return
        self._recent.clear()
        self._recent.extend(state["recently"])
        self._lies, self._since = np.minimum(state["lies"], 0.0), int(state["since"][0])


def _above(change: Change, variance: float) -> float:
    """Return the norm of a change, (rows, columns), above its noise; 0 if it may be noise."""
    excess = float(np.square(change).sum()) - change.size * variance
    clear = _CLEAR * variance * math.sqrt(2.0 * change.size)
    return math.sqrt(excess) if excess > clear else 0.0
