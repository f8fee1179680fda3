"""State of the orb's gestures as its reports tell it, and touches seen in telemetry; pure."""

from collections import Counter
from collections.abc import Callable
from typing import Final, Literal

from controller.protocol.messages import Message
from controller.protocol.teaching import (
    DONE,
    LEARNING,
    Describe,
    ExampleDrop,
    ExampleTaken,
    GestureInfo,
    Learn,
    LearnStatus,
    Vocabulary,
)

_RISE: Final = (1.6, 0.012)  # a touch begins at so many times the level at rest, and so much more
_FALL: Final = (1.3, 0.010)  # and ends below this
_REST_S: Final = 1.0  # time constant of the level at rest
PAUSE_S: Final = 0.5  # without a touch, after which it is over: a double tap is one touch
_LONGEST_S: Final = 8.0  # a touch that lasts longer is ended

TouchEvent = Literal["", "begun", "ended"]


class GestureState:
    """Gestures, pending examples and the latest answer of an orb.

    Attributes:
        vocabulary: None until the orb has described itself.
        gestures: By their labels, in the orb's order.
        examples: The pending ones by their numbers; all can be learned.
        refused: Why the last example cannot be learned; "": it can.
        status: The answer to the last request; None while there is none.
    """

    def __init__(self, send: Callable[[Message], None], first: int) -> None:
        """Send requests by `send`; the examples are numbered after `first`."""
        self.vocabulary: Vocabulary | None = None
        self.gestures: dict[str, GestureInfo] = {}
        self.examples: dict[int, ExampleTaken] = {}
        self.refused = ""
        self.status: LearnStatus | None = None
        self._send, self._number = send, first
        self._learning = ""

    def describe(self) -> None:
        """Ask for the gestures and the pending examples."""
        self.examples.clear()
        self._send(Describe())

    def ask(self, request: Message) -> None:
        """Send a request that a LearnStatus answers."""
        self.status = None
        self._learning = request.label if isinstance(request, Learn) else ""
        self._send(request)

    def next_number(self) -> int:
        """Return the number of a new example."""
        self._number += 1
        return self._number

    def drop(self, number: int) -> None:
        """Throw an example away."""
        if self.examples.pop(number, None):
            self._send(ExampleDrop(number))

    def of(self, label: str) -> list[ExampleTaken]:
        """Return the pending examples of a gesture, in the order of their numbers."""
        return [one for _, one in sorted(self.examples.items()) if one.label == label]

    def reachable(self) -> set[str]:
        """Return the commands that a gesture has."""
        return {rule.command for one in self.gestures.values() for rule in one.rules}

    def take(self, message: Message) -> None:
        """Take a message of the orb."""
        match message:
            case Vocabulary():
                self.vocabulary, self.gestures = message, {}
            case GestureInfo(label=label):
                self.gestures[label] = message
            case ExampleTaken(number=number, felt=felt):
                self.refused = "" if felt else message.text
                if felt:
                    self.examples[number] = message
            case LearnStatus(state=state):
                self.status = message
                if state == DONE and self._learning:
                    for one in self.of(self._learning):
                        del self.examples[one.number]
                if state != LEARNING:
                    self._learning = ""


class TouchWatch:
    """Beginnings and ends of touches in the level of the image, its RMS of z - 1."""

    def __init__(self) -> None:
        """Begin untouched."""
        self._rest: float | None = None
        self._last_s = 0.0
        self._begun_s: float | None = None
        self._quiet_s: float | None = None  # since when nothing touches

    def step(self, level: float, now_s: float) -> TouchEvent:
        """Take the level of a frame; return what happened in it.

        A touch ends when nothing has touched for `PAUSE_S`, or when it lasts too long.
        """
        rest = level if self._rest is None else self._rest
        self._rest = rest
        passed_s, self._last_s = now_s - self._last_s, now_s
        touched = self._begun_s is not None and self._quiet_s is None
        times, more = _FALL if touched else _RISE
        if level > times * rest + more:
            self._quiet_s = None
            if self._begun_s is None:
                self._begun_s = now_s
                return "begun"
        elif self._begun_s is None:
            share = min(1.0, passed_s / _REST_S)
            self._rest = min(level, rest + share * (level - rest))
        elif self._quiet_s is None:
            self._quiet_s = now_s
        return self._over(now_s)

    def _over(self, now_s: float) -> TouchEvent:
        if self._begun_s is None:
            return ""
        paused = self._quiet_s is not None and now_s - self._quiet_s >= PAUSE_S
        if not paused and now_s - self._begun_s < _LONGEST_S:
            return ""
        if not paused:
            self._rest = None  # what lasts so long is a new level at rest
        self._begun_s = self._quiet_s = None
        return "ended"


class Trial:
    """Count of how often a gesture is understood.

    Attributes:
        understood: Number of touches that were the gesture, and nothing else.
        tries: Number of touches.
        confused: What the others were taken for; "" nothing.
    """

    def __init__(self, label: str, wanted: int = 5) -> None:
        """Try a gesture so many times."""
        self.label, self.wanted = label, wanted
        self.understood = self.tries = 0
        self.confused: Counter[str] = Counter()
        self._heard: set[str] = set()

    @property
    def over(self) -> bool:
        """Whether it was tried often enough."""
        return self.tries >= self.wanted

    def recognised(self, label: str) -> None:
        """Take a gesture that the orb recognises."""
        if label:
            self._heard.add(label)

    def touched(self, event: TouchEvent) -> None:
        """Take the beginning or the end of a touch."""
        if event == "begun":
            self._heard.clear()
        if event != "ended" or self.over:
            return
        self.tries += 1
        others = self._heard - {self.label}
        if self._heard and not others:
            self.understood += 1
        else:
            self.confused[min(others, default="")] += 1
