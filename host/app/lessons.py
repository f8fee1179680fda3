"""Teaching of gestures to the orb: what it reported, and the requests to send. No clock, no port.

    lessons = Lessons(receiver.send, first=number)
    lessons.take(message)                     # every message of the orb
    number = lessons.begin_example("swipe")   # the player begins; `end_example` when done
    lessons.change(Learn("swipe", "hold"))

`Trial` judges the player's attempts at one gesture.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
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
    TouchStrength,
    UserInfo,
    Vocabulary,
)

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
        kept: For each label, the share of its touches still recognised at the last change.
    """

    send: Callable[[Request], object]
    first: int = 1  # number of the first example: unused before, such as a time in seconds
    vocabulary: Vocabulary | None = None
    users: dict[str, UserInfo] = field(default_factory=dict)
    strengths: dict[str, float] = field(default_factory=dict)
    examples: dict[int, ExampleTaken] = field(default_factory=dict)
    open: int | None = None
    status: LearnStatus | None = None
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

    @property
    def kept(self) -> dict[str, float]:
        """Return the share of touches still recognised, by label; {} if unknown."""
        if self.vocabulary is None or self.status is None:
            return {}
        pairs = zip(self.vocabulary.labels, self.status.kept, strict=False)
        return {label: share for label, share in pairs if label != "null"}

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
            if message.number == self.open:
                self.open = None  # it was too long, or refused
        elif isinstance(message, LearnStatus):
            self.status = message

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
        self.open = number
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
        self.status = LearnStatus(LEARNING, 0.0, "")
        self.send(request)


@dataclass
class Trial:
    """The player tries one gesture some times: how often was it understood?

    A touch is understood if the gesture is recognised in it, or within `LATE_S` after it.

    Attributes:
        label: The gesture that is tried.
        heard: For each attempt that is over, the gesture recognised: `NOTHING` if none.
    """

    label: str
    heard: list[str] = field(default_factory=list)
    _held: str = ""
    _best: str = NOTHING  # of the touch under way
    _touched: bool = False
    _ended_s: float | None = None  # when the touch ended whose answer may still come

    @property
    def understood(self) -> int:
        """Return the number of touches that were understood."""
        return self.heard.count(self.label)

    @property
    def confused(self) -> list[tuple[str, int]]:
        """Return the other answers and their numbers, the most frequent first."""
        return Counter(one for one in self.heard if one != self.label).most_common()

    def touch(self, down: bool, now_s: float) -> None:
        """Take the beginning or the end of a touch, as the host's pointer makes it."""
        if down == self._touched:
            return
        self._touched = down
        if down:
            self._close()
        else:
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
            self.heard.append(self._best)
        self._best, self._ended_s = NOTHING, None


def failed(status: LearnStatus | None) -> str:
    """Return why the last change failed; "" if it did not."""
    return status.text if status is not None and status.state == FAILED else ""
