"""The response of a simulated dome to a press of a finger."""

from typing import Final

import numpy as np

from controller.diagnostics.frame_source import DEPTH_MM, RADIUS_MM
from controller.diagnostics.touch_checks import Place
from controller.shared.aliases import Array
from controller.simulator.dome.mechanics import Mechanics, MechanicsModel
from controller.simulator.hand.performance import MECHANICS_HZ

_HOLD_S: Final = 1.0


def pressed(
    rows: int,
    columns: int,
    pitch_mm: float,
    place: Place,
    *,
    off_mm: complex = 0j,
    depth_mm: float = DEPTH_MM,
) -> Array:
    """Return z - 1, (rows, columns), of a simulated dome pressed so deep, so far off a taxel."""
    steps = round(_HOLD_S * MECHANICS_HZ)
    model = MechanicsModel()
    friction = float(np.mean(model.friction))
    dome = Mechanics(model, (rows, columns), pitch_mm, 1.0 / MECHANICS_HZ, 1, friction)
    row, column = place
    at = complex(column - (columns - 1) / 2, (rows - 1) / 2 - row) * pitch_mm + off_mm
    sinking = np.minimum(np.arange(1, steps + 1) / (0.15 * MECHANICS_HZ), 1.0)
    log_c, _ = dome.advance(
        np.full((steps, 1), at), depth_mm * sinking[:, None], np.full((steps, 1), RADIUS_MM)
    )
    return np.asarray(np.expm1(log_c[-1]).reshape(rows, columns))
