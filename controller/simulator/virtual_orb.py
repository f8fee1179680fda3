"""The virtual orb: a sensor that has a hand of its own, and that a host's fingers may touch."""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, replace
from math import exp, hypot, isfinite
from typing import Final

import numpy as np

from controller.recognition.images.frames import Frame
from controller.shared.aliases import Array, Complex
from controller.shared.event_metric import Event
from controller.shared.protocol.messages import Contact, GroundTruth
from controller.simulator.dome.faults import Fault
from controller.simulator.dome.membrane import clamp_radius_mm
from controller.simulator.hand.gesture_file import Repertoire, shipped
from controller.simulator.hand.performance import SLOTS, Performance, perform
from controller.simulator.hand.pointer import FOLLOW_S, SINK_MM_S
from controller.simulator.hand.session_script import hold_button
from controller.simulator.hand.user_style import UserStyle, draw_mood, draw_style
from controller.simulator.orb import NOMINAL, OrbModel, OrbSimulator

POINTERS: Final = 10  # contacts a host may place beside the orb's own hand
PERFORMANCES: Final = 8  # of the orb's own hand that may be under way at once
EDGE: Final = 0.96  # of the dome's radius: where fingers end, as in host/ui/pointer_input.py
DEEPEST_MM: Final = 15.0  # the simulated hands press 12 mm deep at most
WIDEST_MM: Final = 15.0  # a finger's radius; a thumb's is about 10 mm
_UPDATES: Final = 1024  # of the host's fingers that wait for a scan
_JUMP_S: Final = 0.04  # a finger that has gone further than _JUMP_MM in more time than this
_JUMP_MM: Final = 3.0  # moves evenly instead of jumping
_EVEN_S: Final = 0.1  # and takes so long at most


@dataclass(slots=True, eq=False)
class _Running:
    """A performance under way."""

    number: int
    start_s: float
    performance: Performance


class VirtualOrb:
    """A sensor that is simulated: its own hand performs, and a host's fingers touch it.

    Attributes:
        quick: Whether the hand is as quick as in fast play.
        repertoire: What the hand can do.
    """

    quick = False

    def __init__(
        self,
        seed: int,
        rate_hz: float = 10.0,
        domain: int = 1,
        model: OrbModel = NOMINAL,
        *,
        repertoire: Repertoire | None = None,
        user: int = 0,
        day: int = 0,
    ) -> None:
        """Build a sound orb, its user and their session of a day from a seed.

        Domain 0 of seeds belongs to training. The usual repertoire is the gestures that ship.
        """
        model = replace(model, electronics=replace(model.electronics, dead=0.0, leaky=0.0))
        orb, people, self._thumbs = np.random.SeedSequence([domain, seed]).spawn(3)
        self.rate_hz, self.model = rate_hz, model
        self.repertoire = shipped() if repertoire is None else repertoire
        self._simulator = OrbSimulator(orb, rate_hz, SLOTS + POINTERS, model, day)
        self._step_hz = rate_hz * self._simulator.steps_per_frame
        style, self._rng = _come(people, user, day)
        self.style = draw_mood(style, self._rng)
        if user or day:
            key = (*self._thumbs.spawn_key, user, day)
            self._thumbs = np.random.SeedSequence(self._thumbs.entropy, spawn_key=key)
        self._running: list[_Running] = []
        self._ended: list[GroundTruth] = []
        self._presses: deque[tuple[Event, np.random.SeedSequence]] = deque(maxlen=16)
        self._updates: deque[tuple[float, tuple[Contact, ...]]] = deque(maxlen=_UPDATES)
        self._updated_s = 0.0  # when the fingers last changed
        self._wanted: dict[int, Contact] = {}  # slot -> what the host's finger wants
        # slot -> where its finger goes: from (s, complex mm) to (s, complex mm)
        self._ways: dict[int, tuple[float, complex, float, complex]] = {}
        self._slot_of: dict[int, int] = {}  # contact id -> slot
        self._pointer = np.zeros(POINTERS, dtype=np.complex128)
        self._pointer_depth = np.zeros(POINTERS)
        self._pointer_radius = np.full(POINTERS, 7.0)

    @property
    def skin(self) -> tuple[Array, Array]:
        """State at the latest scan: true capacitances, pF, (rows, columns); fingers over rows."""
        return self._simulator.electronics.skin

    def switch(self, faults: Iterable[Fault], on: bool = True) -> None:
        """Switch faults on or off."""
        self._simulator.electronics.switch(faults, on)

    def perform(self, number: int, label: str, x: float, y: float, t_s: float) -> None:
        """Let the orb's own hand do `label` at (x, y), grid units, from `t_s` on; "" lifts it.

        Raises:
            ValueError: The hand does not know the label, has too much to do, or the place is none.
        """
        if not label:
            self._running.clear()
            self._presses = deque((p for p in self._presses if p[0].release_s <= t_s), maxlen=16)
            return
        if len(self._running) >= PERFORMANCES:
            raise ValueError(f"the virtual hand has {PERFORMANCES} things to do; wait for them")
        if not (isfinite(x) and isfinite(y)):
            raise ValueError(f"({x}, {y}) is no place on the orb")
        x, y = self._on_dome(x, y)
        model = self.model
        grid = (model.rows, model.columns, model.pitch_mm)
        done = perform(
            label,
            (x, y),
            self.style,
            self._rng,
            grid=grid,
            step_hz=self._step_hz,
            repertoire=self.repertoire,
            quick=self.quick,
        )
        self._running.append(_Running(number, t_s, done))
        if not self.repertoire[label].distractor:
            (thumb,) = self._thumbs.spawn(1)
            event = Event(t_s + done.onset_s, t_s + done.release_s, label)
            self._presses.append((event, thumb))

    def touch(self, contacts: Sequence[Contact], t_s: float) -> None:
        """Place the host's fingers: all that touch from `t_s` on; an empty list lifts them.

        A finger beyond the dome's edge is placed at the edge, and depth and radius are limited to
        what a finger can do. A contact with a field that is not finite is left out.
        """
        felt = (self._limited(one) for one in contacts if all(map(isfinite, astuple(one))))
        self._updates.append((t_s, tuple(felt)[:POINTERS]))

    def truths(self) -> list[GroundTruth]:
        """Return the performances that have ended since the last call."""
        ended, self._ended = self._ended, []
        return ended

    def label(self, t_s: float) -> str:
        """Return what the orb's own hand truly did at `t_s`: a gesture, else "null"."""
        now = (one.kind for one, _ in self._presses if one.onset_s <= t_s < one.release_s)
        return next(now, "null")

    def button(self, t_s: float) -> str | None:
        """Return what the label button says at `t_s`, pressed with human timing; else "null"."""
        now = np.array([t_s])
        for event, thumb in self._presses:
            if hold_button([event], ("null", event.kind), now, np.random.default_rng(thumb))[0]:
                return event.kind
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
        """Write the hand's fingers at `now` into one step's arrays, (slots,)."""
        for run in self._running:
            step = round((now - run.start_s) * self._step_hz)
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
            self._ended.append(GroundTruth(run.number, run.performance.label, onset_ms, release_ms))

    def _follow_pointers(self, now: float, step_s: float) -> None:
        """Let the host's fingers sink in, move and rise as fast as fingers can."""
        while self._updates and self._updates[0][0] <= now:
            self._assign(*self._updates.popleft())
        step, share = SINK_MM_S * step_s, 1.0 - exp(-step_s / FOLLOW_S)
        for slot in {*self._wanted, *np.flatnonzero(self._pointer_depth).tolist()}:
            wanted = self._wanted.get(slot)
            arriving = not wanted and now < self._ways[slot][2]  # a finger lifts at its way's end
            goal = wanted.depth_mm if wanted else float(arriving * self._pointer_depth[slot])
            change = goal - float(self._pointer_depth[slot])
            self._pointer_depth[slot] += min(max(change, -step), step)
            self._pointer[slot] += share * (self._goal(slot, now) - self._pointer[slot])
            if wanted:
                self._pointer_radius[slot] = wanted.radius_mm

    def _goal(self, slot: int, now: float) -> complex:
        """Return where a finger is to be, complex mm from the centre."""
        begin_s, start, end_s, end = self._ways[slot]
        return start + min((now - begin_s) / (end_s - begin_s), 1.0) * (end - start)

    def _assign(self, now: float, contacts: tuple[Contact, ...]) -> None:
        """Give each contact a slot of its own for as long as it lasts, and a way to go."""
        gap_s, self._updated_s = now - self._updated_s, now
        present = {contact.id for contact in contacts}
        self._slot_of = {i: s for i, s in self._slot_of.items() if i in present}
        self._wanted = {}
        for contact in contacts:
            slot, point = self._slot_of.get(contact.id), self._point(contact)
            start, last_s = point, 1e-9
            if slot is None:
                taken = set(self._slot_of.values())
                free = [s for s in range(POINTERS) if s not in taken]
                slot = min(free, key=lambda s: self._pointer_depth[s])
                self._slot_of[contact.id] = slot
                self._pointer[slot] = point
                self._pointer_depth[slot] = 0.0
            elif gap_s > _JUMP_S and abs(point - self._goal(slot, now)) > _JUMP_MM:
                start, last_s = self._goal(slot, now), min(gap_s, _EVEN_S)
            self._ways[slot] = (now, start, now + last_s, point)
            self._wanted[slot] = contact

    def _limited(self, contact: Contact) -> Contact:
        """Return a contact as a finger can be on this dome."""
        x, y = self._on_dome(contact.x, contact.y)
        depth = min(max(contact.depth_mm, 0.0), DEEPEST_MM)
        radius = min(max(contact.radius_mm, 0.0), WIDEST_MM)
        return replace(contact, x=x, y=y, depth_mm=depth, radius_mm=radius)

    def _on_dome(self, x: float, y: float) -> tuple[float, float]:
        """Return the place of the dome that is nearest to (x, y), grid units."""
        model = self.model
        radius_mm = clamp_radius_mm(model.rows, model.columns, model.pitch_mm)
        reach = EDGE * radius_mm / model.pitch_mm
        middle_x, middle_y = (model.columns - 1) / 2, (model.rows - 1) / 2
        away = hypot(x - middle_x, y - middle_y)
        if away <= reach:
            return x, y
        share = reach / away
        return middle_x + share * (x - middle_x), middle_y + share * (y - middle_y)

    def _point(self, contact: Contact) -> complex:
        """Return where a contact is, complex mm from the centre."""
        model = self.model
        centre = complex(model.columns - 1, model.rows - 1) / 2.0
        return (complex(contact.x, contact.y) - centre) * model.pitch_mm


def _come(
    people: np.random.SeedSequence, user: int, day: int
) -> tuple[UserStyle, np.random.Generator]:
    """Return a user's style, and the generator of this session's mood and variation."""
    if user:
        people = np.random.SeedSequence(people.entropy, spawn_key=(*people.spawn_key, user))
    rng = np.random.default_rng(people)
    style = draw_style(rng)
    if day:
        key = (*people.spawn_key, 0, day)
        rng = np.random.default_rng(np.random.SeedSequence(people.entropy, spawn_key=key))
    return style, rng
