"""Scripts of simulated sessions: the hand's gestures step by step, before any sensor.

Two protocols. A `stream` has gestures and distractors in any order, as in play. `blocks` has each
class by itself for an equal time, as the paper collected its training data (section 4.2).
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.event_metric import Event
from controller.simulator.gesture_file import Repertoire
from controller.simulator.hand import DISTRACTORS, SLOTS, perform
from controller.simulator.user_style import UserStyle

Grid = tuple[int, int, float]  # rows, columns, pitch in mm

_MIDDLE_MM: Final = 2.5  # deviation of gestures that are meant for the middle, per axis
_SPARE_S: Final = 1.0  # nothing touches so shortly before the end

# Free streams.
_LEAD_S: Final = 3.0  # quiet time before the first event
_DISTRACTED: Final = 0.22  # share of contacts that are no gestures

# Class blocks. The pauses make 57 % of all frames static, as in the paper's data (section 6).
_BASELINE_S: Final = 10.5  # quiet time for the paper's 10 s of rest
_BLOCK_PAUSE: Final = (0.35, 0.92)  # in parts of the event before it
_NULL_PAUSE_S: Final = (2.0, 10.0)  # between distractors in the null block

# The label button beside the orb (paper, section 4.2), pressed with human timing.
# A prototype's choices, not measured; with them the button agrees with the truth in
# about nine frames of ten.
LATE_S: Final = 0.05  # people react rather than foresee
PRESS_SD_S: Final = 0.12
RELEASE_SD_S: Final = 0.15  # letting go is less exact
MISSED: Final = 0.005  # share of gestures that are never labelled


class SessionScript:
    """One session's finger paths and true events.

    Attributes:
        point: Hand points, complex mm from the dome's centre, (steps, SLOTS).
        depth_mm: Indentations, alike.
        radius_mm: Finger radii, alike.
        events: True gestures in order.
        distractors: Contacts that are no gestures, in order.
    """

    def __init__(
        self,
        steps: int,
        step_hz: float,
        grid: Grid,
        style: UserStyle,
        away_mm: tuple[float, float],
        repertoire: Repertoire,
        rng: np.random.Generator,
    ) -> None:
        """Prepare a hand that does nothing yet; the dome is `away_mm` from where it is thought."""
        self._steps, self._step_hz, self._grid = steps, step_hz, grid
        self._style, self._away_mm, self._repertoire = style, away_mm, repertoire
        self._rng = rng
        self.point = np.zeros((steps, SLOTS), dtype=np.complex128)
        self.depth_mm = np.zeros((steps, SLOTS))
        self.radius_mm = np.full((steps, SLOTS), 7.0)
        self.events: list[Event] = []
        self.distractors: list[Event] = []

    def stream(self, gestures: Sequence[str]) -> None:
        """Play gestures and distractors in any order until the end."""
        now: float | None = _LEAD_S
        while now is not None:
            kinds = gestures if self._rng.random() > _DISTRACTED else DISTRACTORS
            now = self._do(str(self._rng.choice(kinds)), now, self._steps)
            if now is not None:
                now += self._look()

    def blocks(self, gestures: Sequence[str]) -> None:
        """Play each class by itself, null first, the others in an order of this session's."""
        rng, block = self._rng, self._steps / (len(gestures) + 1)
        now = _BASELINE_S
        while (end := self._do(str(rng.choice(DISTRACTORS)), now, block)) is not None:
            now = end + rng.uniform(*_NULL_PAUSE_S)
        for number, kind in enumerate(rng.permutation(list(gestures)).tolist(), 1):
            now = max(_BASELINE_S, number * block / self._step_hz)
            while (end := self._do(kind, now, (number + 1) * block)) is not None:
                now = end + (end - now) * rng.uniform(*_BLOCK_PAUSE)

    def truth(
        self, time_s: NDArray[np.float64], labels: Sequence[str]
    ) -> tuple[NDArray[np.int8], NDArray[np.int32]]:
        """Return true labels and numbers of events (-1: none) at these times, all (times,)."""
        label = np.zeros(len(time_s), dtype=np.int8)
        number = np.full(len(time_s), -1, dtype=np.int32)
        for i, event in enumerate(self.events):
            during = slice(*np.searchsorted(time_s, (event.onset_s, event.release_s)))
            label[during], number[during] = labels.index(event.kind), i
        return label, number

    def contact(self, every: int) -> NDArray[np.float32]:
        """Return every finger's x, y (grid units) and depth (mm), (steps // every, SLOTS, 3).

        It is NaN where the finger does not touch.
        """
        rows, columns, pitch_mm = self._grid
        point, depth = self.point[every - 1 :: every], self.depth_mm[every - 1 :: every]
        x = point.real / pitch_mm + (columns - 1) / 2
        y = point.imag / pitch_mm + (rows - 1) / 2
        found = np.stack([x, y, depth], axis=-1).astype(np.float32)
        found[depth <= 0.0] = np.nan
        return found

    def _do(self, kind: str, now: float, last_step: float) -> float | None:
        """Do something at `now`, seconds, and return when it is over; None: it would not fit."""
        rng, hz = self._rng, self._step_hz
        done = perform(
            kind, self._place(kind), self._style, rng,
            grid=self._grid, step_hz=hz, repertoire=self._repertoire,
        )  # fmt: skip
        first = round(now * hz)
        last = first + len(done.point)
        if last + _SPARE_S * hz > last_step:
            return None
        self.point[first:last], self.depth_mm[first:last] = done.point, done.depth_mm
        self.radius_mm[first:last] = done.radius_mm
        event = Event(first / hz + done.onset_s, first / hz + done.release_s, kind)
        (self.distractors if self._repertoire[kind].distractor else self.events).append(event)
        return last / hz

    def _place(self, kind: str) -> tuple[float, float]:
        """Return where an event is meant to be, grid units."""
        rows, columns, pitch_mm = self._grid
        anywhere = kind in self._repertoire and self._repertoire[kind].place == "anywhere"
        if anywhere:
            x, y = self._rng.uniform(0.0, columns - 1.0), self._rng.uniform(0.0, rows - 1.0)
        else:
            spread = self._rng.normal(0.0, _MIDDLE_MM / pitch_mm, 2)
            x, y = (columns - 1) / 2 + spread[0], (rows - 1) / 2 + spread[1]
        return float(x + self._away_mm[0] / pitch_mm), float(y + self._away_mm[1] / pitch_mm)

    def _look(self) -> float:
        """Return the time until the next event: brisk play, now and then a long look, seconds."""
        long = self._rng.random() < 0.12
        return float(self._rng.uniform(3.0, 7.0) if long else self._rng.uniform(0.35, 1.5))


def hold_button(
    events: Sequence[Event],
    labels: Sequence[str],
    time_s: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.int8]:
    """Return the index of the label that the button gives at times, all (frames,); 0: it is up."""
    missed = rng.random(len(events)) < MISSED
    error = rng.normal(LATE_S, (PRESS_SD_S, RELEASE_SD_S), (len(events), 2))
    down = np.array([event.onset_s for event in events]) + error[:, 0]
    up = np.maximum(np.array([event.release_s for event in events]) + error[:, 1], down)
    button = np.zeros(len(time_s), dtype=np.int8)
    first, last = np.searchsorted(time_s, down), np.searchsorted(time_s, up)
    for i in np.flatnonzero(~missed).tolist():
        button[first[i] : last[i]] = labels.index(events[i].kind)
    return button
