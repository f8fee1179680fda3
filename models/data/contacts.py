"""Simulated touches of every width, one after another on orbs whose physics varies.

They teach how wide a touch is (`controller.recognition.contact_radius`): from fingertips to elbows
without a gap, light and deep, quick and slow, still, sliding and trembling; and several fingers at
once, as of two hands or one that rests, whose width is that of the circle around all of them.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.contact_radius import features
from controller.recognition.images.dead_taxels import TaxelInterpolator
from controller.shared.aliases import Array, Complex
from controller.simulator.dome.faults import Fault
from controller.simulator.hand.gesture import min_jerk
from controller.simulator.orb import NOMINAL, PRESETS, OrbModel, OrbSimulator, vary

RADIUS_MM: Final = (4.5, 26.0)
DEPTH_MM: Final = (0.5, 12.5)
_FINGER_MM: Final = (4.5, 9.0)
_CONTACTS: Final = 80  # tag of the seeds
_SESSION_S: Final = 75.0
_LEAD_S: Final = 1.0  # untouched, for the rest image
_BEFORE_S: Final = 0.15  # untouched, before each touch
_NOTICED_S: Final = 0.05  # images of a touch begin so long before it at most
_WATCHED_S: Final = 0.375  # of a touch, at most
_DOWN_S, _HOLD_S, _UP_S, _PAUSE_S = (0.04, 0.2), (0.0, 0.35), (0.05, 0.18), (0.3, 0.6)
_QUICK, _QUICK_S = 0.3, (0.02, 0.15)  # share of touches that soon follow another, and the pause
_RISING_S: Final = 0.09  # after a touch, in which its finger rises: no image before the next
_TWO, _MORE = 0.17, 0.18  # shares of touches of two fingers, and of more
_LYING, _LYING_MM = 0.12, (7.0, 12.5)  # share of touches beside a thumb that lies, and its radius
_LIES_S: Final = (0.4, 0.3, 0.3)  # it comes down, lies before the touch, leaves after it
_APART_MM: Final = (16.0, 40.0)  # two fingers, and those of a hand
_LATER_S: Final = 0.1  # until the last of several has landed
_MOST: Final = 5  # fingers
_FELT_MM: Final = 0.3  # shallower contacts are none
_AWAY: Final = 2.2  # grid units from the middle, each way
_RIM: Final = 0.82  # of half the dome: no finger goes farther
_SLIDING, _TREMBLING = 0.25, 0.1  # shares
_INFLATION: Final = 0.05
_NOISY: Final = 0.5  # share of orbs that are noisier than `nominal`
_DEAD, _LEAKY = 0.02, 0.03  # shares of taxels: more than usual, to learn from
_KNOWN: Final = 0.5  # share of orbs whose dead taxels are known, and interpolated


@dataclass(frozen=True, slots=True)
class _Finger:
    """One of the contacts of a touch."""

    begin_s: float  # after the first
    spans_s: tuple[float, float, float]  # down, held, up
    depth_mm: float
    place: complex  # mm from the middle
    way: complex  # that it slides, mm
    radius_mm: float
    tremble: float  # amplitude of its depth, a share

    @property
    def end_s(self) -> float:
        """When it has left."""
        return self.begin_s + sum(self.spans_s)

    def path(self, time_s: Array, rim_mm: float) -> tuple[Complex, Array]:
        """Return place and depth at times after the touch began, (n,) each, within the rim."""
        (down_s, hold_s, up_s), time_s = self.spans_s, time_s - self.begin_s
        deep = min_jerk(time_s / down_s) - min_jerk((time_s - down_s - hold_s) / up_s)
        deep *= 1.0 + self.tremble * np.sin(2 * math.pi * 6.0 * time_s)
        point = self.place + self.way * min_jerk((time_s - 0.7 * down_s) / (hold_s + up_s))
        point = point * np.minimum(1.0, rim_mm / np.maximum(np.abs(point), 1e-9))
        return point.astype(np.complex128), self.depth_mm * np.maximum(deep, 0.0)


@dataclass(frozen=True, slots=True)
class Contacts:
    """Images of touches, as features, and what they are to be."""

    inputs: NDArray[np.float16]  # features of each image, (n, features)
    log_radius: NDArray[np.float32]  # of the circle around all contacts in it, ln mm, (n,)
    touch: NDArray[np.int64]  # number of its touch, (n,)


def simulate(model: OrbModel, rate_hz: float, seed: int, orbs: int) -> Contacts:
    """Return the images of touches on so many orbs, some 85 touches each."""
    inputs: list[NDArray[np.float16]] = []
    radii: list[Array] = []
    for number in range(orbs):
        rng = np.random.default_rng([_CONTACTS, seed, number])
        touches, own, idle = session(varied_orb(model, rng), rate_hz, rng)
        inputs += [features(touch, idle).astype(np.float16) for touch in touches]
        radii += [radius[1:] for radius in own]
    count = np.repeat(np.arange(len(inputs)), [len(one) for one in inputs])
    return Contacts(np.concatenate(inputs), np.log(np.concatenate(radii)).astype("f4"), count)


def session(
    model: OrbModel, rate_hz: float, rng: np.random.Generator
) -> tuple[list[Array], list[Array], float]:
    """Return the touches of one orb, their radii, and the noise of its untouched images.

    A touch is z - 1 of its images, (n, rows, columns), without what was there before; radii are
    those of the circle around all contacts in each image, mm, (n,).
    """
    whole = replace(model, electronics=replace(model.electronics, dead=0.0))
    orb = OrbSimulator(np.random.SeedSequence(rng.integers(2**32)), rate_hz, _MOST + 1, whole)
    step_hz = rate_hz * orb.steps_per_frame
    steps = round(_SESSION_S * rate_hz) * orb.steps_per_frame
    slots = _MOST + 1  # the last one for what lies
    point, depth = np.zeros((steps, slots), dtype=np.complex128), np.zeros((steps, slots))
    radius = np.full((steps, slots), RADIUS_MM[0])
    rim_mm = _RIM * model.pitch_mm * max(model.rows, model.columns)
    at_s, found = _LEAD_S, []
    while at_s < _SESSION_S - 2.0:
        fingers = _fingers(model.pitch_mm, rng)
        lasts_s = max(finger.end_s for finger in fingers)
        lying = _lying(fingers[0].place, lasts_s, model.pitch_mm, rng)
        if lying is not None:
            at_s -= lying.begin_s
        there = [*enumerate(fingers), *([] if lying is None else [(_MOST, lying)])]
        for slot, finger in there:
            begin_s, end_s = at_s + min(0.0, finger.begin_s), at_s + finger.end_s
            part = slice(round(begin_s * step_hz), round(end_s * step_hz) + 1)
            time_s = np.arange(part.start, part.stop) / step_hz - at_s
            point[part, slot], depth[part, slot] = finger.path(time_s, rim_mm)
            radius[part, slot] = finger.radius_mm
        found.append((at_s, lasts_s))
        end_s = max(finger.end_s for _, finger in there)
        at_s += end_s + rng.uniform(*(_QUICK_S if rng.random() < _QUICK else _PAUSE_S))
    dead = rng.random((model.rows, model.columns)) < model.electronics.dead
    orb.electronics.switch(Fault("dead", *place) for place in np.argwhere(dead).tolist())
    frames = orb.advance(point, depth, radius)
    lead, before = round(_LEAD_S * rate_hz), max(1, round(_BEFORE_S * rate_hz))
    change = frames / frames[lead // 4 : lead - 1].mean(axis=0) - 1.0
    idle = float(np.abs(change[lead // 4 : lead - 1]).mean())
    if dead.any() and rng.random() < _KNOWN:
        stage = TaxelInterpolator(model.rows, model.columns)
        change = np.array([stage.fill(one, dead) for one in change])
    each = slice(orb.steps_per_frame - 1, None, orb.steps_per_frame)
    own_radius = np.where(depth[each] > _FELT_MM, radius[each], np.nan)[:, :_MOST]
    circles = _circles(point[each, :_MOST], own_radius)
    touches, radii, most = [], [], max(2, round(_WATCHED_S * rate_hz))
    for (begin_s, lasts_s), over_s in zip(found, [0.0, *map(sum, found)], strict=False):
        first = int(begin_s * rate_hz) - int(rng.integers(round(_NOTICED_S * rate_hz) + 1))
        own = slice(first, first + min(most, max(2, math.ceil(lasts_s * rate_hz))))
        known = np.isfinite(circles[own])
        if known.any():
            untouched = change[
                max(first - before, math.ceil((over_s + _RISING_S) * rate_hz)) : first
            ]
            left = untouched.mean(axis=0) if len(untouched) else 0.0
            touches.append(change[own].astype(np.float64) - left)
            radii.append(np.where(known, circles[own], np.median(circles[own][known])))
    return touches, radii, idle


def _fingers(pitch_mm: float, rng: np.random.Generator) -> list[_Finger]:
    """Return the contacts of a touch: one of any width, or several fingers."""
    kind, middle = rng.random(), pitch_mm * complex(*rng.uniform(-_AWAY, _AWAY, 2))
    if kind >= _TWO + _MORE:
        wide = math.exp(rng.uniform(*np.log(RADIUS_MM)))
        return [_finger(0.0, middle, rng.uniform(*DEPTH_MM), wide, pitch_mm, rng)]
    wide, depth_mm = rng.uniform(*_FINGER_MM), rng.uniform(*DEPTH_MM)
    apart, angle = rng.uniform(*_APART_MM) / 2, rng.uniform(0.0, 2 * math.pi)
    count = 2 if kind < _TWO else int(rng.integers(3, _MOST + 1))
    turns = angle + np.arange(count) * (math.pi if count == 2 else math.radians(35.0))
    if count > 2 and rng.random() < 0.5:
        turns[0] = turns[-1] + math.pi  # a thumb
    found = []
    for turn in turns.tolist():
        place = middle * 0.5 + apart * complex(math.cos(turn), math.sin(turn))
        later_s, deep = rng.uniform(0.0, _LATER_S), depth_mm * math.exp(rng.normal(0.0, 0.2))
        found.append(_finger(later_s, place, min(deep, DEPTH_MM[1]), wide, pitch_mm, rng))
    return found


def _lying(
    place: complex, lasts_s: float, pitch_mm: float, rng: np.random.Generator
) -> _Finger | None:
    """Return a thumb that lies there before a touch at a place and stays; mostly None."""
    if rng.random() >= _LYING:
        return None
    down_s, before_s, up_s = _LIES_S
    turn, away = rng.uniform(0.0, 2 * math.pi), rng.uniform(*_APART_MM)
    where = place + away * complex(math.cos(turn), math.sin(turn))
    spans = (down_s, before_s + lasts_s, up_s)
    depth, wide = rng.uniform(DEPTH_MM[0], DEPTH_MM[1] / 2), rng.uniform(*_LYING_MM)
    return _Finger(-down_s - before_s, spans, depth, where, 0j, wide, 0.0)


def _finger(
    begin_s: float,
    place: complex,
    depth_mm: float,
    radius_mm: float,
    pitch_mm: float,
    rng: np.random.Generator,
) -> _Finger:
    """Return a contact that perhaps slides or trembles."""
    down_s, hold_s, up_s = (rng.uniform(*each) for each in (_DOWN_S, _HOLD_S, _UP_S))
    sliding, trembling = rng.random() < _SLIDING, rng.random() < _TREMBLING
    way = 0.8 * pitch_mm * complex(*rng.normal(0.0, 1.0, 2)) if sliding else 0j
    tremble = rng.uniform(0.0, 0.6) if trembling else 0.0
    return _Finger(begin_s, (down_s, hold_s, up_s), depth_mm, place, way, radius_mm, tremble)


def _circles(point: Complex, radius: Array) -> Array:
    """Return the radius of the circle around all contacts, (n,), NaN where there are none.

    Places and radii are (n, contacts), the radius NaN where a contact is none.
    """
    there = np.isfinite(radius)
    count = np.maximum(there.sum(axis=1), 1)
    middle = np.where(there, point, 0.0).sum(axis=1) / count
    reach = np.abs(point - middle[:, None]) + np.where(there, radius, -np.inf)
    return np.where(there.any(axis=1), reach.max(axis=1), np.nan)


def varied_orb(model: OrbModel, rng: np.random.Generator) -> OrbModel:
    """Return an orb of another physics and noise."""
    made = vary(model, rng)
    fuller = float(np.exp(rng.normal(0.0, _INFLATION)))
    stretch = 1.0 + (made.mechanics.apex_stretch - 1.0) * fuller
    circuit = made.electronics
    quiet, noisy = (one.electronics.readout.noise_lsb for one in (NOMINAL, PRESETS["paper-snr"]))
    louder = rng.uniform() if rng.random() < _NOISY else 0.0
    readout = replace(circuit.readout, noise_lsb=quiet * (noisy / quiet) ** louder)
    return replace(
        made,
        mechanics=replace(made.mechanics, apex_stretch=stretch),
        electronics=replace(circuit, dead=_DEAD, leaky=_LEAKY, readout=readout),
    )
