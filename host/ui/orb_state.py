"""State of the orb for drawing: telemetry and events in the shape in which they are drawn.

`OrbState` takes messages and the passing of time; it draws nothing. `host/ui/panel/` draws it.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from controller.shared.protocol.codec import image_from_bytes
from controller.shared.protocol.messages import (
    Command,
    Contact,
    ContactState,
    Health,
    Message,
    StageTime,
    Telemetry,
    UserIdentified,
    Welcome,
)
from controller.shared.protocol.teaching import GestureInfo, Vocabulary
from host.actions import HELD
from host.connection.latency import EndToEndLatency
from host.connection.receiver import Connected, Delivered, Lost, Received, Refused, Stale
from host.ui.pointer_input import DomeArea
from host.ui.unanswered import Reason, UnansweredTouches
from host.ui.zones import Columns
from tetris.engine.events import Event, LevelUp, Locked

Deviation = NDArray[np.float32]  # (rows, columns), z - 1: 0 where untouched, top row first
LinkState = Literal["connecting", "live", "stale", "lost"]

EASE_S: Final = 0.06  # the shown image follows the felt one: 10 frames a second look alive
LATEST_S: Final = 2.5  # the last recognised gesture stands below the dome for so long
_MOVES: Final = 0.05  # |z - 1| from which the shown image moves as under a finger
MARK_S: Final = 1.2  # the last recognised touch is marked for so long
REASON_S: Final = 2.5  # and why the last one gave no command stands there for so long
PULSE_LEAST_S: Final = 1 / 3  # from one pulse to the next
_PULSE_RISE_S: Final = 0.06
_PULSE_FALL_S: Final = 0.22  # time constant
_PULSE_END_S: Final = 1.0
_LOCK_PULSE: Final = 0.35  # strength of a pulse, 0 to 1
_CLEAR_PULSES: Final = (0.7, 0.8, 0.9, 1.0)  # of 1, 2, 3, 4 rows


class Rim:
    """The pulse under way; times are seconds."""

    def __init__(self) -> None:
        self._strength, self._since_s = 0.0, -math.inf

    def strike(self, strength: float, now_s: float) -> None:
        """Begin a pulse, unless the last one began less than `PULSE_LEAST_S` ago."""
        if strength > 0.0 and now_s - self._since_s >= PULSE_LEAST_S:
            self._strength, self._since_s = strength, now_s

    def level(self, now_s: float) -> float:
        """Return how bright the rim is, 0 to 1."""
        passed_s = now_s - self._since_s
        if not 0.0 <= passed_s < _PULSE_END_S:
            return 0.0
        rise = min(1.0, passed_s / _PULSE_RISE_S)
        return self._strength * rise * math.exp(-max(0.0, passed_s - _PULSE_RISE_S) / _PULSE_FALL_S)


@dataclass
class OrbState:
    """The orb as it is to be shown, kept up by messages.

    All times are seconds of one clock that never turns back: the machine's, or granted time. The
    image drawn (`shown`) and one probability per label are eased towards what was felt last.
    """

    link: LinkState = "connecting"  # "live" has telemetry, "stale" is silent, "lost" is gone
    reason: str = ""  # one sentence on why the link is not live; may be empty
    welcome: Welcome | None = None
    shown: Deviation = field(default_factory=lambda: np.zeros((5, 5), np.float32))
    felt: Deviation = field(default_factory=lambda: np.zeros((5, 5), np.float32))
    probabilities: NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, np.float32))
    gesture: str = ""
    ready: bool = False
    rate_hz: float = 0.0
    contact: ContactState | None = None  # what touches, if the device estimates it
    contacts: tuple[Contact, ...] = ()  # that this host puts on a virtual dome, for the rings
    ghost: tuple[Contact, ...] = ()  # fingers that show a gesture, drawn only
    zones: bool = False  # whether the dome shows which command a press gives where
    columns: Columns | None = None  # the same, while the game is played by Aim
    board: Sequence[str] = ()  # rows of that game with its piece, top first; "." is empty
    pointer: tuple[float, float] | None = None  # where the mouse is over the dome, grid units
    gestures: dict[str, GestureInfo] = field(default_factory=dict)  # by label, as far as known
    note: str = ""  # a sentence below the dome, before all others
    hint: str = ""  # and one for when there is nothing else
    badge: str = ""  # "armed" or "disarmed": whether gestures press keys; "" where none does
    rim: Rim = field(default_factory=Rim)  # pulses round the dome
    latency: EndToEndLatency | None = None  # which measures it, if it is measured
    hops: tuple[StageTime, ...] = ()  # how long frames take: in the orb, to here, to the screen
    period_ms: float = 0.0  # from frame to frame in the orb; 0 while it has not said
    missed: int = 0  # frames that the orb skipped because they were late, since its start
    health: tuple[str, ...] = ()  # what is wrong, worst first; stands in the hint's place
    user: str = ""  # the identified user; "" for none that it knows
    sure: float = 0.0  # how probable that is; 0 where the device knows no users
    last: Command | None = None  # command recognised last
    last_s: float = 0.0  # when
    unanswered: tuple[Reason, float] | None = None  # why the last touch gave no command, and when
    _target: NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, np.float32))
    _now_s: float | None = None
    _touches: UnansweredTouches = field(default_factory=lambda: UnansweredTouches(("null",)))

    @property
    def labels(self) -> tuple[str, ...]:
        """The gesture classes of the device, "null" first; empty before the handshake."""
        return self.welcome.labels if self.welcome else ()

    @property
    def pad(self) -> DomeArea:
        """The area of the dome; the paper's before the handshake."""
        known = self.welcome
        return DomeArea(known.rows, known.columns, known.pitch_mm) if known else DomeArea()

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the taxels."""
        return self.felt.shape[0], self.felt.shape[1]

    def observe(self, item: Received, now_s: float) -> None:
        """Take a received event."""
        match item:
            case Connected(welcome=welcome):
                self.connected(welcome)
            case Stale():
                self.silent("stale", "")
            case Lost(reason=reason) | Refused(reason=reason):
                self.silent("lost", reason)
            case Delivered(message=message):
                self._hear(message, now_s)

    def _hear(self, message: Message, now_s: float) -> None:
        """Take a message: the device speaks."""
        if self.link == "stale":
            self.link, self.reason = "live", ""
        match message:
            case Command():
                self.command(message, now_s)
            case Telemetry():
                self.telemetry(message, now_s)
            case ContactState():
                self.contact = message if message.fingers else None
            case Health(found=found):
                self.health = found
            case Vocabulary() | GestureInfo():
                self.described(message)
            case UserIdentified(user=user, confidence=sure):
                self.user, self.sure = user, sure

    def connected(self, welcome: Welcome) -> None:
        """Take a handshake: a new session starts with a blank image."""
        self.welcome, self.link, self.reason = welcome, "live", ""
        self.felt = np.zeros((welcome.rows, welcome.columns), np.float32)
        self.shown = self.felt.copy()
        self._recognise(welcome.labels)
        self.gestures = {}
        self.gesture, self.ready, self.rate_hz = "", False, welcome.rate_hz
        self.contact = None
        self.health = ()
        self.user, self.sure = "", 0.0

    def described(self, message: Vocabulary | GestureInfo) -> None:
        """Take the gestures in use, or one of them; another orb's gesture is left out."""
        if isinstance(message, GestureInfo):
            if message.label in self.labels:
                self.gestures[message.label] = message
            return
        self.gestures = {}
        if self.welcome and message.labels != self.welcome.labels:
            labels, commands = message.labels, message.commands
            self.welcome = replace(self.welcome, labels=labels, commands=commands)
            self._recognise(labels)

    def _recognise(self, labels: tuple[str, ...]) -> None:
        """Begin with the gestures of labels, "null" first."""
        self._target = np.zeros(len(labels), np.float32)
        self.probabilities = self._target.copy()
        self._touches, self.unanswered = UnansweredTouches(labels), None

    def telemetry(self, message: Telemetry, now_s: float) -> None:
        """Take what the device felt in one frame; an image of a foreign shape is left out."""
        if len(message.image) == self.felt.size:
            values = np.asarray(image_from_bytes(message.image), np.float32) - 1.0
            self.felt = values.reshape(self.felt.shape)
        if len(message.probabilities) == len(self._target):
            self._target = np.asarray(message.probabilities, np.float32)
            if self.welcome and message.ready:
                reason = self._touches.step(self.felt, self._target, message.gesture, now_s)
                self.unanswered = (reason, now_s) if reason else self.unanswered
        self.gesture, self.ready = message.gesture, message.ready
        self.rate_hz = message.rate_hz

    def command(self, message: Command, now_s: float) -> None:
        """Take a command."""
        self.answered()
        self.last, self.last_s = message, now_s

    def answered(self) -> None:
        """Take it that the present or last touch did something, as by Aim."""
        self._touches.answer()
        self.unanswered = None

    def silent(self, link: LinkState, reason: str) -> None:
        """Take a change of the link for the worse: what was felt is no longer felt."""
        self.link, self.reason, self.gesture = link, reason, ""
        self.felt = np.zeros_like(self.felt)
        self._target = np.zeros_like(self._target)
        self.contacts, self.contact = (), None

    def advance(self, now_s: float) -> None:
        """Ease what is shown towards what was felt, as far as the time has come."""
        passed_s = 0.0 if self._now_s is None else max(0.0, now_s - self._now_s)
        self._now_s = now_s
        latency, pace = self.latency, self.latency.pace if self.latency else None
        if latency and pace and latency.frames % max(1, round(1000 / pace.period_ms)) == 0:
            self.hops = tuple(latency.digest())  # about once a second
            self.period_ms, self.missed = pace.period_ms, pace.missed
        share = 1.0 - math.exp(-passed_s / EASE_S)
        self.shown = self.shown + (self.felt - self.shown) * share
        self.probabilities = (
            self.probabilities + (self._target - self.probabilities) * share
        ).astype(np.float32)

    def reason_unanswered(self, now_s: float) -> Reason | None:
        """Return why the last touch gave no command; None if it did, or it is long ago."""
        reason, at_s = self.unanswered or (None, now_s)
        return reason if now_s - at_s < REASON_S else None

    def latest(self, now_s: float) -> Command | None:
        """Return the last command while it is news; in Aim a press gives none."""
        last = self.last if now_s - self.last_s < LATEST_S else None
        return None if last and self.columns and self.located(last) else last

    def located(self, command: Command) -> bool:
        """Whether a command is of a gesture that gives others in other places."""
        info = self.gestures.get(command.label)
        return len(info.rules) > 1 if info else command.name in HELD

    def lively(self, now_s: float) -> bool:
        """Return whether the picture moves: touched, shown a gesture, or still fading."""
        return bool(
            self.contacts
            or self.ghost
            or self.gesture
            or self.latest(now_s)
            or self.rim.level(now_s)
            or np.abs(self.shown).max(initial=0.0) > _MOVES
        )

    def mark(self, now_s: float) -> tuple[float, float, float] | None:
        """Return the last recognised touch as x, y and how fresh it is, 1 down to 0."""
        passed_s = max(0.0, now_s - self.last_s)
        if self.last is None or self.last.touch is None or passed_s >= MARK_S:
            return None
        return (*self.last.touch, 1.0 - passed_s / MARK_S)


def pulse_strength(events: Iterable[Event]) -> float:
    """Return how strong a pulse for the events of one moment is, 0 (none) to 1."""
    found = 0.0
    for event in events:
        if isinstance(event, Locked):
            rows = min(len(event.rows), len(_CLEAR_PULSES))
            found = max(found, _CLEAR_PULSES[rows - 1] if rows else _LOCK_PULSE)
        elif isinstance(event, LevelUp):
            found = 1.0
    return found
