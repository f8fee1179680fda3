"""The virtual orb: mechanics, drift and read-out joined, and a sensor that a host may touch.

`OrbSimulator` turns finger paths into frames, many or few at a time with the same result.
`VirtualOrb` is the sensor: it keeps what fingers do now, and scans when it is asked to.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.preprocess import Frame
from controller.protocol import Contact, Truth
from controller.simulator.contact import ContactModel, Fingers, Skin
from controller.simulator.hand import (
    DISTRACTORS,
    MECHANICS_HZ,
    SLOTS,
    Performance,
    draw_mood,
    draw_style,
    perform,
)
from controller.simulator.membrane import APEX_STRETCH, RADIUS_MM, inflate
from controller.simulator.readout import ReadoutModel, read, scan_times

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ROWS: Final = 5
COLUMNS: Final = 5
PITCH_MM: Final = 10.0
POINTERS: Final = 10  # contacts a host may place beside the orb's own hand
_NO_RELIEF: Final = 1e-4  # of the radius; moves no taxel by more than 0.05 %
_CHUNK: Final = 512  # mechanics steps evaluated at once; bounds memory


@dataclass(frozen=True, slots=True)
class OrbModel:
    """Everything about an orb that is not drawn at random.

    Attributes:
        apex_stretch: Stretch of the inflated apex.
        contact: Contact mechanics.
        readout: The circuit.
        rest_pf: Mean and deviation of the taxels' capacitances: paper, section 3.2.
        memory: (share, time constant in s) of the rubber's viscoelastic memory of ln C.
        bulge_s: How fast the pump's regulator takes the bulge away.
        pressure: Relative pressure noise.
        taxel_drift: (deviation, time constant in s) of each taxel's own drift.
        common_drift: The same for all taxels together.
        dead, leaky: Shares of taxels that do not react, or react weakly and noisily.
        jitter_s: Deviation of a scan's start.
    """

    apex_stretch: float = APEX_STRETCH
    contact: ContactModel = field(default_factory=ContactModel)
    readout: ReadoutModel = field(default_factory=ReadoutModel)
    rest_pf: tuple[float, float] = (41.2, 2.9)
    memory: tuple[tuple[float, float], ...] = ((0.05, 0.25), (0.04, 3.0))
    bulge_s: float = 3.0
    pressure: float = 0.004
    taxel_drift: tuple[float, float] = (0.012, 120.0)
    common_drift: tuple[float, float] = (0.01, 200.0)
    dead: float = 0.01
    leaky: float = 0.02
    jitter_s: float = 0.001


class OrbSimulator:
    """Finger paths in, frames out; the same orb and the same noise for the same seed."""

    def __init__(
        self,
        seed: np.random.SeedSequence,
        rate_hz: float = 10.0,
        slots: int = SLOTS,
        model: OrbModel | None = None,
    ) -> None:
        self.model = model or OrbModel()
        self.rate_hz = rate_hz
        self.steps_per_frame = max(1, round(MECHANICS_HZ / rate_hz))
        self.step_s = 1.0 / (rate_hz * self.steps_per_frame)
        build, drift, pressure, noise, jitter, friction = (
            np.random.default_rng(child) for child in seed.spawn(6)
        )
        self._drift_noise, self._pressure_noise = drift, pressure
        self._noise, self._jitter_noise = noise, jitter
        model_ = self.model
        membrane = inflate(model_.apex_stretch)
        self._skin = Skin(membrane, ROWS, COLUMNS, PITCH_MM, model_.contact)
        taxels = ROWS * COLUMNS
        self._rest = build.normal(*model_.rest_pf, taxels)
        fault = build.random(taxels)
        self._dead = fault < model_.dead
        self._leaky = (fault >= model_.dead) & (fault < model_.dead + model_.leaky)
        self._friction = friction.uniform(0.4, 0.8)  # mm of drag per mm of depth
        self._stick_mm = 4.0  # no skin is dragged farther
        self._mains_phase = build.uniform(0.0, 2 * np.pi)
        self._drift = drift.normal(0.0, model_.taxel_drift[0], taxels)
        self._common = float(drift.normal(0.0, model_.common_drift[0]))
        self._anchor = np.zeros(slots, dtype=np.complex128)
        self._touching = np.zeros(slots, dtype=bool)
        self._relief = 0.0
        self._memory = np.zeros((len(model_.memory), taxels))
        self._last = np.zeros((2, taxels))  # ln C at the last mechanics steps
        self._tail = np.zeros((2, slots, 3))  # x, y (mm), depth at those steps
        self._previous = np.array(0.3)
        self._scan = scan_times(ROWS, COLUMNS, model_.readout)
        self.frames = 0

    def advance(self, point: Complex, depth_mm: Array, radius_mm: Array) -> NDArray[np.float32]:
        """Simulate on and return the frames that were completed, (frames, rows, columns), pF.

        Args:
            point: Hand points, complex mm from the centre, (frames * steps_per_frame, slots).
            depth_mm: Indentations, same shape.
            radius_mm: Finger radii, same shape.
        """
        position, drag = self._stick(point, depth_mm)
        log_c = np.empty((len(point), ROWS * COLUMNS))
        for start in range(0, len(point), _CHUNK):
            part = slice(start, start + _CHUNK)
            log_c[part] = self._stretch(position[part], depth_mm[part], radius_mm[part], drag[part])
        self._remember(log_c)
        return self._scans(log_c, position, depth_mm)

    def _stick(self, point: Complex, depth_mm: Array) -> tuple[Complex, Complex]:
        """Prandtl stick-slip: the skin follows a finger until friction gives way."""
        touching: NDArray[np.bool_] = depth_mm > 0.0
        before = np.concatenate([self._touching[None], touching[:-1]])
        landing: NDArray[np.bool_] = touching & ~before
        self._touching = touching[-1]
        position = np.zeros_like(point)
        drag = np.zeros_like(point)
        for i in np.flatnonzero(touching.any(axis=1)):
            self._anchor = np.where(landing[i], point[i], self._anchor)
            pull = point[i] - self._anchor
            limit = np.minimum(self._friction * depth_mm[i], self._stick_mm)
            length = np.abs(pull)
            held = np.where(length > limit, pull * limit / np.maximum(length, 1e-9), pull)
            self._anchor = np.where(touching[i], point[i] - held, self._anchor)
            position[i] = np.where(touching[i], self._anchor, 0.0)
            drag[i] = np.where(touching[i], held, 0.0)
        return position, drag

    def _stretch(self, position: Complex, depth: Array, radius: Array, drag: Complex) -> Array:
        """Return ln(C / C0) at each step, (steps, taxels), before memory."""
        out = np.zeros((len(position), ROWS * COLUMNS))
        used: NDArray[np.bool_] = np.any(depth > 0.0, axis=0)
        used[0] = True
        z, depth, drag = position[:, used] / RADIUS_MM, depth[:, used], drag[:, used]
        radius = np.maximum(radius[:, used], 1.0)
        relief = self._relieve(z, depth, radius)
        active = (depth > 0.0).any(axis=1) | (relief > _NO_RELIEF)
        if active.any():
            fingers = Fingers(z[active], depth[active], radius[active], drag[active])
            out[active] = self._skin.log_capacitance(fingers, relief[active])[0]
        return out

    def _relieve(self, z: Complex, depth: Array, radius: Array) -> Array:
        """Return how much of the bulge the pump's regulator has taken away, radii, (steps,)."""
        free = np.zeros(len(z))
        pressed = (depth > 0.0).any(axis=1)
        if pressed.any():
            free[pressed] = self._skin.free_bulge(z[pressed], depth[pressed], radius[pressed])
        decay = np.exp(-self.step_s / self.model.bulge_s)
        gain = (1.0 - decay) * self.model.contact.regulated
        relief = np.empty(len(z))
        for i, bulge in enumerate(free):
            self._relief = decay * self._relief + gain * bulge
            relief[i] = self._relief
        return relief

    def _remember(self, log_c: Array) -> None:
        """Apply the rubber's memory in place: x_v = (x + sum g LP x) / (1 + sum g)."""
        total = 1.0 + sum(share for share, _ in self.model.memory)
        plain = log_c.copy()
        for m, (share, tau_s) in enumerate(self.model.memory):
            decay = np.exp(-self.step_s / tau_s)
            level = self._memory[m]
            for i in range(len(log_c)):
                level = decay * level + (1.0 - decay) * plain[i]
                log_c[i] += share * level
            self._memory[m] = level
        log_c /= total

    def _scans(self, log_c: Array, position: Complex, depth: Array) -> NDArray[np.float32]:
        """Drift, pressure noise and the rolling read-out of every completed frame."""
        frames = len(log_c) // self.steps_per_frame
        taxels = ROWS * COLUMNS
        model = self.model
        track = np.concatenate([self._last, log_c])
        finger = np.stack([position.real, position.imag, depth], axis=-1)
        touched = np.concatenate([self._tail, finger])
        self._last, self._tail = track[-2:].copy(), touched[-2:].copy()
        ends = (np.arange(frames) + 1.0) / self.rate_hz
        jitter = np.abs(self._jitter_noise.normal(0.0, model.jitter_s, frames))
        when = ends[:, None] + self._scan[None, :] - jitter[:, None]
        # Step i of this call ends at (i + 1) * step_s; two older ones stand before it.
        place = np.clip(when / self.step_s + 1.0, 0.0, len(track) - 1.001)
        low = place.astype(int)
        share = place - low
        column = np.arange(taxels)
        values = track[low, column] * (1.0 - share) + track[low + 1, column] * share
        drift = self._wander(frames)
        pressure = self._pressure_noise.normal(0.0, model.pressure, (frames, 1))
        rest = self._rest * (1.0 + drift) * (1.0 + pressure) ** 2
        weak = np.where(self._leaky, 0.6, 1.0) * np.where(self._dead, 0.0, 1.0)
        capacitance = rest * np.exp(values * weak)
        noise = self._noise.normal(0.0, 1.0, (frames, 2, taxels))
        capacitance *= 1.0 + 0.01 * noise[:, 1] * self._leaky
        phase = 2 * np.pi * model.readout.mains_hz * (when + self.frames / self.rate_hz)
        shape = (frames, ROWS, COLUMNS)
        picofarads, self._previous = read(
            model.readout,
            capacitance.reshape(shape),
            self._rows_touched(touched[2 + self.steps_per_frame - 1 :: self.steps_per_frame]),
            (phase + self._mains_phase).reshape(shape),
            self._previous,
            noise[:, 0].reshape(shape),
        )
        self.frames += frames
        return picofarads.astype(np.float32)

    def _rows_touched(self, finger: Array) -> Array:
        """How much finger lies over each row at each frame's end, (frames, rows), 0 ... 1."""
        rows_y = ((ROWS - 1) / 2 - np.arange(ROWS)) * PITCH_MM
        near = np.exp(-0.5 * ((finger[:, :, 1, None] - rows_y) / 6.0) ** 2)
        firm = np.minimum(finger[:, :, 2, None] / 5.0, 1.0)
        return np.asarray(np.minimum((near * firm).sum(axis=1), 1.0))

    def _wander(self, frames: int) -> Array:
        """Ornstein-Uhlenbeck drift of every taxel and of all together, (frames, taxels)."""
        taxels = ROWS * COLUMNS
        deviation, tau_s = self.model.taxel_drift
        common, common_s = self.model.common_drift
        keep = np.exp(-1.0 / (tau_s * self.rate_hz))
        keep_common = np.exp(-1.0 / (common_s * self.rate_hz))
        noise = self._drift_noise.normal(0.0, 1.0, (frames, taxels + 1))
        out = np.empty((frames, taxels))
        for i in range(frames):
            kick = np.sqrt(1 - keep**2) * deviation * noise[i, :-1]
            self._drift = keep * self._drift + kick
            push = np.sqrt(1 - keep_common**2) * common * noise[i, -1]
            self._common = float(keep_common * self._common + push)
            out[i] = self._drift + self._common
        return out


@dataclass(slots=True)
class _Running:
    """A performance under way."""

    number: int
    start_s: float
    performance: Performance


class VirtualOrb:
    """A sensor that is simulated: its own hand performs, and a host's fingers touch it."""

    rows, columns, pitch_mm = ROWS, COLUMNS, PITCH_MM

    def __init__(
        self, seed: int, rate_hz: float = 10.0, domain: int = 1, model: OrbModel | None = None
    ) -> None:
        """Build an orb, its user and its session from a seed.

        Args:
            seed: Which orb, user and session.
            rate_hz: Frames per second.
            domain: Family of seeds: 0 belongs to training, which nothing else may use.
            model: The orb's constants.
        """
        root = np.random.SeedSequence([domain, seed])
        orb, user = root.spawn(2)
        self.rate_hz = rate_hz
        self._simulator = OrbSimulator(orb, rate_hz, SLOTS + POINTERS, model)
        self._rng = np.random.default_rng(user)
        self.style = draw_mood(draw_style(self._rng), self._rng)
        self._running: list[_Running] = []
        self._ended: list[Truth] = []
        self._history: deque[tuple[float, float, str]] = deque(maxlen=64)
        self._updates: deque[tuple[float, tuple[Contact, ...]]] = deque()
        self._wanted: dict[int, Contact] = {}  # slot -> what the host's finger wants
        self._slot_of: dict[int, int] = {}  # contact id -> slot
        self._pointer = np.zeros(POINTERS, dtype=np.complex128)
        self._pointer_depth = np.zeros(POINTERS)
        self._pointer_radius = np.full(POINTERS, 7.0)

    def perform(self, number: int, label: str, x: float, y: float, t_s: float) -> None:
        """Let the orb's own hand do `label` at (x, y), grid units, from `t_s` on.

        Raises:
            ValueError: The hand does not know the label.
        """
        done = perform(label, (x, y), self.style, self._rng)
        self._running.append(_Running(number, t_s, done))
        onset, release = t_s + done.onset_s, t_s + done.release_s
        self._history.append((onset, release, label))

    def touch(self, contacts: Sequence[Contact], t_s: float) -> None:
        """Place the host's fingers: all that touch from `t_s` on; an empty list lifts them."""
        self._updates.append((t_s, tuple(contacts)[:POINTERS]))

    def truths(self) -> list[Truth]:
        """Return the performances that have ended since the last call."""
        ended, self._ended = self._ended, []
        return ended

    def label(self, t_s: float) -> str:
        """Return what the orb's own hand truly did at `t_s`: a gesture, else "null"."""
        for onset, release, label in self._history:
            if onset <= t_s < release and label not in DISTRACTORS:
                return label
        return "null"

    def read(self, t_s: float) -> Frame:
        """Scan: return the frame whose scan ends at `t_s`, pF; call at the sensor's rate."""
        steps = self._simulator.steps_per_frame
        step_s = self._simulator.step_s
        slots = SLOTS + POINTERS
        point = np.zeros((steps, slots), dtype=np.complex128)
        depth, radius = np.zeros((steps, slots)), np.full((steps, slots), 7.0)
        for i in range(steps):
            now = t_s - (steps - 1 - i) * step_s
            self._pose(now, point[i], depth[i], radius[i])
            self._follow_pointers(now, step_s)
            point[i, SLOTS:] = self._pointer
            depth[i, SLOTS:] = self._pointer_depth
            radius[i, SLOTS:] = self._pointer_radius
        self._finish(t_s)
        return np.asarray(self._simulator.advance(point, depth, radius)[-1], dtype=np.float32)

    def _pose(self, now: float, point: Complex, depth: Array, radius: Array) -> None:
        """Put the hand's fingers where its performance is at `now`."""
        for run in self._running:
            step = round((now - run.start_s) * MECHANICS_HZ)
            if 0 <= step < len(run.performance.point):
                point[:SLOTS] = run.performance.point[step]
                depth[:SLOTS] = run.performance.depth_mm[step]
                radius[:SLOTS] = run.performance.radius_mm

    def _finish(self, now: float) -> None:
        """Report the performances whose last finger has left."""
        for run in [r for r in self._running if now >= r.start_s + r.performance.release_s]:
            self._running.remove(run)
            onset_ms = round((run.start_s + run.performance.onset_s) * 1000)
            release_ms = round((run.start_s + run.performance.release_s) * 1000)
            self._ended.append(Truth(run.number, run.performance.label, onset_ms, release_ms))

    def _follow_pointers(self, now: float, step_s: float) -> None:
        """Let the host's fingers sink in, move and rise as fast as fingers can."""
        while self._updates and self._updates[0][0] <= now:
            self._assign(self._updates.popleft()[1])
        for slot in range(POINTERS):
            wanted = self._wanted.get(slot)
            goal = wanted.depth_mm if wanted else 0.0
            step = _SINK_MM_S * step_s
            change = float(np.clip(goal - self._pointer_depth[slot], -step, step))
            self._pointer_depth[slot] += change
            if wanted:
                target = complex(wanted.x - 2.0, wanted.y - 2.0) * PITCH_MM
                share = 1.0 - np.exp(-step_s / _FOLLOW_S)
                self._pointer[slot] += share * (target - self._pointer[slot])
                self._pointer_radius[slot] = wanted.radius_mm

    def _assign(self, contacts: tuple[Contact, ...]) -> None:
        """Give each contact a slot of its own for as long as it lasts."""
        present = {contact.id for contact in contacts}
        self._slot_of = {i: s for i, s in self._slot_of.items() if i in present}
        self._wanted = {}
        for contact in contacts:
            slot = self._slot_of.get(contact.id)
            if slot is None:
                taken = set(self._slot_of.values())
                free = [s for s in range(POINTERS) if s not in taken]
                slot = min(free, key=lambda s: self._pointer_depth[s])
                self._slot_of[contact.id] = slot
                self._pointer[slot] = complex(contact.x - 2.0, contact.y - 2.0) * PITCH_MM
                self._pointer_depth[slot] = 0.0
            self._wanted[slot] = contact


_SINK_MM_S: Final = 75.0  # a finger presses 9 mm deep in 0.12 s
_FOLLOW_S: Final = 0.03  # a finger lags the pointer by this much
