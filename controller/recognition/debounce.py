"""Decision of a gesture from its probabilities: as soon as it is sure, and one per touch.

A touch begins when the smoothed probability of all gestures together reaches `off`, and ends when
it falls below. In a touch one gesture fires, at the first of these moments:

- its smoothed probability reaches a bound that falls from `on` to `late` in the touch's first
  `wait_s`: early evidence must be clearer, since gestures begin alike. On a quiet sensor that of a
  `brisk` gesture falls on slowly: a finger that lands slowly and stays looks like one that rests;
- the touch ends and it was the most probable one, at least `least` at its height and
  `brief_s` long in all (its probabilities, added over time): a tap too short for the first. The
  finger must have left: where the level of the contact stays, the network has found that the touch
  is no gesture, as of an elbow that first looked like a finger. And it must have landed after the
  last answer: pressure moves all taxels alike, and a finger that slides off
  the dome, or stays and is doubted for a moment, came before.

A `brisk` gesture, as a press, fires only within `landed_s` of a landing in any case: what lies
there for longer is a resting hand.

A gesture that may begin as its opposite, as a twist that is wound up, is `slow`: it fires when the
touch has lasted for `slow_s`, or ended. Where the fingers' angle is known, it decides how long to
wait, and confirms what is less sure (`controller.recognition.turn`).

Noise in the frames is noise in the probabilities, so a noisier sensor's are averaged for longer
(`DebounceSettings.weight`): a quiet one's touch begins and ends in the frame that shows it. A tap
of a noisier sensor needs more evidence, too (`DebounceSettings.tap`).

A taught gesture may begin like an older one, as a double tap like a press. Then the older one, if
`patient`, waits for `patience_s` whether an `awaited` one follows, which takes its place.

Sequential decisions of this kind go back to Wald's test, with a bound that collapses over time:
answer early where the evidence is clear, wait where it is not, but not for ever. The paper names a
debouncing filter (section 5) without describing it.

`controller.recognition.debounced_stream` does the same for a whole recording at once.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from controller.recognition.contact import ContactEstimate
from controller.recognition.turn import (
    CONFIRMED_PROBABILITY,
    DOUBTED_PROBABILITY,
    Turned,
    TurnTracker,
)
from controller.shared.aliases import Array, State

Probabilities = NDArray[np.floating]  # (frames, classes), "null" first
Means = NDArray[np.float64]  # (frames, classes): smoothed probabilities
Values = TypeVar("Values", float, NDArray[np.float64])

BEFORE_S = 0.25  # the lowest level in this time is that before a touch
_RISE_SHARE = 0.5  # share of the uneven level, by which a contact that lands has raised it
_FINGER_SHARE = 0.06  # share of the highest level, by which it does so, too
_UNTIL_LEFT = 1.3  # times `landed_s`: a finger that has left did not rest
KEPT_S = 10.0  # a contact that landed before that has been there for ever
_HOLDING = 0.3  # share of the level's rise that a held gesture keeps at least
# Above `least`: to there the bound of a brisk gesture falls after `wait_s`, in so many times of it
_SLOW_MARGIN, _SLOW_WAITS = 0.2, 3.0
_PRESS_LIKELY_PROBABILITY = 0.5  # smoothed probability of a brisk gesture beside what is held
_LEAST_CLEAR = 0.4  # however noisy the sensor, taps do not need more evidence than with this

NULL = 0  # the class "null" comes first in every bundle


@dataclass(frozen=True, slots=True)
class DebounceSettings:
    """Settings of the debouncer; tuned on development streams, stored in the bundle.

    Attributes:
        smoothing: Weight of a noiseless sensor's newest probabilities in the running mean, above 0,
            at most 1.
        on: Smoothed probability at which a gesture fires as a touch begins; above 1: none does.
        off: Smoothed probability of all gestures together at which a touch begins and ends.
        wait_s: Time in a touch after which `late` is enough; 0: `on` stays.
        late: Smoothed probability at which a gesture fires from then on; a brisk one as in `bound`.
        least: Greatest smoothed probability in a noiseless sensor's touch that suffices at its
            end; above 1: none.
        brief_s: Least sum of the gesture's smoothed probabilities over the time of that touch.
        noise: Mean deviation of the untouched sensor, z, that halves `smoothing`; 0: none does.
        lifted: Share of the rise of the contact's level, below which the end of a touch is that of
            the contact; above 1: any is.
        landed_s: Time after a contact's landing in which a brisk gesture fires, where the contact's
            level is known; as a tap, 1.3 times as late.
        brisk: Labels that fire only then.
        slow: Labels that may begin as another gesture: of twists the clockwise one first.
        slow_s: Time in a touch before which they do not fire.
        patient: Labels that wait for an awaited one.
        awaited: Labels that may begin like those.
        patience_s: How long they wait.
        eager: Labels that none waits for, though they begin alike.
    """

    smoothing: float = field(default=0.4, metadata={"range": (0.01, 1.0)})
    on: float = field(default=0.8, metadata={"range": (0.0, 2.0)})
    off: float = field(default=0.35, metadata={"range": (0.0, 1.0)})
    wait_s: float = field(default=0.0, metadata={"range": (0.0, 10.0)})
    late: float = field(default=1.0, metadata={"range": (0.0, 1.0)})
    least: float = field(default=2.0, metadata={"range": (0.0, 2.0)})
    brief_s: float = field(default=0.0, metadata={"range": (0.0, 10.0)})
    noise: float = field(default=0.0, metadata={"range": (0.0, 10.0)})
    lifted: float = field(default=2.0, metadata={"range": (0.0, 2.0)})
    landed_s: float = field(default=0.85, metadata={"range": (0.01, 10.0)})
    brisk: tuple[str, ...] = ()
    slow: tuple[str, ...] = ()
    slow_s: float = field(default=0.0, metadata={"range": (0.0, 10.0)})
    patient: tuple[str, ...] = ()
    awaited: tuple[str, ...] = ()
    patience_s: float = field(default=0.0, metadata={"range": (0.0, 10.0)})
    eager: tuple[str, ...] = ()

    def for_labels(self, labels: Sequence[str]) -> "DebounceSettings":
        """Return the settings for a network with these labels; other labels are left out."""

        def own(named: Sequence[str]) -> tuple[str, ...]:
            return tuple(label for label in named if label in labels)

        awaited, eager = own(self.awaited), own(self.eager)
        patient = own(self.patient) if awaited else ()
        brisk, slow = own(self.brisk), own(self.slow)
        return replace(self, brisk=brisk, slow=slow, patient=patient, awaited=awaited, eager=eager)

    def weight(self, idle: Values) -> Values:
        """Return the weight of the newest probabilities, that of each frame for an array.

        Args:
            idle: Mean of |z - 1| while nothing touches.
        """
        if self.noise == 0.0:
            return 0.0 * idle + self.smoothing
        return self.smoothing / (1.0 + idle / self.noise)

    def bound(self, touch_s: Values, least: Values, *, brisk: bool) -> Values:
        """Return the smoothed probability at which a gesture fires after so long in a touch.

        `least` is the first result of `tap`.
        """
        if self.wait_s == 0.0:
            return 0.0 * touch_s + self.on
        waited = touch_s / self.wait_s
        needed: Values = self.on + (self.late - self.on) * np.minimum(1.0, waited)
        if brisk:
            fallen = np.clip((waited - 1.0) / _SLOW_WAITS, 0.0, 1.0)
            needed = needed - fallen * np.maximum(0.0, needed - least - _SLOW_MARGIN)
        return needed

    def tap(self, idle: Values) -> tuple[Values, Values]:
        """Return `least` and `brief_s` on a sensor with that noise, `idle` as in `weight`."""
        clear = np.maximum((self.weight(idle) / self.smoothing) ** 2, _LEAST_CLEAR)
        return 1.0 - (1.0 - self.least) * clear, self.brief_s / clear


class Debouncer:
    """Debouncer of a session: one gesture per touch.

    Attributes:
        tapped: Greatest smoothed probability of the gesture that the last frame decided for at the
            end of its touch; 0 if it did not.
    """

    def __init__(
        self,
        labels: Sequence[str],
        settings: DebounceSettings,
        rate_hz: float = 10.0,
        turn: TurnTracker | None = None,
    ) -> None:
        """Begin without a touch.

        Args:
            labels: The classes, "null" first.
            settings: When a gesture fires.
            rate_hz: Frames per second.
            turn: Of the touch, if what touches is known.
        """
        self.labels = tuple(labels)
        self.settings = settings
        self._rate_hz, self._turn = rate_hz, turn
        self._mean = np.zeros(len(self.labels))
        self._mean[NULL] = 1.0
        self._held = NULL
        self._sum = np.zeros(len(self.labels))  # of the means in a touch without an answer
        self._peak = np.zeros(len(self.labels))  # greatest of them
        self._frames = 0  # of that touch
        self._patient = {self.labels.index(one) for one in settings.patient}
        self._awaited = {self.labels.index(one) for one in settings.awaited}
        self._queue: list[tuple[int, int]] = []  # classes that wait, and for how many frames
        self._here = False  # the last of them is of the present touch
        self._needs = settings.tap(0.0)
        self._slow = [self.labels.index(one) for one in settings.slow]
        # Levels of the contact, newest last: whole, and uneven.
        self._levels = np.zeros((max(1, round(BEFORE_S * rate_hz)), 2))
        self._touch = np.zeros((2, 2))  # those before the present touch, and the highest in it
        self._lasting = NULL  # the gesture that fired last, while its contact lasts
        self._contact = np.zeros(2)  # uneven levels before that contact, and the highest
        self._brisk = [self.labels.index(one) for one in settings.brisk]
        # Levels since the last answer, as those above
        self._recent: deque[Array] = deque(maxlen=round(KEPT_S * rate_hz))
        self.tapped = 0.0

    @property
    def held(self) -> str:
        """The gesture whose contact still lasts, "" if none."""
        kind = self._held or self._lasting
        return self.labels[kind] if kind != NULL else ""

    @property
    def press_likely(self) -> bool:
        """Whether a brisk gesture is likely now, whatever is held."""
        return bool((self._mean[self._brisk] >= _PRESS_LIKELY_PROBABILITY).any())

    @property
    def lying(self) -> bool:
        """Whether its touch is over, and its fingers stay."""
        return self._held == NULL != self._lasting

    def step(
        self,
        probabilities: NDArray[np.floating],
        idle: float = 0.0,
        level: float = 0.0,
        uneven: float | None = None,
        contact: ContactEstimate | None = None,
    ) -> str | None:
        """Take the newest probabilities, (classes,); return the gesture that fires, if any.

        Args:
            probabilities: Of the labels, (classes,).
            idle: Mean of |z - 1| while nothing touches.
            level: Of the contact (`touch_position.ContactLevel`); 0 throughout: unknown.
            uneven: Its level without what all taxels have in common; None: the same.
            contact: What touches, if it is known.

        Raises:
            ValueError: There are more or fewer probabilities than labels.
        """
        if probabilities.shape != self._mean.shape:
            raise ValueError(
                f"{probabilities.shape} probabilities for {len(self.labels)} labels; "
                "the network and its labels belong to different bundles"
            )
        self._mean += self.settings.weight(idle) * (probabilities - self._mean)
        begins = self._frames == 0 and self._held == NULL
        if self._turn is not None:
            self._turn.step(contact, begins=begins)
        fired = self.decide(self._mean, idle, level, level if uneven is None else uneven)
        self._follow_contact(fired)
        return self.labels[fired] if fired != NULL else None

    def restart(self) -> str | None:
        """Begin another touch, of a contact that began beside others; these are subtracted.

        Returns:
            The gesture of theirs that had not been sure yet, if any; a brisk one would have been.
        """
        self._levels[-1] = self._touch[0]  # as if they had been lifted
        last = self._end()
        self._mean[:] = 0.0
        self._mean[NULL] = 1.0
        self._lasting = NULL
        for one in (self._levels, self._touch, self._contact):
            one[:] = 0.0
        self._recent.clear()
        self._recent.append(np.zeros(2))
        return self.labels[last] if last != NULL and last not in self._brisk else None

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        return {
            "mean": self._mean.copy(),
            "held": np.array([self._held], dtype=np.float64),
            "sum": self._sum.copy(),
            "peak": self._peak.copy(),
            "frames": np.array([self._frames], dtype=np.float64),
            "queue": np.array(self._queue, dtype=np.float64).reshape(-1, 2),
            "here": np.array([self._here], dtype=np.float64),
            "levels": self._levels.copy(),
            "lasting": np.array([self._lasting, *self._touch.ravel(), *self._contact]),
            "tapped": np.array([self.tapped]),
            "recent": np.array(self._recent).reshape(-1, 2),
            **({} if self._turn is None else self._turn.state()),
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._mean = state["mean"].copy()
        self._held = int(state["held"][0])
        self._sum, self._peak = state["sum"].copy(), state["peak"].copy()
        self._frames, self._here = int(state["frames"][0]), bool(state["here"][0])
        self._levels, lasting = state["levels"].copy(), state["lasting"].copy()
        self._lasting, self._touch, self._contact = int(lasting[0]), lasting[1:5], lasting[5:]
        self._touch = self._touch.reshape(2, 2)
        self.tapped = float(state["tapped"][0])
        self._recent.clear()
        self._recent.extend(state["recent"])
        if self._turn is not None:
            self._turn.restore(state)
        waiting = ((int(kind), int(age)) for kind, age in state["queue"])
        self._queue = [one for one in waiting if NULL < one[0] < len(self.labels)]

    def decide(self, mean: NDArray[np.float64], idle: float, level: float, uneven: float) -> int:
        """Return the class that fires at a frame's smoothed probabilities, (classes,), or NULL.

        The others are as in `step`, of which this is a part.
        """
        self._needs = self.settings.tap(idle)
        self._levels = np.vstack([self._levels[1:], (level, uneven)])
        self._recent.append(self._levels[-1])
        self.tapped = 0.0
        touched = bool(1.0 - mean[NULL] >= self.settings.off)
        if self._turn is not None and self._held == NULL and self._sum.argmax() in self._slow:
            touched |= self._turn.turning  # a twist that changes its direction is not over
        found = self._in_touch(mean) if touched else self._end()
        if found != NULL:
            self._recent.clear()
        return self._waited(found, touched=touched) if self._patient else found

    def _in_touch(self, mean: NDArray[np.float64]) -> int:
        """Return the class that a frame of a touch decides for, mean (classes,), or NULL."""
        if self._held != NULL:
            return NULL
        if self._frames == 0:
            self._touch = np.stack([self._levels.min(axis=0), self._levels[-1]])
        self._frames += 1
        said = Turned() if self._turn is None else self._turn.says(self._frames / self._rate_hz)
        if said.never:
            mean = mean.copy()
            mean[said.never] = self._sum[said.never] = self._peak[said.never] = 0.0
        self._sum += mean
        np.maximum(self._peak, mean, out=self._peak)
        self._touch[1] = np.maximum(self._touch[1], self._levels[-1])
        if self._slow and self._frames / self._rate_hz < self.settings.slow_s:
            mean = mean.copy()
            mean[self._slow] = 0.0
        unready = [*said.waiting]
        if self._brisk and not self._landed(self._brisk[0]):
            unready += self._brisk
        if unready:
            mean = mean.copy()
            mean[unready] = 0.0
        best = NULL + 1 + int(np.argmax(mean[NULL + 1 :]))
        needed = CONFIRMED_PROBABILITY
        if best not in said.confirmed:
            touch_s, brisk = self._frames / self._rate_hz, best in self._brisk
            needed = self.settings.bound(touch_s, self._needs[0], brisk=brisk)
        if best in said.doubted:
            needed = max(needed, DOUBTED_PROBABILITY)
        if mean[best] < needed or (self._here and best not in self._awaited):
            return NULL
        if best in self._patient:
            self._here = True
        else:
            self._held = best
        return best

    def _waited(self, found: int, *, touched: bool) -> int:
        """Return the class that fires after waiting, or NULL; `found` was decided for now."""
        self._queue = [(kind, age + 1) for kind, age in self._queue]
        if found in self._awaited and self._queue and self._queue[-1][0] in self._patient:
            self._queue.pop()
            self._here = False
        if found != NULL:
            self._queue.append((found, 0))
        if not self._queue:
            return NULL
        kind, age = self._queue[0]
        if len(self._queue) == 1 and kind in self._patient:
            waiting_s = age / self._rate_hz
            undecided = touched and self._held == NULL and not self._here
            if waiting_s < self.settings.patience_s * (2.0 if undecided else 1.0):
                return NULL
            if self._here:
                self._held, self._here = kind, False
        self._queue.pop(0)
        return kind

    def _follow_contact(self, fired: int) -> None:
        """Keep the gesture that fired while its contact lasts, which may be longer than its touch.

        A pinch is over when its fingers have come together; they may stay.
        """
        if self.settings.lifted > 1.0:  # the end of its touch is that of its contact
            return
        if fired != NULL and fired == self._held:
            self._lasting, self._contact = fired, self._touch[:, 1].copy()
        elif self._lasting != NULL:
            level = self._levels[-1, 1]
            low, high = self._contact[0], max(self._contact[1], level)
            self._contact[1] = high
            if level - low <= _HOLDING * (high - low):
                self._lasting = NULL

    def _landed(self, kind: int, *, left: bool = False) -> bool:
        """Return whether a contact has landed that a class may answer, now or when it has left."""
        if self.settings.lifted > 1.0:
            return True
        last = landing_frames(self.settings, self._rate_hz, left=left) if kind in self._brisk else 0
        return landed(np.array(list(self._recent)[-last:]).reshape(-1, 2))

    def _end(self) -> int:
        """End a touch, if there is one; return the class that it was after all, or NULL."""
        best = NULL + 1 + int(np.argmax(self._sum[NULL + 1 :]))
        low, high = self._touch[:, 0]
        lifted = self.settings.lifted
        least, brief_s = self._needs
        enough = (
            self._held == NULL
            and not self._here
            and self._peak[best] >= least
            and self._sum[best] / self._rate_hz >= brief_s
            and (lifted > 1.0 or self._levels[-1, 0] - low <= lifted * (high - low))
            and self._landed(best, left=True)
        )
        self._held, self._frames, self._here = NULL, 0, False
        self.tapped = float(self._peak[best]) if enough else 0.0
        self._sum[:], self._peak[:] = 0.0, 0.0
        return best if enough else NULL


def landing_frames(settings: DebounceSettings, rate_hz: float, *, left: bool) -> int:
    """Return in how many frames a contact has landed that a brisk gesture answers."""
    return max(2, round(settings.landed_s * (_UNTIL_LEFT if left else 1.0) * rate_hz))


def landed(levels: NDArray[np.float64]) -> bool:
    """Return whether a contact lands in these levels, whole and uneven, (n, 2); 0: unknown."""
    if not levels.any():
        return True
    whole, uneven = levels.T
    rise = uneven - np.minimum.accumulate(uneven)
    least = np.maximum(_RISE_SHARE * uneven, _FINGER_SHARE * whole.max())
    return bool((rise >= least).any() and rise.any())
