"""Imported arrays against earlier imports: no time, label, number or mark changes unnoticed.

The digest is that of everything in the recordings but the software's version. When a change is
meant to change imports, take the new digests from the failures.
"""

from hashlib import sha256
from typing import Any

import numpy as np
import pytest

from controller.recordings.recording import LABELLERS
from tests.controller.recordings.test_importer import CAPFINGERID, imported

PLAIN = 'frames = "frames"\nunit = "counts"\npitch_mm = 4.1\ndevice = "x"\n'
LABELLED = 'label = "task"\nlabel_names = "task_names"\nnull = "PAUSE"\n'
DESCRIPTIONS = {
    "capfingerid": CAPFINGERID,
    "rate": PLAIN + "rate_hz = 14.0\n",
    "even": PLAIN + LABELLED + 'time = "t"\neven_times = true\nsubject = "subject"\n',
    "gaps": PLAIN + 'time = "t"\ndrop_repeated = true\ngap_s = 0.5\nsession = ["subject"]\n',
    "places": PLAIN + LABELLED + 'rate_hz = 9.0\nplace = "place"\nmarks = "notes"\n',
    "rest": PLAIN + 'rate_hz = 9.0\nrest = "rest"\nuser = "ada"\nprotocol = "p"\n',
    "first": PLAIN + 'rate_hz = 9.0\nrest = "frames"\nsign = "rises"\nsubject = "subject"\n',
}
GOLDEN = {
    "capfingerid": "b5e67bf6a0c9d741",
    "rate": "f16c09b3e7ac9046",
    "even": "82f97799e71ad3ad",
    "gaps": "0f98f998bd47b6a7",
    "places": "c58decac62bca9df",
    "rest": "5448308abcaf707e",
    "first": "12f3c70ba29aa127",
}


def arrays() -> dict[str, Any]:
    """Forty frames of two people, with arrays for every key."""
    rng = np.random.default_rng(1)
    step = np.where(np.arange(40) % 11 == 10, 0.7, np.where(np.arange(40) % 7 == 6, 0.0, 0.07))
    place = np.where(np.arange(40)[:, None] % 5 == 4, np.nan, np.arange(40)[:, None] // 6 + 0.25)
    return {
        "frames": rng.integers(90, 110, (40, 3, 2)).astype(np.int16),
        "t": 1000.0 + np.cumsum(step),
        "task": rng.integers(-1, 4, 40).astype(np.int8),
        "subject": np.repeat(np.array([12, 3], dtype=np.int8), 20),
        "place": np.repeat(place, 2, axis=1),
        "notes": np.repeat(np.array(["a", "", "b", "b"]), 10),
        "rest": np.full((3, 2), 100.5),
    }


def digest(text: str) -> str:
    said = sha256()
    for one in imported(text, **arrays()):
        origin = one.origin
        said.update(
            repr((origin.user, origin.session, origin.protocol, origin.labels, origin.rate_hz,
                  origin.unit, origin.sign, origin.id, origin.rows, origin.columns, one.marks,
                  np.round(one.t, 6).tolist(), one.sequence.tolist(), one.frames.tolist(),
                  [getattr(one, name).tolist() for name in LABELLERS], one.excluded.any(),
                  None if one.rest is None else one.rest.tolist())).encode()
        )  # fmt: skip
    return said.hexdigest()[:16]


@pytest.mark.parametrize("name", DESCRIPTIONS)
def test_an_import_is_the_same(name: str) -> None:
    assert digest(DESCRIPTIONS[name]) == GOLDEN[name]
