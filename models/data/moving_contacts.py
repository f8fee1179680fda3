"""Simulated contacts and gestures, with the truth of every frame.

They teach what touches (`controller.recognition.contact`). Half of them move as they like: one to
five fingers that land anywhere, wander, deepen, part, close and turn, for a tenth of a second or
for seconds. The others are simulated hands at play, with many touches that are no gesture. The
physics and the noise of the orbs vary. The frames of an orb are in order, with the pauses between
touches.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.contact import MOST_FINGERS, SLOW_S, ContactTracker
from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.images.preprocess import Preprocessor
from controller.shared.aliases import Array, Complex
from controller.simulator.dome.faults import Fault
from controller.simulator.hand.gesture import min_jerk
from controller.simulator.hand.user_style import draw_style
from controller.simulator.orb import NOMINAL, PRESETS, OrbModel, OrbSimulator
from controller.simulator.session import simulate as play
from models.data.contacts import varied_orb

UNKNOWN_LABEL: Final = -1  # label of frames in which no gesture is meant
_MOVING: Final = 81  # tag of the seeds
_SESSION_S, _LEAD_S = 75.0, 3.0  # and the untouched time before it, for the rest image
_LASTS_S: Final = (0.12, 1.6)  # of touches
# Share of longer ones, how long, and depth: the rest image would take in what is lighter
_LONG, _LONG_S, _LONG_MM = 0.08, (1.6, 5.0), 4.0
_LAND_S, _LIFT_S, _LYING_S = (0.03, 0.2), (0.05, 0.18), (0.03, 0.8)  # the last: of long touches
# Pauses, those of quick touches and long ones, and the shares of these
_PAUSE_S, _QUICK_S, _QUICK, _IDLE_S, _IDLE = (0.3, 0.8), (0.03, 0.15), 0.3, (0.8, 4.0), 0.06
_LEG_S, _STILL = (0.15, 0.7), 0.4  # of a movement, and the share of pauses
_DEPTH_MM, _DEEPEST_MM = (0.8, 15.0), 19.0  # of the deepest as it lands, and later
_DEEPER: Final = 0.15  # deviation of each finger beside the others
_PRESSED: Final = 0.5  # share of touches that are quickly pressed deeper, for a while
_IN_PLACE: Final = 0.6  # share of those that do not move
_PRESS_MM, _PRESS_S, _PRESSED_S = (1.5, 9.0), (0.05, 0.15), (0.05, 0.4)
_FINGER_MM, _THUMB_MM, _PALM_MM = (4.5, 9.0), (9.0, 12.0), (12.0, 26.0)  # radii
_THUMB, _PALM = 0.15, 0.1  # shares of the latter; a palm is alone
_FINGERS: Final = (0.53, 0.25, 0.09, 0.08, 0.05)  # shares of one to five
_APART_MM: Final = (6.0, 22.0)  # of several, from their middle
# Share of three and more that grip, their distance then, and their middle's, as a share of others'
_GRIPPED, _GRIP_MM, _GRIP_AWAY = 0.6, (13.0, 22.0), (0.0, 1.4)
_FAN_DEG: Final = (18.0, 42.0)  # from finger to finger
_TURN_DEG: Final = 50.0  # deviation of a turn
_MOST_DEG: Final = 110.0
_STEP_MM, _DEEPEN_MM, _PART_MM = 14.0, 4.0, 6.0  # deviations of movements, each way
_AWAY, _RIM = 2.5, 1.3  # grid units from the middle, each way; half sides of the grid
_LATER_S: Final = 0.05  # until the last of several has landed
_FELT_MM: Final = 0.3  # shallower contacts are none
_NONE: Final = 1e-12  # weight of what does not touch
_NOISY, _LOUD = 0.35, (0.6, 1.1)  # share of orbs with so much of the noise of `paper-snr`
_DEAD: Final = 0.02  # share of dead taxels
# Of hands at play: shares of quick and of unruly turns, of pointers, of domes that lose pressure
# (by how much of it a minute), and of orbs with no more broken taxels than usual
_TURNS, _UNRULY, _POINTER = (0.0, 0.5), (0.2, 0.9), 0.12
_LEAKY, _LEAK, _WHOLE = 0.12, (0.05, 0.3), 0.35
_SAID_S, _APART_S = 0.1, 0.075  # a label lasts longer than its touch; until shortly before the next

# Inputs, truth, fingers and labels of one orb, (frames, ...) each
Own = tuple[NDArray[np.float16], NDArray[np.float32], NDArray[np.int8], NDArray[np.int8]]


@dataclass(frozen=True, slots=True)
class MovingContacts:
    """Inputs of the frames of some orbs, in order, and what touches."""

    inputs: NDArray[np.float16]  # of the network, (orbs, frames, inputs)
    # x, y, depth (mm), angle (degrees), rise (mm), (orbs, frames, VALUES)
    truth: NDArray[np.float32]
    fingers: NDArray[np.int8]  # number of contacts, at most `MOST_FINGERS`, (orbs, frames)
    # Index of the label that is true, `UNKNOWN_LABEL`: unknown, (orbs, frames)
    label: NDArray[np.int8]


def simulate(
    model: OrbModel, settings: PreprocessSettings, seed: int, orbs: int, *, gestures: bool
) -> MovingContacts:
    """Return 72 s on each of so many orbs; with `gestures`, a hand plays on every second one.

    Its labels are those of `controller.simulator.session`.
    """
    found = []
    for number in range(orbs):
        rng = np.random.default_rng([_MOVING, seed, number])
        drawn = played if gestures and number % 2 else session
        found.append(drawn(_orb(model, rng), settings, rng))
    return MovingContacts(*(np.stack(part) for part in zip(*found, strict=True)))


def _orb(model: OrbModel, rng: np.random.Generator) -> OrbModel:
    """Return an orb of another physics; many are as noisy as `paper-snr`."""
    made = varied_orb(model, rng)
    if rng.random() >= _NOISY:
        return made
    noisy = PRESETS["paper-snr"].electronics
    noise_lsb = rng.uniform(*_LOUD) * noisy.readout.noise_lsb
    readout = replace(made.electronics.readout, noise_lsb=noise_lsb)
    circuit = replace(made.electronics, taxel_drift=noisy.taxel_drift, readout=readout)
    return replace(made, electronics=circuit)


def session(model: OrbModel, settings: PreprocessSettings, rng: np.random.Generator) -> Own:
    """Return contacts of one orb that move as they like, as in `MovingContacts`."""
    whole = replace(model, electronics=replace(model.electronics, dead=0.0))
    slots, rate_hz = len(_FINGERS), settings.rate_hz
    orb = OrbSimulator(np.random.SeedSequence(rng.integers(2**32)), rate_hz, slots, whole)
    step_hz = rate_hz * orb.steps_per_frame
    steps = round(_SESSION_S * rate_hz) * orb.steps_per_frame
    point, depth = np.zeros((steps, slots), dtype=np.complex128), np.zeros((steps, slots))
    radius, turned = np.full((steps, slots), _FINGER_MM[0]), np.zeros(steps)
    at_s = _LEAD_S
    while at_s < _SESSION_S - _LONG_S[1]:
        long = rng.random() < _LONG
        lasts_s = math.exp(rng.uniform(*np.log(_LONG_S if long else _LASTS_S)))
        time_s = np.arange(round(lasts_s * step_hz) + 1) / step_hz
        part = slice(round(at_s * step_hz), round(at_s * step_hz) + len(time_s))
        count = 1 + int(rng.choice(slots, p=_FINGERS))
        own = _touch(time_s, count, _LONG_MM if long else _DEPTH_MM[0], model, rng)
        point[part, :count], depth[part, :count], turned[part] = own
        radius[part] = _radius(count, rng)
        kind = rng.random()
        pause_s = _QUICK_S if kind < _QUICK else _IDLE_S if kind > 1.0 - _IDLE else _PAUSE_S
        at_s += lasts_s + rng.uniform(*pause_s)
    dead = rng.random((model.rows, model.columns)) < _DEAD * rng.random()
    orb.electronics.switch(Fault("dead", *place) for place in np.argwhere(dead).tolist())
    frames = orb.advance(point, depth, radius)
    each = slice(orb.steps_per_frame - 1, None, orb.steps_per_frame)
    unsaid = np.full(len(frames), UNKNOWN_LABEL, np.int8)
    return _watched(frames, point[each], depth[each], turned[each], unsaid, model, settings)


def played(model: OrbModel, settings: PreprocessSettings, rng: np.random.Generator) -> Own:
    """Return a hand at play on one orb, as in `MovingContacts`."""
    usual, rate_hz = NOMINAL.electronics, settings.rate_hz
    if rng.random() < _WHOLE:
        whole = replace(model.electronics, dead=usual.dead, leaky=usual.leaky)
        model = replace(model, electronics=whole)
    leak = [Fault.parse(f"air_leak={rng.uniform(*_LEAK):.3f}")] if rng.random() < _LEAKY else []
    made = play(
        np.random.SeedSequence(rng.integers(2**32)).spawn(5),
        _SESSION_S / 60,
        style=draw_style(rng),
        pointer=bool(rng.random() < _POINTER),
        rate_hz=rate_hz,
        model=model,
        quick=rng.uniform(*_TURNS),
        unruly=rng.uniform(*_UNRULY),
        faults=leak,
    )
    depth = np.nan_to_num(made.contact[..., 2].astype(np.float64))
    middle = np.array([(model.columns - 1) / 2, (model.rows - 1) / 2])
    x, y = np.moveaxis(np.nan_to_num(made.contact[..., :2] - middle), -1, 0)
    point = (x + 1j * y) * model.pitch_mm
    label = _lasting(made.label, round(_SAID_S * rate_hz), round(_APART_S * rate_hz))
    return _watched(made.frames, point, depth, _turned(point, depth), label, model, settings)


def _turned(point: Complex, depth: Array) -> Array:
    """Return by how much contacts, (n, fingers), have turned since the first landed, degrees."""
    turned = np.zeros(len(point))
    there = depth > _FELT_MM
    for at in range(1, len(point)):
        both = there[at] & there[at - 1]
        if both.any():  # else another touch begins
            before, now = (one - one.mean() for one in (point[at - 1, both], point[at, both]))
            turned[at] = turned[at - 1] + np.degrees(np.angle((now * before.conj()).sum()))
    return turned


def _lasting(label: NDArray[np.int8], longer: int, apart: int) -> NDArray[np.int8]:
    """Return labels, (n,), that last so many frames longer, but end so long before the next."""
    label = label.copy()
    for end in np.flatnonzero((label[:-1] > 0) & (label[1:] == 0)) + 1:
        after = np.flatnonzero(label[end : end + longer + apart])
        free = longer if not len(after) else min(longer, int(after[0]) - apart)
        label[end : end + max(0, free)] = label[end - 1]
    return label


def _radius(count: int, rng: np.random.Generator) -> float:
    """Return the radius of so many contacts, mm."""
    kind = rng.random()
    if kind < _THUMB:
        return float(rng.uniform(*_THUMB_MM))
    if count == 1 and kind < _THUMB + _PALM:
        return float(rng.uniform(*_PALM_MM))
    return float(rng.uniform(*_FINGER_MM))


def _watched(
    frames: NDArray[np.float32],
    point: Complex,
    depth: Array,
    turned: Array,
    label: NDArray[np.int8],
    model: OrbModel,
    settings: PreprocessSettings,
) -> Own:
    """Return what the device sees of frames after the lead, and what is true in each."""
    stage = Preprocessor(settings, model.rows, model.columns)
    tracker = ContactTracker(model.rows, model.columns, settings.rate_hz)
    slow = 1.0 / (SLOW_S * settings.rate_hz + 1)
    inputs, truth, usual, age, felt = [], [], 0.0, 0, depth > _FELT_MM
    for at, frame in enumerate(frames):
        seen, there, deepest = stage.step(frame), felt[at], float(depth[at].max())
        age = age + 1 if there.any() else 0
        usual += (deepest - usual) * max(slow, 1.0 / max(age, 1))
        weights = np.where(there, depth[at], _NONE)
        middle = complex((weights * point[at]).sum() / weights.sum()) / model.pitch_mm
        angle = turned[at] if there.sum() > 1 else 0.0
        x, y = middle.real + (model.columns - 1) / 2, middle.imag + (model.rows - 1) / 2
        inputs.append(tracker.inputs(seen.image, seen.idle))
        truth.append((x, y, deepest, angle, deepest - usual))
    after = round(_LEAD_S * settings.rate_hz)
    return (
        np.array(inputs[after:], dtype=np.float16),
        np.array(truth[after:], dtype=np.float32),
        np.minimum(felt[after:].sum(axis=1), MOST_FINGERS).astype(np.int8),
        label[after:],
    )


def _touch(
    time_s: Array, count: int, least_mm: float, model: OrbModel, rng: np.random.Generator
) -> tuple[Complex, Array, Array]:
    """Return places (mm from the middle) and depths, (n, count), and angle, (n,), of a touch.

    Its deepest finger is at least so deep while it is held.
    """
    rim_mm = _RIM * model.pitch_mm * max(model.rows, model.columns) / 2
    away_mm = _AWAY * model.pitch_mm * (1.0 if count == 1 else 0.4)
    middle = _wander(time_s, rng.uniform(-away_mm, away_mm, 2), _STEP_MM, rng)
    deep = _wander(time_s, rng.uniform(*_DEPTH_MM, 1), _DEEPEN_MM, rng)[:, 0]
    if rng.random() < _PRESSED:
        rise_s, begin_s = rng.uniform(*_PRESS_S), rng.uniform(0.2, 1.0) * time_s[-1]
        back_s = begin_s + rise_s + rng.uniform(*_PRESSED_S)
        pressed = min_jerk((time_s - begin_s) / rise_s) - min_jerk((time_s - back_s) / rise_s)
        deep = deep + rng.uniform(*_PRESS_MM) * pressed
        middle = middle[:1] if rng.random() < _IN_PLACE else middle
    deep = np.clip(deep, least_mm, _DEEPEST_MM)
    gripped = count > 2 and rng.random() < _GRIPPED
    if gripped:
        middle = rng.uniform(*_GRIP_AWAY) * middle
    begin, part_mm = (_GRIP_MM, 1.0) if gripped else (_APART_MM, _PART_MM)
    apart = _wander(time_s, rng.uniform(*begin, 1), part_mm, rng)[:, 0]
    apart = np.clip(apart, *_APART_MM)
    turned = _wander(time_s, np.zeros(1), _TURN_DEG, rng)[:, 0]
    turned = np.clip(turned, -_MOST_DEG, _MOST_DEG)
    fan = rng.uniform(*_FAN_DEG) * (np.arange(count - 1) - (count - 2) / 2)
    around = rng.uniform(0.0, 360.0) + np.concatenate([[0.0], 180.0 + fan])
    around = around + rng.normal(0.0, 5.0, count)
    place = np.broadcast_to(middle[:, 0] + 1j * middle[:, 1], len(time_s))[:, None]
    if count > 1:
        place = place + apart[:, None] * np.exp(1j * np.radians(around + turned[:, None]))
    place = place * np.minimum(1.0, rim_mm / np.maximum(np.abs(place), 1e-9))
    later_s = np.sort(rng.uniform(0.0, _LATER_S, count))
    lasts_s = float(time_s[-1])
    land_s = rng.uniform(*(_LYING_S if lasts_s > _LASTS_S[1] else _LAND_S))
    lift_s = rng.uniform(*_LIFT_S)
    scale = min(1.0, lasts_s / (land_s + lift_s + _LATER_S))
    down = min_jerk((time_s[:, None] - later_s * scale) / (land_s * scale))
    up = min_jerk((lasts_s - time_s[:, None]) / (lift_s * scale))
    each = np.exp(rng.normal(0.0, _DEEPER, count))
    depth = deep[:, None] * np.minimum(down, up) * each / each.max()
    return place.astype(np.complex128), depth, np.where(count > 1, turned, 0.0)


def _wander(time_s: Array, begin: Array, step: float, rng: np.random.Generator) -> Array:
    """Return a smooth course from its beginning, (k,), as (n, k): legs of movement, and pauses."""
    course = np.repeat(begin[None], len(time_s), axis=0)
    at_s = 0.0
    while at_s < time_s[-1]:
        leg_s = rng.uniform(*_LEG_S)
        if rng.random() >= _STILL:
            way = rng.normal(0.0, step, len(begin))
            course = course + way * min_jerk((time_s - at_s) / leg_s)[:, None]
        at_s += leg_s
    return course
