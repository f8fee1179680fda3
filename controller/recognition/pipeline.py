"""From frame to command: the pure stages joined, and nothing else."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from controller.recognition.debounce import NULL, Debouncer, DebounceSettings
from controller.recognition.mapping import Mapping
from controller.recognition.preprocess import (
    Frame,
    Image,
    Prepared,
    Preprocessor,
    PreprocessSettings,
    State,
    StoredBaseline,
    Window,
)
from controller.recognition.sensor_health import HealthMonitor
from controller.recognition.touch_position import PositionSpread, TouchImage
from controller.recognition.user_id import UserIdentifier
from controller.recognition.users import Users

Touch = tuple[float, float]  # (x, y), grid units

# What older recordings do not have in their state; they go on as if it were new.
LATER: Final = ("preprocess.answers", "preprocess.answered", "touch.noise")
_TOUCH_WINDOWS = 3  # a touch is judged by this many windows of its latest frames


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
        quiet: The deviation is within the gate: as far as the skin tells, nothing touches.
        probabilities: One per label, (classes,); certainly "null" until the window is full.
        touch: Where the present touch is, by all of its frames so far; None at rest.
        gesture: The label that fired in this frame.
        held: The label whose touch still lasts, "" if none.
        command: What the gesture asks for, if anything.
        sigma: Deviation of the touch from where it truly is, of each axis, grid units; None where
            there is no touch, or nobody measured it.
        user: Who touched last, "" if that is not known.
        confidence: How probable that is; 0 where the bundle cannot tell.
    """

    frame: int
    t_s: float
    image: Image
    ready: bool
    quiet: bool
    probabilities: NDArray[np.float32]
    touch: Touch | None
    gesture: str | None
    held: str
    command: CommandRecord | None
    sigma: float | None = None
    user: str = ""
    confidence: float = 0.0


class PipelineSettings(Protocol):
    """Settings of all stages, as a bundle holds them."""

    @property
    def labels(self) -> tuple[str, ...]:
        """The gestures, "null" first."""

    @property
    def rows(self) -> int:
        """Taxel rows."""

    @property
    def columns(self) -> int:
        """Taxel columns."""

    @property
    def rate_hz(self) -> float:
        """Frames per second."""

    @property
    def window(self) -> int:
        """Images in a window."""

    @property
    def preprocess(self) -> PreprocessSettings:
        """How windows are made."""

    @property
    def debounce(self) -> DebounceSettings:
        """When a gesture counts."""

    @property
    def spread(self) -> PositionSpread | None:
        """Deviation of touch positions; None if it was not measured."""

    @property
    def users(self) -> Users:
        """Enrolled users."""

    @property
    def identifies(self) -> bool:
        """Whether there is a network that identifies users."""


class Networks(Protocol):
    """What the pipeline asks; `controller.bundles.inference.networks.Recognizer` answers."""

    def probabilities(self, window: Window) -> NDArray[np.float32]:
        """Return the probability of each label, (classes,)."""

    def touch(self, image: Image) -> Touch | None:
        """Return where an image is touched, (x, y) in grid units; None: cannot tell."""


@runtime_checkable
class UserNetworks(Protocol):
    """Networks that know people; `controller.bundles.inference.networks.Recognizer` is one."""

    def probabilities(self, window: Window, user: str = "") -> NDArray[np.float32]:
        """Return the probability of each label, by the user's own network where there is one."""

    def people(self, window: Window) -> NDArray[np.float32] | None:
        """Return how probably each of the people touches, (1 + users,); None: cannot tell."""


class Pipeline:
    """The stages of one session, and what they remember of it."""

    def __init__(
        self,
        bundle: PipelineSettings,
        recognizer: Networks,
        mapping: Mapping,
        known: StoredBaseline | None = None,
        player: str = "",
    ) -> None:
        """Join the stages.

        Args:
            bundle: Their settings; `controller.bundles.bundle.Bundle` has them.
            recognizer: Its networks.
            mapping: The bundle's, or an override of it.
            known: What a calibration of the sensor found.
            player: Who touches, where somebody said so; "": nobody did. Whom the bundle does not
                know counts as nobody.

        Raises:
            ValueError: The calibration is of a sensor of another shape.
        """
        self.labels = bundle.labels
        self.mapping = mapping
        self._recognizer = recognizer
        self._spread = bundle.spread
        settings = bundle.preprocess
        self._preprocessor = Preprocessor(settings, bundle.rows, bundle.columns, known)
        self._debouncer = Debouncer(bundle.labels, bundle.debounce)
        self._touch = TouchImage(_TOUCH_WINDOWS * bundle.window, bundle.rows, bundle.columns)
        self._ratio = settings.normalise == "ratio"
        before = None if known is None else known.rest
        self._health = HealthMonitor(settings.rate_hz, ratio=self._ratio, before=before)
        self._users, self._player = bundle.users, ""
        self._company: UserNetworks | None = None
        self._witness: UserIdentifier | None = None
        if bundle.users.names and isinstance(recognizer, UserNetworks):
            self._company = recognizer
            self._player = player if player in bundle.users.names else ""
            if bundle.identifies and not self._player:
                self._witness = UserIdentifier(bundle.users, settings.rate_hz)
        self._certain = np.zeros(len(bundle.labels), dtype=np.float32)
        self._certain[NULL] = 1.0
        self._number = 0
        self._dead: NDArray[np.bool_] | None = None  # taxels that do not answer
        self.mark: Callable[[], None] = _unmarked  # called at the end of each stage, see `ledger`

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
        self.mark()
        probabilities = self._certain.copy()
        if window is not None:
            probabilities = self._ask(window)
        self.mark()
        before = self._debouncer.held
        gesture = self._debouncer.step(probabilities)
        released = bool(before) and not self._debouncer.held
        touch = self._place(prepared, null=bool(probabilities[NULL] > 0.5), released=released)
        command = None
        table = self._users.mapping(self.user, self.mapping)
        if gesture is not None and (name := table.command(gesture, touch)) is not None:
            probability = float(probabilities[self.labels.index(gesture)])
            command = CommandRecord(t_s, self._number, gesture, probability, touch, name)
        sigma = None if touch is None or not self._spread else self._spread.sigma(self._touch.blur)
        held = self._debouncer.held
        if self._witness is not None:
            self._watch(self._witness, held, window, busy=bool(probabilities[NULL] < 0.5))
        image, ready, quiet = prepared.image, prepared.ready, prepared.quiet
        self._health.notice(prepared)
        self._dead = prepared.dead
        self.mark()
        return Step(
            self._number, t_s, image, ready, quiet, probabilities, touch, gesture, held, command,
            sigma, self.user, self.confidence,
        )  # fmt: skip

    def look(self) -> tuple[str, ...]:
        """Return what is not as it should be with the sensor, worst first.

        Once a second it is looked for anew, as `controller/recognition/sensor_health.py` says, and
        what only the next frame needs is learned. All that is for after a frame, when what it gave
        is on its way: nobody waits for it.
        """
        self._preprocessor.settle()
        return self._health.look(self._dead, self._preprocessor.resting)

    def exchange(self, recognizer: Networks) -> None:
        """Ask other networks from the next frame on, of a bundle with the same settings."""
        self._recognizer = recognizer
        if self._company is not None and isinstance(recognizer, UserNetworks):
            self._company = recognizer

    @property
    def user(self) -> str:
        """Who touched last, "" if that is not known."""
        return self._player if self._witness is None else self._witness.name

    @property
    def confidence(self) -> float:
        """How probable that is."""
        return float(bool(self._player)) if self._witness is None else self._witness.confidence

    @property
    def rest(self) -> Frame | None:
        """The untouched sensor, (rows, columns), picofarads; None until it is found."""
        return self._preprocessor.rest

    def state(self) -> State:
        """Return everything remembered, by stage and name, for an exact continuation."""
        stages = {
            "preprocess": self._preprocessor.state(),
            "debounce": self._debouncer.state(),
            "touch": self._touch.state(),
        }
        if self._witness is not None:
            stages["users"] = self._witness.state()
        return {
            f"{s}.{name}": array for s, state in stages.items() for name, array in state.items()
        }

    def restore(self, state: State) -> None:
        """Continue exactly where `state` was taken.

        Raises:
            ValueError: The state belongs to another bundle or sensor, or is damaged.
        """
        own = self.state()
        state = {**{key: own[key] for key in LATER if key in own}, **state}
        if set(state) != set(own) or any(_unlike(state[key], own[key]) for key in own):
            raise ValueError("the state is of another bundle or sensor")
        remembered = [state[f"preprocess.{name}"] for name in ("rest", "recent")]
        if self._ratio and not all((array > 0.0).all() for array in remembered):
            raise ValueError("the state has a rest image that is not above zero")
        if not 0 <= state["debounce.held"][0] < len(self.labels):
            raise ValueError("the state holds a gesture that the bundle does not know")
        stages: dict[str, State] = {"preprocess": {}, "debounce": {}, "touch": {}, "users": {}}
        for key, array in state.items():
            stage, _, name = key.partition(".")
            stages[stage][name] = array
        self._preprocessor.restore(stages["preprocess"])
        self._debouncer.restore(stages["debounce"])
        self._touch.restore(stages["touch"])
        if self._witness is not None:
            self._witness.restore(stages["users"])

    def _ask(self, window: Window) -> NDArray[np.float32]:
        """Return the probability of each label; whom we know is judged by their own network."""
        if self._company is not None and self.user:
            return self._company.probabilities(window, self.user)
        return self._recognizer.probabilities(window)

    def _watch(
        self, witness: UserIdentifier, held: str, window: Window | None, *, busy: bool
    ) -> None:
        """Ask who makes what is made now; it counts if it turns out to be a gesture that tells."""
        people = None
        if window is not None and (held or busy) and self._company is not None:
            people = self._company.people(window)
        witness.step(people, counts=held in self._users.gestures)

    def _place(self, prepared: Prepared, *, null: bool, released: bool) -> Touch | None:
        """Return where the present touch is; the network is asked only if there is one."""
        if not prepared.ready:
            return None
        self._touch.step(prepared.image, prepared.idle, null=null, released=released)
        image = self._touch.image()
        return None if image is None else self._recognizer.touch(image)


def _unmarked() -> None:
    """Nobody asks where the time goes."""


def _unlike(given: NDArray[np.float64], own: NDArray[np.float64]) -> bool:
    """Return whether two arrays differ in shape; lists of images may differ in length."""
    return given.shape[1:] != own.shape[1:] or (own.ndim < 2 and len(given) != len(own))
