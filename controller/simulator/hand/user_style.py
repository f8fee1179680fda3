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
    """Style of one person's touches; lengths in mm, angles in radians, times in seconds."""

    press_depth: float  # of a firm press
    press_hold: float  # time at full depth
    finger_radius: float  # of the finger that presses
    pinch_open: float  # from the middle of a pinch to a finger at its beginning
    pinch_closed: float  # the same at its end
    pinch_depth: float  # of the pinching fingers
    pinch_close: float  # time of the movement
    pinch_yaw: float  # direction of the pinch, for a right hand
    twist_fingers: int  # how many fingers turn
    twist_grip: float  # from the middle of a twist to a finger
    twist_angle: float  # how far the hand turns
    twist_time: float  # time of the turn
    twist_depth: float  # of the turning fingers
    twist_yaw: float  # where the fingers are, for a right hand
    pre_rotation: float  # how far the wrist turns back before a twist
    fan: float  # angle between neighbouring fingers
    tremor: float  # amplitude
    tremor_hz: float  # frequency
    left_handed: bool  # angles that depend on the hand are mirrored
    aim: float  # deviation of each touch from where it was meant, per axis
    pointer: bool = False  # it is no hand but a pointer on a screen


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
