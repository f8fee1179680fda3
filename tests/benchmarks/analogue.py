"""Errors of the estimated contact in each frame: place, depth, number of fingers, twist angle.

    python -m tests.benchmarks.analogue [--bundle FILE] [--orbs N] [--seed N] [--solver] [--json]

On orbs with another physics, a hand of its own code aims with one finger (it lands, waits, slides,
waits, deepens), lays two fingers down at any distance, and twists with a thumb and two or three
fingers. Errors are absolute, each axis, of the same frame's truth (lag 0). Beside them are a
centroid of the taxels and a power of their sum, both calibrated on the same orb's other touches,
which the network is not, and the Cramér-Rao bound of the newest frame alone: what noise permits
with a model that is exactly the dome. `--solver` adds the frozen presses of the independent solver,
and the same presses in the own contact model.
"""

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import NoGestures
from controller.recognition.contact import ContactEstimate
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Pipeline
from controller.shared.aliases import Array, Frames
from controller.simulator.hand.performance import SLOTS
from controller.simulator.orb import PRESETS, OrbModel, OrbSimulator, vary
from tests.reference.touches import read

from . import reference
from .results import Results, command_line, say
from .unruly_hands import Finger

DOMAIN: Final = 14  # a family of seeds of its own
LEAD_S, PAUSE_S = 3.0, (0.4, 0.8)
PITCH_MM: Final = 10.0
EACH: Final = {"aim": 12, "two": 16, "twist": 8}  # touches on an orb
SETTLED_S: Final = 0.25  # after a landing or a movement a finger is held still
APART_MM: Final = ((8.0, 15.0), (15.0, 25.0), (25.0, 40.0))
GOALS: Final = {
    "nominal": {"place still": 0.8, "place moving": 0.8, "depth": 0.6, "angle": 8.0},
    "paper-snr": {"place still": 1.5, "place moving": 3.0, "depth": 1.5, "angle": 8.0},
}
STEP_MM: Final = 0.5  # of the derivatives for the bound

Rng = np.random.Generator


def aim(rng: Rng) -> list[Finger]:
    """Return a finger that lands, waits, slides, waits and deepens."""
    begin, way = complex(*rng.uniform(-20, 20, 2)), rng.uniform(5, 25)
    end = begin + way * np.exp(1j * rng.uniform(0, 2 * math.pi))
    end = complex(min(max(end.real, -22), 22), min(max(end.imag, -22), 22))
    spans = (rng.uniform(0.05, 0.15), 0.4, rng.uniform(0.2, 0.6), 0.4, 0.15, 0.3, 0.12)
    depth = rng.uniform(3.0, 8.0)
    deeper = depth + rng.uniform(2.0, 4.0)
    keys = np.concatenate([[0.0], np.cumsum(spans)]).tolist()
    depths = (0.0, depth, depth, depth, depth, deeper, deeper, 0.0)
    points = (begin, begin, begin, end, end, end, end, end)
    return [Finger(keys, depths, points, rng.uniform(5.0, 9.0))]


def two(rng: Rng) -> list[Finger]:
    """Return two fingers at any distance."""
    apart, turn = rng.uniform(*(APART_MM[0][0], APART_MM[-1][1])), rng.uniform(0, 2 * math.pi)
    middle = complex(*rng.uniform(-8, 8, 2))
    depth, radius = rng.uniform(4.0, 9.0), rng.uniform(5.0, 8.0)
    found = []
    for sign in (-0.5, 0.5):
        at = middle + sign * apart * np.exp(1j * turn)
        own, later = depth * rng.uniform(0.85, 1.15), rng.uniform(0.0, 0.04)
        keys = (later, later + 0.1, 0.7, 0.85)
        found.append(Finger(keys, (0.0, own, own, 0.0), (at,) * 4, radius))
    return found


def twist(rng: Rng) -> list[Finger]:
    """Return a thumb and two or three fingers that turn by 25 to 65 degrees."""
    reach, middle = rng.uniform(15.0, 20.0), complex(*rng.uniform(-4, 4, 2))
    angle = math.radians(rng.uniform(25, 65)) * rng.choice([-1.0, 1.0])
    count, begin = int(rng.integers(2, 4)), rng.uniform(0, 2 * math.pi)
    fan = math.radians(rng.uniform(25, 40)) * (np.arange(count) - (count - 1) / 2)
    depth, radius = rng.uniform(5.0, 9.0), rng.uniform(5.0, 8.0)
    turn_s, found = rng.uniform(0.25, 0.6), []
    for place in [0.0, *(math.pi + fan)]:
        later = rng.uniform(0.0, 0.04)
        keys = [later, later + 0.1, 0.3]
        points = [middle + reach * np.exp(1j * (begin + place))] * 3
        for share in (0.25, 0.5, 0.75, 1.0):  # an arc
            keys.append(0.3 + share * turn_s)
            points.append(middle + reach * np.exp(1j * (begin + place + share * angle)))
        keys += [keys[-1] + 0.3, keys[-1] + 0.42]
        points += [points[-1]] * 2
        own = depth * rng.uniform(0.85, 1.15)
        found.append(Finger(keys, [0.0, *([own] * (len(keys) - 2)), 0.0], points, radius))
    return found


HANDS: Final = {"aim": aim, "two": two, "twist": twist}


class Session:
    """Touches on one orb: frames, and the truth beside them."""

    def __init__(self, model: OrbModel, rate_hz: float, rng: Rng) -> None:
        """Draw and simulate them."""
        self.kinds = rng.permutation([name for name, n in EACH.items() for _ in range(n)]).tolist()
        self.hands = [HANDS[kind](rng) for kind in self.kinds]
        self.begins, now = [], LEAD_S
        for fingers in self.hands:
            self.begins.append(now)
            now += max(finger.t_s[-1] for finger in fingers) + rng.uniform(*PAUSE_S)
        self.orb = OrbSimulator(
            np.random.SeedSequence(int(rng.integers(2**32))), rate_hz, SLOTS, model
        )
        each = self.orb.steps_per_frame
        steps = int(now * rate_hz) * each
        time_s = np.asarray(np.arange(1, steps + 1) * self.orb.step_s, dtype=np.float64)
        point = np.zeros((steps, SLOTS), dtype=np.complex128)
        depth, radius = np.zeros(point.shape), np.full(point.shape, 7.0)
        for fingers, begin in zip(self.hands, self.begins, strict=True):
            for slot, finger in enumerate(fingers):
                part = slice(*np.searchsorted(time_s, (begin, begin + finger.t_s[-1])).tolist())
                point[part, slot], depth[part, slot] = finger.track(time_s[part] - begin)
                radius[part, slot] = finger.radius_mm
        self.frames: Frames = self.orb.advance(point, depth, radius)
        kept = slice(each - 1, None, each)
        self.time_s, self.point, self.depth = time_s[kept], point[kept], depth[kept]

    def numbers(self, kind: str) -> list[int]:
        """Return which touches are of a kind."""
        return [number for number, own in enumerate(self.kinds) if own == kind]

    def rows(self, number: int, begin_s: float, end_s: float) -> Array:
        """Return the frames of a touch from one time after its begin to another."""
        at = self.begins[number]
        found = np.flatnonzero((self.time_s >= at + begin_s) & (self.time_s < at + end_s))
        return np.asarray(found)


def estimated(loaded: Bundle, frames: Frames) -> list[ContactEstimate | None]:
    """Return what the device's pipeline says of each frame."""
    pipeline = Pipeline(loaded.settings, NoGestures(len(loaded.labels)), Mapping())
    return [pipeline.step(frame, n / loaded.rate_hz).contact for n, frame in enumerate(frames, 1)]


def measure(loaded: Bundle, session: Session) -> Iterator[tuple[str, float]]:
    """Yield names and errors of the frames of a session: mm, degrees, or 1 for what is right."""
    found = estimated(loaded, session.frames)
    offset = complex((loaded.columns - 1) / 2, (loaded.rows - 1) / 2)
    rivals, known = Rivals(session, offset), session.numbers("aim")[::2]
    factor = calibrated(session, found, known)
    for number, (kind, fingers) in enumerate(zip(session.kinds, session.hands, strict=True)):
        keys = fingers[0].t_s
        if kind == "aim":
            parts = {
                ("still", keys[1] + SETTLED_S): keys[2],
                ("still", keys[3] + SETTLED_S): keys[4],
            }
            for (how, begin_s), end_s in {**parts, ("moving", keys[2]): keys[3]}.items():
                for at in session.rows(number, begin_s, end_s):
                    true = session.point[at, 0] / PITCH_MM + offset
                    yield from _place(how, found[at], true, session.depth[at, 0])
                    if (one := found[at]) is not None and number not in known:
                        yield "depth@calibrated", abs(factor * one.depth_mm - session.depth[at, 0])
                    yield from rivals.place(how, at, true, session.depth[at, 0])
        elif kind == "two":
            apart = abs(fingers[0].point[0] - fingers[1].point[0])
            (name,) = (f"two apart {a:.0f}-{b:.0f} mm" for a, b in APART_MM if a <= apart <= b)
            for at in session.rows(number, 0.3, 0.65):
                one = found[at]
                yield name, float(one is not None and one.fingers > 1)
        else:
            turned = math.degrees(float(np.angle(_turn(fingers))))
            for at in session.rows(number, keys[-2] - 0.2, keys[-2]):
                one = found[at]
                yield "angle", abs(turned - (one.angle_deg if one is not None else 0.0))


def calibrated(session: Session, found: list[ContactEstimate | None], known: list[int]) -> float:
    """Return the factor of estimated depths, by the known aiming touches where they are held."""
    shares = []
    for number in known:
        keys = session.hands[number][0].t_s
        at = session.rows(number, keys[1] + SETTLED_S, keys[2])
        shares += [session.depth[n, 0] / one.depth_mm for n in at if (one := found[n]) is not None]
    return float(np.median(shares))


def _turn(fingers: list[Finger]) -> complex:
    """Return by what the fingers of a twist turned, of length 1."""
    begin = np.array([finger.point[0] for finger in fingers])
    end = np.array([finger.point[-1] for finger in fingers])
    turn = ((end - end.mean()) * np.conj(begin - begin.mean())).sum()
    return complex(turn / abs(turn))


def _place(
    how: str, one: ContactEstimate | None, true: complex, depth_mm: float
) -> Iterator[tuple[str, float]]:
    """Yield the errors of an estimate of one finger, one that is missing as the grid's half."""
    yield "felt", float(one is not None)
    if one is None:
        return
    for error in (one.x - true.real, one.y - true.imag):
        yield f"place {how}", PITCH_MM * abs(error)
    yield "depth", abs(one.depth_mm - depth_mm)
    yield "one finger", float(one.fingers == 1)


class Rivals:
    """Centroid of the taxels and power of their sum, each calibrated on the same orb's touches."""

    def __init__(self, session: Session, offset: complex) -> None:
        """Fit place and depth to every other aiming touch; the rest is for judging."""
        lead = int(LEAD_S / (session.time_s[1] - session.time_s[0])) - 10
        z = session.frames / session.frames[20:lead].mean(axis=0) - 1.0
        weight = np.clip(np.median(z, axis=(1, 2), keepdims=True) - z, 1e-6, None)
        rows, columns = z.shape[1:]
        x = (weight.sum(axis=1) @ np.arange(columns)) / weight.sum(axis=(1, 2))
        y = (weight.sum(axis=2) @ np.arange(rows)[::-1]) / weight.sum(axis=(1, 2))
        total = np.log(np.clip(-z.sum(axis=(1, 2)), 1e-3, None))
        own = session.numbers("aim")[::2]
        at = np.concatenate([session.rows(n, 0.15, session.hands[n][0].t_s[4]) for n in own])
        true = session.point[at, 0] / PITCH_MM + offset
        self._x = np.polynomial.Polynomial.fit(x[at], true.real, 3)(x)
        self._y = np.polynomial.Polynomial.fit(y[at], true.imag, 3)(y)
        log_mm = np.polynomial.Polynomial.fit(total[at], np.log(session.depth[at, 0]), 1)(total)
        self._depth = np.exp(log_mm)

    def place(
        self, how: str, at: int, true: complex, depth_mm: float
    ) -> Iterator[tuple[str, float]]:
        """Yield their errors in a frame."""
        yield f"place {how}@centroid", PITCH_MM * abs(self._x[at] - true.real)
        yield f"place {how}@centroid", PITCH_MM * abs(self._y[at] - true.imag)
        yield "depth@sum", abs(self._depth[at] - depth_mm)


def bound(model: OrbModel, rate_hz: float, rng: Rng) -> Iterator[tuple[str, float]]:
    """Yield the median errors that noise permits in one frame of a finger at a random place."""
    circuit = model.electronics
    readout = replace(circuit.readout, noise_lsb=0.0)
    silent = replace(model, electronics=replace(circuit, readout=readout))
    seed = int(rng.integers(2**32))
    frames = int(0.8 * rate_hz)

    def scan(one: OrbModel, point: complex, depth_mm: float) -> Array:
        orb = OrbSimulator(np.random.SeedSequence(seed), rate_hz, 1, one)
        steps = frames * orb.steps_per_frame
        there = np.where(np.arange(steps) > steps // 2, depth_mm, 0.0)[:, None]
        made = orb.advance(np.full((steps, 1), point), there, np.full((steps, 1), 7.0))
        return np.asarray(made, dtype=np.float64)

    at, depth_mm = complex(*rng.uniform(-20, 20, 2)), rng.uniform(3.0, 8.0)
    rest = scan(silent, at, 0.0)[-1]
    noise = scan(model, at, 0.0)[frames // 4 :] / rest
    steps = [(STEP_MM, 0.0), (1j * STEP_MM, 0.0), (0.0, STEP_MM)]
    slopes = [
        (scan(silent, at + dp, depth_mm + dd)[-1] - scan(silent, at - dp, depth_mm - dd)[-1])
        / (2 * STEP_MM * rest)
        for dp, dd in steps
    ]
    slope = np.array(slopes).reshape(3, -1)
    variance = noise.var(axis=0).ravel()
    least = 0.6745 * np.sqrt(np.diag(np.linalg.inv((slope / variance) @ slope.T)))
    yield "place still@bound", float(least[0])
    yield "place still@bound", float(least[1])
    yield "depth@bound", float(least[2])


def solved(loaded: Bundle, name: str, seed: int) -> Iterator[tuple[str, float]]:
    """Yield the errors of the independent solver's presses, held still, at their place."""
    presses = [touch for touch in read() if touch.event.label == "press"]
    offset = complex((loaded.columns - 1) / 2, (loaded.rows - 1) / 2)
    for start in range(0, len(presses), reference.PER_ORB):
        some = presses[start : start + reference.PER_ORB]
        for physics in reference.PHYSICS:
            frames, begins = reference.session(some, physics, name, (seed, start), loaded.rate_hz)
            found = estimated(loaded, frames)
            for touch, begin in zip(some, begins, strict=True):
                event = touch.event
                at_s = 0.5 * (event.onset_s + event.end_s)
                one = found[int((begin + at_s) * loaded.rate_hz) - 1]
                point, depth = event.tracks(np.array([at_s]))
                true = complex(point[0, 0]) / PITCH_MM + offset
                for row, value in _place("still", one, true, float(depth[0, 0])):
                    yield f"{row} ({physics})", value


def main() -> None:
    """Print the rows of both presets."""
    parser = command_line(__doc__, bundle=bundles.default_path(), orbs=20, seed=0, solver=False)
    options, results = parser.parse_args(), Results("analogue")
    loaded = bundles.read(options.bundle)
    if loaded.contacts is None:
        parser.error(f"{options.bundle} does not estimate what touches; name one that does")
    for name, model in PRESETS.items():
        errors: defaultdict[str, list[float]] = defaultdict(list)
        for number in range(options.orbs):
            rng = np.random.default_rng([DOMAIN, options.seed, number])
            orb = vary(model, rng)
            for row, value in measure(loaded, Session(orb, loaded.rate_hz, rng)):
                errors[row].append(value)
            for row, value in bound(orb, loaded.rate_hz, rng):
                errors[row].append(value)
            say(f"{name}: orb {number + 1} of {options.orbs}")
        if options.solver:
            for row, value in solved(loaded, name, options.seed):
                errors[row].append(value)
        for row, values in sorted(errors.items()):
            share = row.startswith(("felt", "two", "one"))
            typical = float(np.mean(values) if share else np.median(values))
            unit = "1" if share else "degrees" if row == "angle" else "mm"
            results.note(row, typical, unit, preset=name, goal=GOALS[name].get(row))
    results.finish(options.json, bundle=str(options.bundle))


if __name__ == "__main__":
    main()
