"""Teaching of gestures to the orb: what it reported, and the requests to send. No clock, no port.

    lessons = Lessons(receiver.send, first=number)
    lessons.take(message)                     # every message of the orb
    number = lessons.begin_example("swipe")   # the player begins; `end_example` when done
    lessons.change(Learn("swipe", "hold"))

`Trial` judges the player's attempts at gestures.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final

from controller.shared.protocol.messages import Command, Message, Request, Telemetry
from controller.shared.protocol.teaching import (
    FAILED,
    LEARNING,
    DeleteExamples,
    Describe,
    ExampleDrop,
    ExampleEnd,
    ExampleStart,
    ExampleTaken,
    Forget,
    LearnStatus,
    LessonCost,
    SetWaiting,
    TouchStrength,
    UserInfo,
    Vocabulary,
)
from host.app.traces import Trace

NOTHING: Final = ""  # the answer to a touch that was no gesture
LATE_S: Final = 0.8  # a gesture may wait for one that begins alike


@dataclass
class Lessons:
    """What the orb reported about teaching, and the player's wishes.

    Attributes:
        vocabulary: As described last; None before.
        users: The enrolled users of the bundle, by name.
        strengths: Touch strengths by user, "" of all others; {} if the orb has no such setting.
        examples: Outcomes of the examples by number, also of those that were not felt.
        open: Number of the example under way; None if there is none.
        status: Progress or outcome of the last change; None before the first.
        costs: What each gesture became by the last lesson, by label; {} while it is measured.
        waits: Whether older gestures wait for the one that was learned last.
        traces: What was seen of the examples of this visit, by number.
    """

    send: Callable[[Request], object]
    first: int = 1  # number of the first example: unused before, such as a time in seconds
    vocabulary: Vocabulary | None = None
    users: dict[str, UserInfo] = field(default_factory=dict)
    strengths: dict[str, float] = field(default_factory=dict)
    examples: dict[int, ExampleTaken] = field(default_factory=dict)
    open: int | None = None
    status: LearnStatus | None = None
    costs: dict[str, LessonCost] = field(default_factory=dict)
    waits: bool = True
    traces: dict[int, Trace] = field(default_factory=dict)
    _next: int = 0

    def begin(self) -> None:
        """Begin a visit of the player: what failed before is of no interest."""
        self.end_example(keep=False)
        if not self.busy:
            self.status = None

    @property
    def busy(self) -> bool:
        """Whether the orb works on a change."""
        return self.status is not None and self.status.state == LEARNING

    @property
    def objection(self) -> str:
        """Return why nothing can be taught, a sentence; "" if it can, or is not known yet."""
        return self.vocabulary.objection if self.vocabulary else ""

    def strength(self, user: str) -> float:
        """Return the touch strength of a user; "": of those without one of their own."""
        return self.strengths.get(user, self.strengths.get("", 1.0))

    def of(self, label: str) -> list[ExampleTaken]:
        """Return the examples of a gesture that can be learned, oldest first."""
        return [one for _, one in sorted(self.examples.items()) if one.felt and one.label == label]

    def take(self, message: Message) -> None:
        """Take a message of the orb; those of other kinds have no effect."""
        if isinstance(message, Vocabulary):
            self.vocabulary, self.users, self.strengths = message, {}, {}
        elif isinstance(message, UserInfo):
            self.users[message.user] = message
        elif isinstance(message, TouchStrength):
            self.strengths[message.user] = message.strength
        elif isinstance(message, ExampleTaken):
            self.examples[message.number] = message
            if trace := self.traces.get(message.number):
                self.traces[message.number] = replace(trace, seconds=message.seconds)
            if message.number == self.open:
                self.open = None  # it was too long, or refused
        elif isinstance(message, LearnStatus):
            self.status = message
        elif isinstance(message, LessonCost):
            self.costs[message.label] = message

    def connected(self) -> None:
        """Begin with a new session: ask for the gestures; what was under way is over."""
        self.vocabulary, self.open, self.status = None, None, None
        self.examples = {}
        self.send(Describe())

    # --- wishes -----------------------------------------------------------------------------------

    def begin_example(self, label: str) -> int:
        """Begin an example of a gesture, in place of one under way; return its number."""
        if self.open is not None:
            self.end_example(keep=False)
        self._next = max(self._next, self.first, max(self.examples, default=0) + 1)
        number, self._next = self._next, self._next + 1
        self.open, self.traces[number] = number, Trace()
        self.send(ExampleStart(number, label))
        return number

    def end_example(self, *, keep: bool = True) -> None:
        """End the example under way; one that is not kept leaves nothing."""
        if self.open is None:
            return
        self.send(ExampleEnd(self.open, keep))
        self.open = None

    def drop(self, number: int) -> None:
        """Throw an example away."""
        taken = self.examples.pop(number, None)
        if taken is None or taken.felt:
            self.send(ExampleDrop(number))

    def change(self, request: Request) -> None:
        """Send a request for a change of the bundle, and wait for its outcome."""
        match request:
            case Forget(label=label):
                self.examples = {k: one for k, one in self.examples.items() if one.label != label}
            case DeleteExamples():
                self.examples = {}
        self.waits = not isinstance(request, SetWaiting) or request.wait
        if not isinstance(request, SetWaiting):
            self.costs = {}
        self.status = LearnStatus(LEARNING, 0.0, "")
        self.send(request)


@dataclass
class Trial:
    """The player tries gestures for as long as they like: what was meant, what was understood?

    A touch is understood if the gesture is recognised in it, or within `LATE_S` after it.

    Attributes:
        label: The gesture that is meant from now on.
        heard: For each attempt that is over, what was meant and recognised: `NOTHING` if none.
    """

    label: str
    heard: list[tuple[str, str]] = field(default_factory=list)
    _held: str = ""
    _best: str = NOTHING  # of the touch under way
    _touched: bool = False
    _ended_s: float | None = None  # when the touch ended whose answer may still come

    def count(self, label: str) -> tuple[int, int]:
        """Return how often a gesture was understood, and tried."""
        return self.heard.count((label, label)), sum(meant == label for meant, _ in self.heard)

    def touch(self, down: bool, now_s: float, *, felt: bool = True) -> None:
        """Take the beginning or the end of a touch; one that was not felt is no attempt."""
        if down == self._touched:
            return
        self._touched = down
        if down:
            self._close()
        elif felt or self._best != NOTHING:
            self._ended_s = now_s

    def take(self, message: Message, now_s: float) -> None:
        """Take a message of the orb."""
        if isinstance(message, Command):
            self._hear(message.label)
        elif isinstance(message, Telemetry) and message.gesture != self._held:
            self._held = message.gesture
            self._hear(message.gesture)
        self.advance(now_s)

    def advance(self, now_s: float) -> None:
        """Close a touch whose answer can come no more."""
        if self._ended_s is not None and now_s - self._ended_s >= LATE_S:
            self._close()

    def _hear(self, label: str) -> None:
        if label and (self._touched or self._ended_s is not None) and self._best != self.label:
            self._best = label

    def _close(self) -> None:
        """Count the touch under way, if there is one."""
        if self._ended_s is not None:
            self.heard.append((self.label, self._best))
        self._best, self._ended_s = NOTHING, None


def failed(status: LearnStatus | None) -> str:
    """Return why the last change failed; "" if it did not."""
    return status.text if status is not None and status.state == FAILED else ""
