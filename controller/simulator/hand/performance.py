"""A simulated hand: gestures, and touches that are none, as finger paths.

Gestures are data (`gesture_file.py`), and users have styles (`user_style.py`). The hand is
independent of sensors and networks.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import vocabulary
from controller.shared.aliases import Array, Complex
from controller.simulator.dome.membrane import clamp_radius_mm
from controller.simulator.hand import pointer
from controller.simulator.hand.gesture_file import FINGERS, Repertoire, shipped
from controller.simulator.hand.user_style import UserStyle

MECHANICS_HZ: Final = 50.0
SLOTS: Final = FINGERS  # fingers of a hand
GESTURES: Final = vocabulary.shipped().labels[1:]  # paper, section 4.2
LOCATED: Final = vocabulary.shipped().located  # those of them whose place is a command's
DISTRACTORS: Final = tuple(label for label, one in shipped().items() if one.distractor)
BRIEF: Final = ("brush", "rest")  # those of them that fit where a person is asked for none
ONSET_SHARE: Final = 0.4  # of the plateau depth: where a gesture truly begins
RIM: Final = 34 / 38  # of the dome's radius; farther out a finger meets the clamp
_RELEASED_MM: Final = 0.05  # shallower than this no finger touches
_GRID: Final = (5, 5, 10.0)


@dataclass(frozen=True, slots=True)
class Performance:
    """Finger paths of one event, sampled step by step."""

    label: str  # gesture or distractor
    point: Complex  # hand points, complex mm from the dome's centre, (steps, SLOTS)
    depth_mm: Array  # indentation, (steps, SLOTS)
    radius_mm: Array  # finger radii, (SLOTS,)
    onset_s: float  # true onset from the start of the paths
    release_s: float  # when the last finger leaves


def perform(
    label: str,
    place: tuple[float, float],
    style: UserStyle,
    rng: np.random.Generator,
    *,
    grid: tuple[int, int, float] = _GRID,
    step_hz: float = MECHANICS_HZ,
    repertoire: Repertoire | None = None,
    quick: bool = False,
) -> Performance:
    """Carry out a gesture or a distractor that is meant for a place, (x, y) in grid units.

    The grid is rows, columns and pitch in mm; the gestures that ship are the usual repertoire.
    `quick` is as in fast play, where the gesture has such a form.

    Raises:
        ValueError: The label is unknown.
    """
    known = shipped() if repertoire is None else repertoire
    if label not in known:
        names = ", ".join(known)
        raise ValueError(f"the virtual hand cannot perform {label!r}; it knows {names}")
    rows, columns, pitch_mm = grid
    aim = complex(*rng.normal(0.0, style.aim, 2))
    middle = complex(place[0] - (columns - 1) / 2, place[1] - (rows - 1) / 2) * pitch_mm + aim
    if style.pointer and label in pointer.ACTS:
        point, depth, radius = pointer.ACTS[label](middle, rng, step_hz, quick)
    else:
        gesture = known[label]
        form = gesture.quick if quick and gesture.quick else gesture
        point, depth, radius = form.move(style, rng, step_hz)
        point += middle
        depth *= np.abs(point) < RIM * clamp_radius_mm(rows, columns, pitch_mm)
    steps, fingers = point.shape
    time = np.arange(steps) / step_hz
    if not style.pointer:
        phase = rng.uniform(0.0, 2 * np.pi, (2, fingers))
        shake = 2 * np.pi * style.tremor_hz * time[:, None]
        point = point + style.tremor * (np.sin(shake + phase[0]) + 1j * np.sin(shake + phase[1]))
    points = np.zeros((steps, SLOTS), dtype=np.complex128)
    depths = np.zeros((steps, SLOTS))
    radii = np.full(SLOTS, style.finger_radius)
    points[:, :fingers], depths[:, :fingers], radii[:fingers] = point, depth, radius
    plateau = depth.max(axis=0)
    deep: NDArray[np.bool_] = np.any((depth > ONSET_SHARE * plateau) & (plateau > 0.0), axis=1)
    touching: NDArray[np.bool_] = np.any(depth > _RELEASED_MM, axis=1)
    onset = time[int(np.argmax(deep))]
    release = time[len(time) - 1 - int(np.argmax(touching[::-1]))] + 1.0 / step_hz
    return Performance(label, points, depths, radii, float(onset), float(release))
