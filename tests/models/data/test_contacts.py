"""Simulated contacts of every width, and the shipped network that learned from such."""

import numpy as np

from controller.bundles import bundle
from controller.simulator.orb import NOMINAL
from models.data import contacts

USUAL = bundle.read(bundle.default_path())


def test_the_shipped_bundle_tells_the_widths_of_contacts_on_orbs_that_it_never_saw() -> None:
    assert USUAL.radius is not None
    touches, radii, idle = contacts.session(NOMINAL, USUAL.rate_hz, np.random.default_rng(4))
    assert np.min(radii[0]) > 4.0
    firm = [np.abs(touch).max() > 0.15 for touch in touches]
    wide = np.array([np.log(np.median(radius)) for radius in radii])
    found = np.array([USUAL.radius.log_radius(touch, idle)[0] for touch in touches])
    assert np.corrcoef(wide[firm], found[firm])[0, 1] > 0.8


def test_a_contact_s_images_stand_together_and_begin_untouched() -> None:
    made = contacts.simulate(NOMINAL, 40.0, seed=5, orbs=1)
    assert len(made.inputs) == len(made.log_radius) == len(made.touch)
    assert made.inputs.shape[1] == 2 * 25 + 2
    ends = np.flatnonzero(np.diff(made.touch))
    assert (np.diff(made.touch) >= 0).all()
    assert len(ends) > 50
