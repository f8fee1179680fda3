"""From frame to command: the pure stages joined, and nothing else."""

from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from controller.bundle import Bundle
from controller.debounce import NULL, Debouncer
from controller.mapping import Mapping
from controller.preprocess import Frame, Image, Prepared, Preprocessor, State, Window

Touch = tuple[float, float]  # (x, y), grid units

_TOUCH_WINDOWS = 3  # a touch is judged by this many windows of its latest frames
_LEFT = 0.4  # share of the greatest deviation below which the finger has left
_FIRM = 0.5  # share of the greatest deviation from which a frame tells where the touch is


@dataclass(frozen=True, slots=True)
class CommandRecord:
    """What the player asked for, and why we think so.

    Attributes:
        t_s: Time of the frame that decided.
        frame: Its number.
        gesture: The label.
        probability: Of that label, in that frame.
        touch: Where, grid units; None if nothing was touched.
        command: What it means.
    """

    t_s: float
    frame: int
    gesture: str
    probability: float
    touch: Touch | None
    command: str


@dataclass(frozen=True, slots=True)
class Step:
    """What one frame gave.

    Attributes:
        frame: Its number, from 1.
        t_s: Its time, the end of the scan.
        image: z, (rows, columns).
        ready: The rest image exists.
        probabilities: One per label, (classes,); certainly "null" until the window is full.
        touch: Median place of the present touch so far, None at rest.
        gesture: The label that fired in this frame.
        held: The label whose touch still lasts, "" if none.
        command: What the gesture asks for, if anything.
    """

    frame: int
    t_s: float
    image: Image
    ready: bool
    probabilities: NDArray[np.float32]
    touch: Touch | None
    gesture: str | None
    held: str
    command: CommandRecord | None


class Networks(Protocol):
    """What the pipeline asks; `controller.recognizer.Recognizer` answers."""

    def probabilities(self, window: Window) -> NDArray[np.float32]:
        """Return the probability of each label, (classes,)."""

    def touch(self, image: Image) -> Touch | None:
        """Return where an image is touched, (x, y) in grid units; None: cannot tell."""


class Pipeline:
    """The stages of one session, and what they remember of it."""

    def __init__(self, bundle: Bundle, recognizer: Networks, mapping: Mapping) -> None:
        """Join the stages; `mapping` is the bundle's, or an override of it."""
        self.labels = bundle.labels
        self.mapping = mapping
        self._recognizer = recognizer
        self._preprocessor = Preprocessor(bundle.preprocess, bundle.rows, bundle.columns)
        self._debouncer = Debouncer(bundle.labels, bundle.debounce)
        self._place = TouchMedian(_TOUCH_WINDOWS * bundle.window, bundle.preprocess.gate)
        self._certain = np.zeros(len(bundle.labels), dtype=np.float32)
        self._certain[NULL] = 1.0
        self._number = 0

    def step(self, frame: Frame, t_s: float, number: int | None = None) -> Step:
        """Take one frame the whole way.

        Args:
            frame: One scan, (rows, columns), picofarads.
            t_s: The end of the scan.
            number: The frame's number; by default one more than the last.

        Raises:
            ValueError: The frame has another shape than the bundle's sensor.
        """
        self._number = self._number + 1 if number is None else number
        prepared = self._preprocessor.step(frame)
        window = self._preprocessor.window() if prepared.ready else None
        probabilities = self._certain.copy()
        if window is not None:
            probabilities = self._recognizer.probabilities(window)
        touch = self._touch(prepared, bool(probabilities[NULL] > 0.5))
        gesture = self._debouncer.step(probabilities)
        command = None
        if gesture is not None and (name := self.mapping.command(gesture, touch)) is not None:
            probability = float(probabilities[self.labels.index(gesture)])
            command = CommandRecord(t_s, self._number, gesture, probability, touch, name)
        held = self._debouncer.held
        image, ready = prepared.image, prepared.ready
        return Step(self._number, t_s, image, ready, probabilities, touch, gesture, held, command)

    @property
    def rest(self) -> Frame | None:
        """The untouched sensor, (rows, columns), picofarads; None until it is found."""
        return self._preprocessor.rest

    def state(self) -> State:
        """Return everything remembered, by stage and name, for an exact continuation."""
        stages = {
            "preprocess": self._preprocessor.state(),
            "debounce": self._debouncer.state(),
            "touch": self._place.state(),
        }
        return {
            f"{s}.{name}": array for s, state in stages.items() for name, array in state.items()
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken.

        Raises:
            ValueError: The state belongs to another bundle or sensor, or is damaged.
        """
        own = self.state()
        if set(state) != set(own) or any(_unlike(state[key], own[key]) for key in own):
            raise ValueError("the state is of another bundle or sensor")
        if not all((state[f"preprocess.{name}"] > 0.0).all() for name in ("rest", "recent")):
            raise ValueError("the state has a rest image that is not above zero")
        if not 0 <= state["debounce.held"][0] < len(self.labels):
            raise ValueError("the state holds a gesture that the bundle does not know")
        stages: dict[str, State] = {"preprocess": {}, "debounce": {}, "touch": {}}
        for key, array in state.items():
            stage, _, name = key.partition(".")
            stages[stage][name] = array
        self._preprocessor.restore(stages["preprocess"])
        self._debouncer.restore(stages["debounce"])
        self._place.restore(stages["touch"])

    def _touch(self, prepared: Prepared, null: bool) -> Touch | None:
        """Return the median place of the present touch; the network is asked only if there is one.

        A touch begins with a frame that is not quiet, or in which the networks see a gesture: on
        a noisy sensor they feel a finger that the deviation does not show. Quiet frames do not
        end it at once, because the probabilities lag behind the finger.
        """
        touched = prepared.ready and not (prepared.quiet and null)
        touch = self._recognizer.touch(prepared.image) if touched else None
        if touch is not None:
            self._place.add(prepared.deviation, touch, null=null)
        else:
            self._place.lift(prepared.deviation, forget=null)
        return self._place.median()


def _unlike(given: NDArray[np.float64], own: NDArray[np.float64]) -> bool:
    """Return whether two arrays differ in shape; lists of images may differ in length."""
    return given.shape[1:] != own.shape[1:] or (own.ndim < 2 and len(given) != len(own))


class TouchMedian:
    """Where a touch is: the median over its firm frames so far.

    While a finger arrives and leaves, little deviates and the place is vague. So a frame
    counts if it deviates at least half as much as the touch's firmest. The skin remembers a
    finger for a while, so the next one may come before all is quiet: a touch has ended when
    little of it is left, and the next begins where the deviation rises again.
    """

    def __init__(self, frames: int, rise: float) -> None:
        """Remember at most `frames` of a touch; `rise` of deviation begins the next one."""
        self._seen: deque[tuple[float, float, float]] = deque(maxlen=frames)  # deviation, x, y
        self._rise = rise
        self._lowest: float | None = 0.0  # deviation since the last finger left; None: it touches

    def add(self, deviation: float, touch: Touch, *, null: bool) -> None:
        """Take a frame of a touch, perhaps; `null`: the networks see no gesture in it."""
        if self._lowest is None:
            if deviation >= _LEFT * max(seen[0] for seen in self._seen):
                self._seen.append((deviation, *touch))
                return
            self._lowest = deviation
        felt = not null and not self._seen  # by the networks, and the last touch is forgotten
        if felt or deviation >= self._lowest + self._rise:
            self._seen.clear()
            self._seen.append((deviation, *touch))
            self._lowest = None
        else:
            self.lift(deviation, forget=null)

    def lift(self, deviation: float, *, forget: bool) -> None:
        """Take a frame in which nothing touches; `forget` where the last touch was, or not yet."""
        self._lowest = deviation if self._lowest is None else min(self._lowest, deviation)
        if forget:
            self._seen.clear()

    def median(self) -> Touch | None:
        """Return the place, (x, y) in grid units; None without a touch."""
        if not self._seen:
            return None
        seen = np.array(self._seen)
        firm = seen[seen[:, 0] >= _FIRM * seen[:, 0].max()]
        x, y = np.median(firm[:, 1:], axis=0)
        return float(x), float(y)

    def state(self) -> State:
        """Return everything remembered, for an exact continuation elsewhere."""
        seen = np.array(self._seen, dtype=np.float64).reshape(-1, 3)
        lowest = -1.0 if self._lowest is None else self._lowest  # -1: a finger touches
        return {"seen": seen, "lowest": np.array([lowest])}

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken."""
        self._seen.clear()
        self._seen.extend((float(d), float(x), float(y)) for d, x, y in state["seen"])
        lowest = float(state["lowest"][0])
        self._lowest = None if lowest < 0.0 and len(self._seen) else max(lowest, 0.0)
