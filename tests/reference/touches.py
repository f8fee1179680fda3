"""Touches of the independent reference solver, frozen in `touches.npz`.

    python -m tests.reference.touches FILE   # solve them anew, three CPU minutes

Presses, pinches and twists of people with continuous depth, radius and tempo, drawn and solved by
code that neither the simulator nor training shares. Each event is of another person. The dome is
solved at 4 to 8 moments of an event, quasi-statically, in steps of at most 2.5 mm. Between them
ln C is interpolated in time, and while the fingers lift it shrinks with their depth. The rubber has
no memory. Events for which the solver finds no equilibrium are drawn again.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import interpolate

from controller.shared.aliases import Array, Complex

from .friction import Friction, RubbedDome

FILE: Final = Path(__file__).with_name("touches.npz")
RATE_HZ: Final = 40.0  # of the stored ln C
SEED: Final = 20_261_126
COUNTS: Final = {"press": 120, "pinch": 70, "twist_ccw": 60, "twist_cw": 60}
LAWS: Final = ("coulomb", "adhesion")
VOLUME: Final = 1.596  # of the inflated dome, R^3: an apex stretch of 1.5
RESERVOIR: Final = 100.0 * VOLUME  # gas that is connected with it
RINGS: Final = 10  # 331 nodes
KEYS: Final = 5  # of a finger's path: begin, landed, moved, lifting, lifted
FINGERS: Final = 5  # at most
_PLACE_MM: Final = 20.0  # half of the side of the square in which presses lie
_PULP_MM: Final = 2.0  # how far a fingertip gives way, and the indentation that takes 63 % of it
_LIMITS: Final = (-1.5, 0.4)  # of ln C / C0; beyond, a fingertip has slipped between nodes
# Shares of the time of a landing and of a movement at which the dome is solved.
_LANDING: Final = np.array([0.4, 0.6, 1.0])
_MOVING: Final = np.array([0.35, 0.5, 0.65])

Rng = np.random.Generator


def min_jerk(share: Array) -> Array:
    """Return the smooth step of a movement, 0 to 1, for shares of its time."""
    u = np.clip(share, 0.0, 1.0)
    return np.asarray(u**3 * (10.0 - 15.0 * u + 6.0 * u**2))


@dataclass(frozen=True)
class Event:
    """One touch as it was meant.

    Attributes:
        label: Its gesture.
        law: Of friction, an entry of `LAWS`.
        limit: Of friction: coefficient, or strength in Pa.
        middle: Middle of the hand, complex mm from the dome's; the place of a press.
        radius_mm: Radius of the fingertips.
        keys: Of each finger: time in s, indentation in mm, distance from the middle in mm, angle in
            radians, (fingers, 4, KEYS); minimum jerk from each to the next.
    """

    label: str
    law: str
    limit: float
    middle: complex
    radius_mm: float
    keys: Array

    @property
    def end_s(self) -> float:
        """When the last finger has left."""
        return float(self.keys[:, 0, -1].max())

    @property
    def onset_s(self) -> float:
        """When the first finger passes 40 % of its depth: a gesture's true begin."""
        time_s = np.arange(0.0, self.end_s, 0.001)
        depth = self.tracks(time_s)[1]
        return float(time_s[(depth >= 0.4 * depth.max(axis=0)).any(axis=1).argmax()])

    def tracks(self, time_s: Array) -> tuple[Complex, Array]:
        """Return points, complex mm, and indentations, mm, (steps, fingers) each."""
        at, values = self.keys[:, 0], np.repeat(self.keys[None, :, 1:, 0], len(time_s), axis=0)
        for i in range(1, KEYS):
            share = (time_s[:, None] - at[:, i - 1]) / np.maximum(at[:, i] - at[:, i - 1], 1e-3)
            change = self.keys[:, 1:, i] - self.keys[:, 1:, i - 1]
            values += min_jerk(share)[:, :, None] * change
        depth, reach, angle = np.moveaxis(values, 2, 0)
        return self.middle + reach * np.exp(1j * angle), np.maximum(depth, 0.0)

    def moments(self) -> Array:
        """Return when the dome is solved, seconds: where a movement has done a share, (n,)."""
        land, move = (self.keys[:, 0, i : i + 2].mean(axis=0) for i in (0, 1))
        found = [0.0, *(land[0] + _LANDING * (land[1] - land[0]))]
        if self.label == "press":
            return np.array(found)
        return np.array([*found, *(move[0] + _MOVING * (move[1] - move[0])), self.keys[0, 0, 2]])

    def solve(self, dome: RubbedDome) -> NDArray[np.float16]:
        """Return ln C / C0 at 40 frames a second until all is released, float16 (frames, 25).

        Raises:
            ArithmeticError: The reference finds no equilibrium.
        """
        moments = self.moments()
        point, depth = self.tracks(moments)
        travel = depth + _PULP_MM * (1.0 - np.exp(-depth / _PULP_MM))
        radius = np.full(len(self.keys), self.radius_mm)
        law = Friction(*((self.limit, 0.0) if self.law == LAWS[0] else (0.0, self.limit)))
        log_c = dome.rub(point, travel, radius, law)
        if log_c.min() < _LIMITS[0] or log_c.max() > _LIMITS[1]:
            raise ArithmeticError("a fingertip has slipped between nodes")
        frames = np.arange(int(self.end_s * RATE_HZ) + 2) / RATE_HZ
        curve = interpolate.PchipInterpolator(moments, log_c)
        # What is held shrinks with the fingers' depth when they lift.
        lifted = self.tracks(frames)[1].sum(axis=1) / depth[-1].sum()
        share = np.where(frames > moments[-1], np.minimum(lifted, 1.0), 1.0)
        log_c = curve(np.minimum(frames, moments[-1])) * share[:, None]
        return np.asarray(log_c, dtype=np.float16)


@dataclass(frozen=True)
class Person:
    """What the touches of one person share."""

    depth_mm: float  # of a press
    radius_mm: float  # of a fingertip
    tempo: float  # factor of all durations
    grip_mm: float  # from the middle of a twist to a finger
    turn_deg: float  # of a twist
    fingers: int  # of a twist
    yaw_deg: float  # of the hand
    friction: dict[str, float]  # limit of each law

    @classmethod
    def draw(cls, rng: Rng) -> "Person":
        """Draw a person."""
        return cls(
            rng.uniform(6.0, 10.5),
            rng.uniform(6.0, 8.5),
            float(np.exp(rng.normal(0.0, 0.2))),
            rng.uniform(15.0, 20.0),
            rng.uniform(38.0, 65.0),
            int(rng.integers(3, 6)),
            rng.uniform(-180.0, 180.0),
            {LAWS[0]: rng.uniform(0.25, 0.5), LAWS[1]: rng.uniform(2500.0, 5000.0)},
        )

    def event(self, label: str, law: str, rng: Rng) -> Event:
        """Draw a touch of this person."""
        land_s, lift_s = self.tempo * rng.uniform(0.10, 0.18, 2)
        shape = {"press": self._press, "pinch": self._pinch}.get(label, self._twist)
        move_s, hold_s, depth, reach, angle, middle = shape(label, rng)
        fingers = len(depth)
        late = np.minimum(np.abs(rng.normal(0.0, 0.02, (2, fingers))), 0.04) * (fingers > 1)
        late[0] -= late[0].min()
        keys = np.zeros((fingers, 4, KEYS))
        spans = [0.0, land_s, self.tempo * move_s, self.tempo * hold_s, lift_s]
        keys[:, 0] = np.cumsum(spans)
        keys[:, 0, :2] += late[0][:, None]
        keys[:, 0, 3:] -= late[1][:, None] - late[1].max()
        keys[:, 1, 1:4] = depth[:, None]
        keys[:, 2], keys[:, 3] = reach, angle
        return Event(label, law, self.friction[law], middle, self.radius_mm, np.round(keys, 4))

    def _press(self, label: str, rng: Rng) -> tuple[float, float, Array, Array, Array, complex]:
        depth = np.array([self.depth_mm * float(np.exp(rng.normal(0.0, 0.1)))])
        hold_s = float(np.exp(rng.uniform(np.log(0.08), np.log(0.6))))
        middle = complex(*rng.uniform(-_PLACE_MM, _PLACE_MM, 2))
        return 0.02, hold_s, depth, np.zeros((1, KEYS)), np.zeros((1, KEYS)), middle

    def _pinch(self, label: str, rng: Rng) -> tuple[float, float, Array, Array, Array, complex]:
        fingers = 2 + int(rng.random() < 0.2)
        depth = 0.65 * self.depth_mm * np.exp(rng.normal(0.0, 0.08, fingers))
        begin = self.grip_mm * np.exp(rng.normal(0.0, 0.04, fingers))
        end = np.maximum(begin * rng.uniform(0.42, 0.58), self.radius_mm + 1.0)
        reach = np.stack([begin, begin, end, end, end], axis=1)
        stand = np.radians(self.yaw_deg + rng.normal(0.0, 12.0))
        angle = stand + np.array([0.0, np.pi, np.pi + np.radians(40.0 * rng.choice([-1, 1]))])
        move_s, hold_s = rng.uniform(0.25, 0.5), rng.uniform(0.08, 0.3)
        angles = np.repeat(angle[:fingers, None], KEYS, axis=1)
        return move_s, hold_s, depth, reach, angles, complex(*rng.normal(0.0, 2.0, 2))

    def _twist(self, label: str, rng: Rng) -> tuple[float, float, Array, Array, Array, complex]:
        fingers = self.fingers
        depth = 0.58 * self.depth_mm * np.exp(rng.normal(0.0, 0.1, fingers))
        reach = self.grip_mm * np.exp(rng.normal(0.0, 0.05, fingers))
        fan = np.radians(rng.uniform(28.0, 36.0))
        stand = np.append(np.pi, fan * (np.arange(fingers - 1) - (fingers - 2) / 2))
        sign = 1.0 if label == "twist_ccw" else -1.0
        turn = sign * np.radians(self.turn_deg) * np.exp(rng.normal(0.0, 0.1))
        yaw = np.radians(self.yaw_deg + rng.normal(0.0, 10.0)) - turn * rng.uniform(0.2, 0.5)
        begin = yaw + stand + np.radians(rng.normal(0.0, 4.0, fingers))
        end = begin + turn * (1.0 + rng.normal(0.0, 0.05, fingers))
        angle = np.stack([begin, begin, end, end, end], axis=1)
        move_s, hold_s = rng.uniform(0.4, 0.8), rng.uniform(0.04, 0.2)
        middle = complex(*rng.normal(0.0, 1.5, 2))
        return move_s, hold_s, depth, np.repeat(reach[:, None], KEYS, axis=1), angle, middle


@dataclass(frozen=True)
class Solved:
    """A touch and its solution.

    Attributes:
        event: The touch as it was meant.
        log_c: ln C / C0 of every taxel at 40 frames a second, float16 (frames, 25).
        redrawn: How many draws had no equilibrium before.
    """

    event: Event
    log_c: NDArray[np.float16]
    redrawn: int = 0


def reference_dome() -> RubbedDome:
    """Return the dome that all events are solved on."""
    return RubbedDome(RINGS, VOLUME, RESERVOIR)


def solve(number: int, dome: RubbedDome, seed: int = SEED) -> Solved:
    """Draw and solve an event of a seed; numbers are those of the set.

    Raises:
        ArithmeticError: None of 20 draws has an equilibrium.
    """
    label = [label for label, count in COUNTS.items() for _ in range(count)][number]
    for redrawn in range(20):
        rng = np.random.default_rng([seed, number, redrawn])
        event = Person.draw(rng).event(label, LAWS[number % len(LAWS)], rng)
        try:
            return Solved(event, event.solve(dome), redrawn)
        except ArithmeticError:
            continue
    raise ArithmeticError(f"event {number} has no equilibrium in 20 draws")


def write(file: Path, touches: Sequence[Solved]) -> None:
    """Write touches to a file."""
    events = [one.event for one in touches]
    keys = np.full((len(events), FINGERS, 4, KEYS), np.nan, dtype=np.float32)
    for row, event in zip(keys, events, strict=True):
        row[: len(event.keys)] = event.keys
    np.savez_compressed(
        file,
        label=np.array([event.label for event in events]),
        law=np.array([event.law for event in events]),
        limit=np.array([event.limit for event in events]),
        middle=np.array([event.middle for event in events]),
        radius_mm=np.array([event.radius_mm for event in events]),
        keys=keys,
        onset_s=np.array([event.onset_s for event in events]),
        release_s=np.array([event.end_s for event in events]),
        redrawn=np.array([one.redrawn for one in touches], dtype=np.int8),
        frames=np.array([len(one.log_c) for one in touches], dtype=np.int16),
        log_c=np.concatenate([one.log_c for one in touches]),
    )


def read(file: Path = FILE) -> list[Solved]:
    """Read the touches of a file."""
    with np.load(file) as stored:
        columns = {name: stored[name] for name in stored.files}
    tracks = np.split(columns["log_c"], np.cumsum(columns["frames"], dtype=np.int64)[:-1])
    touches = []
    for i, log_c in enumerate(tracks):
        keys = columns["keys"][i].astype(np.float64)
        event = Event(
            str(columns["label"][i]),
            str(columns["law"][i]),
            float(columns["limit"][i]),
            complex(columns["middle"][i]),
            float(columns["radius_mm"][i]),
            keys[np.isfinite(keys[:, 0, 0])],
        )
        touches.append(Solved(event, log_c, int(columns["redrawn"][i])))
    return touches


def main() -> None:
    """Solve all events and write them."""
    dome = reference_dome()
    write(Path(sys.argv[1]), [solve(number, dome) for number in range(sum(COUNTS.values()))])


if __name__ == "__main__":
    main()
