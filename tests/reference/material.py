"""Material constants of the reference solver: orb, air and finger, and its units."""

from typing import Final

RADIUS_MM: Final = 38.0  # clamped radius R
SHEAR_PA: Final = 25e3  # Ecoflex 00-30, small-strain: reports range from 17 to 34 kPa
THICKNESS_MM: Final = 2.0  # of the whole membrane: paper, figure 3
UNIT_PA: Final = SHEAR_PA * THICKNESS_MM / RADIUS_MM  # mu h0 / R, 1.3 kPa
ATMOSPHERE: Final = 101_325.0 / UNIT_PA
# A fingertip gives way by 2 mm under 1 N (pulp compression, Serina et al. 1997: 1 N at 1.5 ... 2.5
# mm). For a sphere of 7 mm on springs, F = pi a k d^2, so k = 11 MPa / m.
PULP: Final = 1.1e7 * (RADIUS_MM * 1e-3) / UNIT_PA
PERMITTIVITY_DROP: Final = 0.08  # per unit of area stretch; the model's own, so that only the
# mechanics is compared
