"""What touches the sensor, estimated frame by frame: place, depth, number of fingers, angle."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ContactEstimate:
    """What touches in one frame, each with its standard deviation.

    Attributes:
        x: Place across, grid units: the middle of all contacts, weighed by their depth.
        y: Place along, grid units, from the near side.
        place_sigma: Of each axis, grid units.
        depth_mm: Of the deepest contact, mm.
        depth_sigma: mm.
        fingers: Number of contacts: 1, 2, or 3 for more.
        fingers_sure: Probability of that number.
        angle_deg: How far the contacts have turned since they landed, degrees, counter-clockwise
            positive; 0 for one contact.
        angle_sigma: Degrees.
    """

    x: float
    y: float
    place_sigma: float
    depth_mm: float
    depth_sigma: float
    fingers: int
    fingers_sure: float
    angle_deg: float
    angle_sigma: float
