"""Users of the simulated hand: each user's style, each session's mood, and the ten users."""

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Final

import numpy as np

LEFT_HANDED: Final = (3, 8)  # of every ten users of a population
_POPULATION: Final = 0x70656F  # tag that keeps a population's seeds apart from all others
_DEGREES: Final = ("pinch_yaw", "twist_angle", "twist_yaw", "pre_rotation", "fan")
_PRIVATE: Final = ("tremor", "tremor_hz", "left_handed", "aim", "pointer")


@dataclass(frozen=True, slots=True)
class UserStyle:
    """Style of one person's touches; lengths in mm, angles in radians, times in seconds.

    Attributes:
        press_depth: Of a firm press.
        press_hold: Time at full depth.
        finger_radius: Of the finger that presses.
        pinch_open: From the middle of a pinch to a finger at its beginning.
        pinch_closed: The same at its end.
        pinch_depth: Of the pinching fingers.
        pinch_close: Time of the movement.
        pinch_yaw: Direction of the pinch, for a right hand.
        twist_fingers: How many fingers turn.
        twist_grip: From the middle of a twist to a finger.
        twist_angle: How far the hand turns.
        twist_time: Time of the turn.
        twist_depth: Of the turning fingers.
        twist_yaw: Where the fingers are, for a right hand.
        pre_rotation: How far the wrist turns back before a twist.
        fan: Angle between neighbouring fingers.
        tremor: Amplitude.
        tremor_hz: Frequency.
        left_handed: Angles that depend on the hand are mirrored.
        aim: Deviation of each touch from where it was meant, per axis.
        pointer: It is no hand but a pointer on a screen.
    """

    press_depth: float
    press_hold: float
    finger_radius: float
    pinch_open: float
    pinch_closed: float
    pinch_depth: float
    pinch_close: float
    pinch_yaw: float
    twist_fingers: int
    twist_grip: float
    twist_angle: float
    twist_time: float
    twist_depth: float
    twist_yaw: float
    pre_rotation: float
    fan: float
    tremor: float
    tremor_hz: float
    left_handed: bool
    aim: float
    pointer: bool = False


# What a gesture's file may refer to; angles in degrees there.
PARAMETERS: Final = tuple(f.name for f in fields(UserStyle) if f.name not in _PRIVATE)


@lru_cache(maxsize=256)
def parameters(style: UserStyle) -> dict[str, float]:
    """Return a style as gestures' files see it: mm, degrees, seconds. Not to be changed."""
    values = {name: float(getattr(style, name)) for name in PARAMETERS}
    return {**values, **{name: float(np.degrees(values[name])) for name in _DEGREES}}


def draw_style(rng: np.random.Generator) -> UserStyle:
    """Draw a user."""
    return UserStyle(
        press_depth=rng.uniform(6.5, 12.0),
        press_hold=0.45 * np.exp(rng.normal(0.0, 0.15)),
        finger_radius=rng.uniform(6.0, 8.5),
        pinch_open=rng.uniform(15.0, 20.0),
        pinch_closed=rng.uniform(6.0, 10.0),
        pinch_depth=rng.uniform(5.0, 9.0),
        pinch_close=rng.uniform(0.3, 0.6),
        pinch_yaw=np.radians(rng.uniform(-40.0, 40.0)),
        twist_fingers=int(rng.integers(3, 6)),
        twist_grip=rng.uniform(15.0, 21.0),
        twist_angle=np.radians(rng.uniform(35.0, 65.0)),
        twist_time=rng.uniform(0.55, 0.95),
        twist_depth=rng.uniform(4.0, 8.0),
        twist_yaw=np.radians(rng.uniform(-30.0, 30.0)),
        pre_rotation=np.radians(max(0.0, rng.normal(12.0, 7.0))),
        fan=np.radians(rng.uniform(24.0, 36.0)),
        tremor=rng.uniform(0.1, 0.35),
        tremor_hz=rng.uniform(8.0, 11.0),
        left_handed=bool(rng.random() < 0.15),
        aim=rng.uniform(1.0, 2.0),
    )


def draw_mood(style: UserStyle, rng: np.random.Generator) -> UserStyle:
    """Vary a user's style for one session: firmness, tempo, and how the dome is turned."""
    firmness = np.exp(rng.normal(0.0, 0.08))
    tempo = np.exp(rng.normal(0.0, 0.08))
    yaw = np.radians(rng.normal(0.0, 8.0))
    return replace(
        style,
        press_depth=style.press_depth * firmness,
        pinch_depth=style.pinch_depth * firmness,
        twist_depth=style.twist_depth * firmness,
        press_hold=style.press_hold * tempo,
        pinch_close=style.pinch_close * tempo,
        twist_time=style.twist_time * tempo,
        pinch_yaw=style.pinch_yaw + yaw,
        twist_yaw=style.twist_yaw + yaw,
    )


def person(population: int, number: int) -> UserStyle:
    """Return user `number` (0, 1, 2, ...) of the population with this seed; always the same.

    In every ten users, numbers 3 and 8 are left-handed, so that a data set of ten has both kinds.
    """
    seed = np.random.SeedSequence([_POPULATION, population], spawn_key=(number,))
    drawn = draw_style(np.random.default_rng(seed))
    return replace(drawn, left_handed=number % 10 in LEFT_HANDED)
