"""Pipeline of the pure stages, from frame to command."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.contact import ContactEstimate, ContactNetwork, ContactTracker
from controller.recognition.contact_radius import ContactSettings, RadiusNetwork
from controller.recognition.debounce import NULL, Debouncer, DebounceSettings
from controller.recognition.images.baseline import StoredBaseline
from controller.recognition.images.frames import Frame, Image, PreprocessSettings, Window
from controller.recognition.images.preprocess import Prepared, Preprocessor
from controller.recognition.images.scale import SKIN, Signal
from controller.recognition.images.sensor_health import HealthMonitor
from controller.recognition.mapping import Mapping
from controller.recognition.touch_input import TOUCH_WINDOWS
from controller.recognition.touch_position import ContactLevel, PositionSpread, TouchImage
from controller.recognition.turn import TurnTracker
from controller.recognition.user_id import NO_USERS, UserIdentifier, Users
from controller.shared.aliases import Index, State
from controller.shared.touch_strength import scaled

Touch = tuple[float, float]  # (x, y), grid units
Probabilities = NDArray[np.float32]  # (classes,), or (1 + users,)


@dataclass(frozen=True, slots=True)
class CommandRecord:
    """A recognised command with its evidence.

    Attributes:
        t_s: Time of the deciding frame.
        frame: Its number.
        gesture: The label.
        probability: Of that label in that frame, or in its tap.
        touch: (x, y) in grid units; None if nothing was touched.
        command: Its name.
    """

    t_s: float
    frame: int
    gesture: str
    probability: float
    touch: Touch | None
    command: str


@dataclass(frozen=True, slots=True)
class Step:
    """Output of the pipeline for one frame.

    Attributes:
        frame: Its number, from 1.
        t_s: Its time, the end of the scan.
        image: z, (rows, columns).
        ready: The rest image exists.
        quiet: The deviation is within the gate: nothing touches.
        probabilities: One per label, (classes,); 1 for "null" until the window is full.
        touch: (x, y) of the present touch, grid units, by its first frames; None at rest, except
            in a frame in which a tap fires.
        gesture: The label that fired in this frame.
        held: The label whose touch still lasts, "" if none.
        command: The command of the gesture, if it has one.
        sigma: Standard deviation of the touch, of each axis, grid units; None without a touch, or
            if the bundle has no position spread.
        user: The identified user, "" if none.
        confidence: Probability of that user; 0 if the bundle has no user network.
        contact: What touches; None at rest, or if the bundle does not estimate it.
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
    contact: ContactEstimate | None = None


@dataclass(frozen=True, slots=True)
class PipelineSettings:
    """Settings of all stages; stored in a bundle.

    Attributes:
        labels: The gestures, "null" first.
        rows: Taxel rows.
        columns: Taxel columns.
        preprocess: Of images, windows and baseline.
        debounce: Of the debouncer.
        spread: Uncertainty of touch positions; None if it was not measured.
        users: Enrolled users.
        identifies: Whether there is a user network.
        strength: Touch strength of users without one of their own.
        contact: Gestures that a wide touch cannot be.
        radius: Network of the touch's radius; None: unknown.
        contacts: Network of what touches in each frame; None: unknown.
    """

    labels: tuple[str, ...]
    rows: int
    columns: int
    preprocess: PreprocessSettings
    debounce: DebounceSettings
    spread: PositionSpread | None = None
    users: Users = NO_USERS
    identifies: bool = False
    strength: float = 1.0
    contact: ContactSettings = field(default_factory=ContactSettings)
    radius: RadiusNetwork | None = None
    contacts: ContactNetwork | None = None


_LEAST_PRODUCT: Final = 1e-12  # of two probabilities: networks may contradict each other


class Networks:
    """Base of the networks of a pipeline: `controller.bundles.inference.networks.Recognizer`."""

    def probabilities(self, window: Window, user: str = "") -> Probabilities:
        """Return the probability of each label, (classes,), by the user's own network if any."""
        raise NotImplementedError

    def people(self, window: Window) -> Probabilities | None:
        """Return the probability of each user, (1 + users,); None without a user network."""
        return None

    def touch(self, image: Image) -> Touch | None:
        """Return the position of a touch, (x, y) in grid units; None: unknown."""
        return None


class Pipeline:
    """The stages of one session and their state.

    Attributes:
        user: The identified user, "" if none.
        confidence: Probability of that user.
        mark: Called at the end of each hop of `controller.runtime.latency`, if not None.
    """

    def __init__(
        self,
        settings: PipelineSettings,
        networks: Networks,
        mapping: Mapping,
        known: StoredBaseline | None = None,
        player: str = "",
        signal: Signal = SKIN,
    ) -> None:
        """Join the stages.

        Args:
            settings: Of all stages.
            networks: Of the same bundle.
            mapping: The bundle's, or an override of it.
            known: An earlier calibration of the sensor.
            player: The user, named by the options; "" or not enrolled: to be identified.
            signal: Unit and sign of the sensor.

        Raises:
            ValueError: The calibration is of a sensor of another shape.
        """
        grid, rate_hz = (settings.rows, settings.columns), settings.preprocess.rate_hz
        self._preprocessor = Preprocessor(settings.preprocess, *grid, known, signal=signal)
        self._touch = TouchImage(TOUCH_WINDOWS * settings.preprocess.window, *grid, rate_hz)
        self._level = ContactLevel(*grid)
        self._depth = 1.0 if known is None else known.depth
        self._ratio = self._preprocessor.settings.normalise == "ratio"
        before = None if known is None else known.rest
        self._health = HealthMonitor(rate_hz, ratio=self._ratio, before=before)
        self._player = player
        self.exchange(settings, networks, mapping)
        self._number = 0
        self._dead: NDArray[np.bool_] | None = None  # dead taxels, (rows, columns)
        self.mark: Callable[[], None] | None = None

    def step(self, frame: Frame, t_s: float, number: int | None = None) -> Step:
        """Process one frame.

        Args:
            frame: One scan, (rows, columns), picofarads.
            t_s: The end of the scan.
            number: The frame's number; by default one more than the last.

        Raises:
            ValueError: The frame has another shape than the bundle's sensor.
        """
        self._number = self._number + 1 if number is None else number
        self._preprocessor.learn()  # of the last frame, if `check_health` did not call it
        self._preprocessor.pressed = self._held in self._steady and self._debouncer.press_likely
        prepared = self._preprocessor.measure(frame)
        window = self._preprocessor.window() if prepared.ready else None
        contact = self._touching(prepared)
        if self.mark is not None:
            self.mark()
        if window is None:
            probabilities = self._certain.copy()
        else:
            seen = scaled(window, self.strength)
            own = self._networks.probabilities(seen, self.user)
            probabilities = agreed(own, self._tracker.labels, self._shared)
        if self.mark is not None:
            self.mark()
        step = self._decide(prepared, window, probabilities, contact, t_s)
        self._health.notice(prepared)
        self._dead = prepared.dead
        if self.mark is not None:
            self.mark()
        return step

    def check_health(self) -> tuple[str, ...]:
        """Return the sensor's faults, worst first; apply the deferred baseline update before.

        Call it after a frame's messages were sent. The faults are searched once a second.
        """
        self._preprocessor.learn()
        if self._health.due:
            self._health.check(self._dead, self._preprocessor.resting)
        return self._health.found

    def exchange(self, settings: PipelineSettings, networks: Networks, mapping: Mapping) -> None:
        """Use another bundle from the next frame on; rest and images stay, a held gesture ends.

        It has the grid and the preprocessing of the one before, but for contacts beside others.
        """
        self._preprocessor.look_beside(settings.preprocess.beside)
        self.labels, self.mapping = settings.labels, mapping
        self._networks, self._spread, self._users = networks, settings.spread, settings.users
        self._strength = settings.strength
        rate_hz = settings.preprocess.rate_hz
        self._contact, self._radius = settings.contact, settings.radius
        self._contacts = settings.contacts
        units = 0 if settings.contacts is None else settings.contacts.units
        self._tracker = ContactTracker(settings.rows, settings.columns, rate_hz, units)
        told = 0 if settings.contacts is None else settings.contacts.labels
        taught = [label in settings.contact.taught for label in settings.labels[:told]]
        self._shared = np.flatnonzero(np.logical_not(taught))
        self._steady = set(settings.contact.several).difference(settings.debounce.slow)
        self._refused = False  # the touch that is held was too wide for its gesture
        self._debouncer = Debouncer(settings.labels, settings.debounce, rate_hz, _turn(settings))
        self._certain = np.zeros(len(settings.labels), dtype=np.float32)
        self._certain[NULL] = 1.0
        self._held = ""
        self.user = self._player if self._player in settings.users.names else ""
        self.confidence = float(bool(self.user))
        self._identifier: UserIdentifier | None = None
        if settings.identifies and not self.user:
            self._identifier = UserIdentifier(settings.users, rate_hz)
            self.confidence = self._identifier.confidence

    def recalibrate(self) -> None:
        """Find the rest image again; no window is ready until then."""
        self._preprocessor = self._preprocessor.anew()

    @property
    def rest(self) -> Frame | None:
        """The untouched sensor, (rows, columns), picofarads; None until it is found."""
        self._preprocessor.learn()
        return self._preprocessor.rest

    @property
    def strength(self) -> float:
        """Touch strength of the user; windows are divided by it for the gesture network."""
        return self._users.strengths.get(self.user, self._strength)

    @property
    def learned(self) -> float:
        """Scale learned from touches; 0: none, or not yet."""
        return self._preprocessor.learned

    def state(self) -> State:
        """Return the state of all stages, by stage and name, for an exact continuation."""
        self._preprocessor.learn()
        stages = {
            "preprocess": self._preprocessor.state(),
            "debounce": self._debouncer.state(),
            "touch": self._touch.state(),
            "moving": self._tracker.state(),
            "contact": {**self._level.state(), "refused": np.array([float(self._refused)])},
        }
        if self._identifier is not None:
            stages["users"] = self._identifier.state()
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
        if self._ratio and not (state["preprocess.rest"] > 0.0).all():
            raise ValueError("the state has a rest image that is not above zero")
        held = state["debounce.held"][0], state["debounce.lasting"][0]
        if not 0 <= min(held) <= max(held) < len(self.labels):
            raise ValueError("the state holds a gesture that the bundle does not have")
        stages: defaultdict[str, State] = defaultdict(dict)
        for key, array in state.items():
            stage, _, name = key.partition(".")
            stages[stage][name] = array
        self._preprocessor.restore(stages["preprocess"])
        self._debouncer.restore(stages["debounce"])
        self._touch.restore(stages["touch"])
        self._tracker.restore(stages["moving"])
        self._level.restore(stages["contact"])
        self._refused = bool(stages["contact"]["refused"][0])
        self._held = self._debouncer.held
        if self._identifier is not None:
            self._identifier.restore(stages["users"])
            self.user, self.confidence = self._identifier.name, self._identifier.confidence

    def _decide(
        self,
        prepared: Prepared,
        window: Window | None,
        probabilities: Probabilities,
        contact: ContactEstimate | None,
        t_s: float,
    ) -> Step:
        """Return gesture, touch, command and user of a frame with probabilities (classes,)."""
        before, null = bool(self._held or self._debouncer.tapped), bool(probabilities[NULL] > 0.5)
        lay = self._debouncer.lying
        last = None
        if prepared.begun:
            last = self._debouncer.restart()
            self._level.restart()
            self._touch.restart(prepared.idle)
        image = prepared.image if prepared.added is None else prepared.added
        level = self._level.step(image, prepared.idle) if prepared.ready else 0.0
        idle, uneven = prepared.idle / self.strength, self._level.uneven
        gesture = self._debouncer.step(probabilities, idle, level, uneven, contact) or last
        held = self._held = self._debouncer.held
        touch = sigma = command = None
        if prepared.ready:
            released, left = before and not held, lay and not held
            self._touch.step(image, prepared.idle, null=null, released=released, left=left)
            # A tap may be answered when it has left.
            stacked = self._touch.image(latest=gesture is not None)
            touch = None if stacked is None else self._networks.touch(stacked)
        if touch is not None and self._spread is not None:
            sigma = self._spread.sigma(self._touch.blur)
        self._refused &= bool(held)
        if gesture in self._contact.labels and self._too_wide(prepared):
            self._refused, gesture = bool(held), None
        if gesture is not None:
            command = self._command(gesture, touch, probabilities, t_s)
        if self._identifier is not None:
            self._identify(self._identifier, window, busy=bool(probabilities[NULL] < 0.5))
        return Step(
            self._number,
            t_s,
            prepared.image,
            prepared.ready,
            prepared.quiet,
            probabilities,
            touch,
            gesture,
            "" if self._refused else held,
            command,
            sigma,
            self.user,
            self.confidence,
            contact,
        )

    def _touching(self, prepared: Prepared) -> ContactEstimate | None:
        """Return what touches in a frame, with what lies: a finger that presses deeper is none."""
        if self._contacts is None or not prepared.ready:
            return None
        contact = self._tracker.step(prepared.image, prepared.idle, self._contacts)
        return contact if contact is None or self._depth == 1.0 else contact.deeper(self._depth)

    def _command(
        self, gesture: str, touch: Touch | None, probabilities: Probabilities, t_s: float
    ) -> CommandRecord | None:
        """Return the command of a gesture with probabilities (classes,), if it has one."""
        rules = self._users.mapping(self.user, self.mapping) if self.user else self.mapping
        name = rules.command(gesture, touch)
        if name is None:
            return None
        now = float(probabilities[self.labels.index(gesture)])
        probability = max(now, self._debouncer.tapped)  # a tap has left when it is answered
        return CommandRecord(t_s, self._number, gesture, probability, touch, name)

    def _too_wide(self, prepared: Prepared) -> bool:
        """Whether the touch is wider than a finger's."""
        if self._radius is None or prepared.idle > self._contact.quiet:
            return False
        if prepared.broken > 1 or prepared.beside:  # its network learned neither
            return False
        return self._contact.too_wide(*self._radius.log_radius(self._touch.signals, prepared.idle))

    def _identify(self, identifier: UserIdentifier, window: Window | None, *, busy: bool) -> None:
        """Collect evidence of the user during a touch; only a gesture makes it count."""
        probabilities = None
        if window is not None and (self._held or busy):
            probabilities = self._networks.people(window)
        identifier.step(probabilities, counts=self._held in self._users.gestures)
        self.user, self.confidence = identifier.name, identifier.confidence


def agreed(own: Probabilities, others: Probabilities, shared: Index) -> Probabilities:
    """Return what two networks say together of labels, (classes,): their geometric mean.

    Args:
        own: Probability of each label.
        others: Those of the first labels, or none.
        shared: Labels that both may decide; of the rest `own` decides.
    """
    if not len(others):
        return own
    said = own.copy()
    said[shared] = others[shared] * (own[shared].sum() / max(_LEAST_PRODUCT, others[shared].sum()))
    both: Probabilities = np.sqrt(np.maximum(own * said, _LEAST_PRODUCT))
    both /= both.sum()
    return both


def _turn(settings: PipelineSettings) -> TurnTracker | None:
    """Return a tracker of the angle for a bundle that answers twists both ways, else None."""
    twists = [settings.labels.index(label) for label in settings.debounce.slow]
    others = {settings.labels.index(label) for label in settings.contact.several}
    match twists:
        case [clockwise, counter] if settings.contacts is not None:
            return TurnTracker(clockwise, counter, sorted(others.difference(twists)))
    return None


def _unlike(given: NDArray[np.float64], own: NDArray[np.float64]) -> bool:
    """Return whether two arrays differ in shape; lists of images may differ in length."""
    return given.shape[1:] != own.shape[1:] or (own.ndim < 2 and len(given) != len(own))
