"""Scripts of simulated sessions: the hand's gestures step by step, before any sensor.

Two protocols. A `stream` has gestures and distractors in any order, as in play. `blocks` has each
class by itself for an equal time, as the paper collected its training data (section 4.2).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.event_metric import Event
from controller.simulator.hand.gesture_file import Repertoire
from controller.simulator.hand.performance import (
    BRIEF,
    DISTRACTORS,
    LOCATED,
    SLOTS,
    Performance,
    perform,
)
from controller.simulator.hand.user_style import UserStyle

Grid = tuple[int, int, float]  # rows, columns, pitch in mm

_MIDDLE_MM: Final = 2.5  # deviation of gestures that are meant for the middle, per axis
_SPARE_S: Final = 1.0  # nothing touches so shortly before the end

# Free streams.
_LEAD_S: Final = 3.0  # quiet time before the first event
_DISTRACTED: Final = 0.22  # share of contacts that are no gestures
_UNRULY_DISTRACTED: Final = 0.4  # the same in the turns of an unruly hand
_UNRULY_PAUSE_S: Final = (0.3, 0.9)
_MIDDLE_OFF_MM: Final = 15.0  # farthest that such a hand is from the middle that it means
_UNDER: Final = ("thumb", "pinch_held")  # contacts that may last while another finger presses
_UNDER_S: Final = (0.8, 1.4)  # from their beginning to the first press
_FAR_MM: Final = 17.0  # from them to that finger, at least
_BURST: Final = (2, 9)  # fewest and most quick gestures in a row, the latter excluded
_PRESSES: Final = 0.6  # share of such rows that are presses alone
_PERIOD_S: Final = (0.18, 0.8)  # of them
_APART_S: Final = 0.075  # from the end of a label to the next
# A pinch or a twist is over when its fingers have come to rest, though they may stay on the dome.
_SETTLED_S: Final = 0.15  # from the last movement to the end of the label
_MOVING_MM_S: Final = 15.0

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
        self._finger: list[int] = []  # slot of its first finger
        self._settled_s: list[float] = []  # when the fingers of each have come to rest

    def stream(self, gestures: Sequence[str], quick: float = 0.0, unruly: float = 0.0) -> None:
        """Play gestures and distractors in any order until the end.

        Args:
            gestures: Labels.
            quick: Share of turns in which several quick gestures follow each other.
            unruly: Share of the other turns that have other forms of the gestures (slides, winding
                up, trembling, light and off-middle ones) and many touches that are none.
        """
        now: float | None = _LEAD_S
        while now is not None:
            if quick and self._rng.random() < quick:
                now = self._burst(gestures, now)
                continue
            if unruly and self._rng.random() < unruly:
                now = self._unruly(gestures, now)
                continue
            kinds = gestures if self._rng.random() > _DISTRACTED else DISTRACTORS
            now = self._do(str(self._rng.choice(kinds)), now, self._steps)
            if now is not None:
                now += self._look()

    def blocks(self, gestures: Sequence[str]) -> None:
        """Play each class by itself, null first, the others in an order of this session's."""
        rng, block = self._rng, self._steps / (len(gestures) + 1)
        now = _BASELINE_S
        while (end := self._do(str(rng.choice(BRIEF)), now, block)) is not None:
            now = end + rng.uniform(*_NULL_PAUSE_S)
        for number, kind in enumerate(rng.permutation(list(gestures)).tolist(), 1):
            now = max(_BASELINE_S, number * block / self._step_hz)
            while (end := self._do(kind, now, (number + 1) * block)) is not None:
                now = end + (end - now) * rng.uniform(*_BLOCK_PAUSE)

    def _burst(self, gestures: Sequence[str], now: float) -> float | None:
        """Play quick gestures one after the other, or presses alone at one place or two."""
        rng = self._rng
        located = [label for label in gestures if label in LOCATED]
        kinds = located if located and rng.random() < _PRESSES else gestures
        places = [self._place(str(rng.choice(kinds))) for _ in range(rng.integers(1, 3))]
        period = rng.uniform(*_PERIOD_S)
        end: float | None = now
        for number in range(rng.integers(*_BURST)):
            kind, began = str(rng.choice(kinds)), now
            place = places[number % len(places)] if kinds is located else None
            end = self._do(kind, now, self._steps, place, quick=True)
            if end is None:
                return None
            # The next finger comes down in its time, often while the last one rises.
            now = max(began + period * rng.uniform(0.9, 1.1), end + rng.uniform(-0.1, 0.1))
        return now + self._look()

    def _unruly(self, gestures: Sequence[str], now: float) -> float | None:
        """Play another form of a gesture, or a touch that is none."""
        rng = self._rng
        kind, place = str(rng.choice(DISTRACTORS)), None
        if rng.random() >= _UNRULY_DISTRACTED:
            label = str(rng.choice(gestures))
            forms = [name for name, one in self._repertoire.items() if one.form_of == label]
            kind = str(rng.choice(forms or [label]))
            if self._repertoire[kind].place == "middle":
                away = rng.uniform(0.0, _MIDDLE_OFF_MM / self._grid[2])
                x, y = self._place(kind)
                angle = rng.uniform(0.0, 2 * np.pi)
                place = x + away * np.cos(angle), y + away * np.sin(angle)
        end = self._do(kind, now, self._steps, place)
        located = [label for label in gestures if label in LOCATED]
        if end is not None and kind in _UNDER and located:
            end = self._press_beside(str(rng.choice(located)), now, end)
        return None if end is None else end + rng.uniform(*_UNRULY_PAUSE_S)

    def _press_beside(self, kind: str, now: float, end: float) -> float | None:
        """Press far from the contacts of `now` to `end`, seconds, until they leave."""
        rng, (rows, columns, pitch_mm) = self._rng, self._grid
        at, last = now + rng.uniform(*_UNDER_S), end
        while at < end - 0.4:
            step = round(at * self._step_hz)
            there = self.point[step, self.depth_mm[step] > 0.0]
            place = self._place(kind)
            point = complex(place[0] - (columns - 1) / 2, place[1] - (rows - 1) / 2) * pitch_mm
            if len(there) and np.abs(there - point).min() > _FAR_MM:
                done = self._do(kind, at, self._steps, place, quick=rng.random() < 0.4)
                if done is None:
                    return None
                last, at = max(end, done), done
            at += rng.uniform(0.1, 0.7)
        return last

    def truth(
        self, time_s: NDArray[np.float64], labels: Sequence[str]
    ) -> tuple[NDArray[np.int8], NDArray[np.int32]]:
        """Return true labels and numbers of events (-1: none) at these times, all (times,).

        A label ends a little before the next one begins, so that quick gestures can be told apart.
        """
        label = np.zeros(len(time_s), dtype=np.int8)
        number = np.full(len(time_s), -1, dtype=np.int32)
        following = [event.onset_s - _APART_S for event in self.events[1:]]
        for i, event in enumerate(self.events):
            next_s = following[i] if i < len(following) else np.inf
            end_s = max(event.onset_s, min(event.release_s, next_s, self._settled_s[i]))
            during = slice(*np.searchsorted(time_s, (event.onset_s, end_s)))
            label[during], number[during] = labels.index(event.kind), i
        return label, number

    def touch(self, number: NDArray[np.int32], every: int) -> NDArray[np.float32]:
        """Return where the first finger of each frame's event is, grid units, (frames, 2).

        Args:
            number: Number of the event in each frame, -1: none, (frames,).
            every: Steps in a frame.
        """
        slot = np.array([*self._finger, 0])[number]
        return self.contact(every)[np.arange(len(number)), slot, :2]

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

    def _do(
        self,
        kind: str,
        now: float,
        last_step: float,
        place: tuple[float, float] | None = None,
        *,
        quick: bool = False,
    ) -> float | None:
        """Do something at `now`, seconds, and return when it is over; None: it would not fit."""
        rng, hz = self._rng, self._step_hz
        done = perform(
            kind,
            place or self._place(kind),
            self._style,
            rng,
            grid=self._grid,
            step_hz=hz,
            repertoire=self._repertoire,
            quick=quick,
        )
        first = round(now * hz)
        last = first + len(done.point)
        if last + _SPARE_S * hz > last_step:
            return None
        # A finger that comes down while the last one rises is another finger.
        fingers = int((done.depth_mm > 0.0).any(axis=0).sum())
        free = np.flatnonzero(self.depth_mm[first] == 0.0)
        while len(free) < fingers:
            first, last = first + 1, last + 1
            free = np.flatnonzero(self.depth_mm[first] == 0.0)
        where = slice(first, last), free[:fingers]
        self.point[where] = done.point[:, :fingers]
        self.depth_mm[where] = done.depth_mm[:, :fingers]
        self.radius_mm[where] = done.radius_mm[:fingers]
        begun = first / hz
        kind = self._repertoire[kind].form_of or kind
        event = Event(begun + done.onset_s, begun + done.release_s, kind)
        if self._repertoire[kind].distractor:
            self.distractors.append(event)
        else:
            if self.events and self.events[-1].release_s > event.onset_s:
                self.events[-1] = replace(self.events[-1], release_s=event.onset_s)
            self.events.append(event)
            self._finger.append(int(free[0]))
            settled = event.release_s if kind in LOCATED else begun + _settled(done, hz)
            self._settled_s.append(max(settled, event.onset_s + _SETTLED_S))
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


def _settled(done: Performance, step_hz: float) -> float:
    """Return when its fingers have come to rest, seconds from its start."""
    firm = done.depth_mm[1:] > 0.5
    moves = (np.abs(np.diff(done.point, axis=0)) * firm).max(axis=1) * step_hz > _MOVING_MM_S
    moves |= np.diff(done.depth_mm, axis=0).max(axis=1) * step_hz > _MOVING_MM_S
    return float(np.flatnonzero(moves).max(initial=0) + 1) / step_hz + _SETTLED_S


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
