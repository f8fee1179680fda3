"""Health: what a sensor is told to lack while people play on it."""

import numpy as np
from numpy.typing import NDArray

from controller.health import LETTERS, MOST, Health
from controller.preprocess import Preprocessor, PreprocessSettings

REST_PF = np.random.default_rng(2).normal(41.2, 2.9, (5, 5))


def idle(seconds: float, seed: int = 0) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    frames = REST_PF * (1.0 + 0.003 * rng.standard_normal((round(seconds * 10), 5, 5)))
    return frames.astype(np.float32)


class Session:
    """A preprocessor and its health."""

    def __init__(self) -> None:
        self.stage = Preprocessor(PreprocessSettings(), 5, 5)
        self.health = Health(10.0, ratio=True)

    def feel(self, frames: NDArray[np.floating]) -> tuple[str, ...]:
        for frame in frames.astype(np.float32):
            prepared = self.stage.step(frame)
            self.health.notice(prepared)
            found = self.health.look(prepared.dead, self.stage.resting)
        return found


def test_a_sound_sensor_lacks_nothing() -> None:
    assert Session().feel(idle(20.0)) == ()


def test_falling_pressure_is_told_apart_from_an_electrode_and_from_the_film() -> None:
    slow = np.linspace(0.0, 1.0, 1200)[:, None, None]
    session = Session()
    session.feel(idle(5.0))
    [line] = session.feel(idle(120.0) * (1.0 - 0.12 * slow))
    assert line == "pressure down 6 %: pump (or the orb has cooled)"

    row, session = np.ones((5, 5)), Session()
    row[3] = 0.8
    session.feel(idle(5.0))
    [line] = session.feel(idle(120.0) * (1.0 + (row - 1.0) * slow))
    assert line == "row 3 has drifted by -20 %; look at its lead"

    film, session = np.ones((5, 5)), Session()
    film[1, 2] = 1.5
    session.feel(idle(5.0))
    [line] = session.feel(idle(120.0) * (1.0 + (film - 1.0) * slow))
    assert line == "taxel row 1, column 2: drifted by +49 %; the film may be cracking"


def test_what_is_told_is_taken_back_only_when_it_is_clearly_less() -> None:
    slow = np.linspace(0.0, 1.0, 600)[:, None, None]
    session = Session()
    session.feel(idle(5.0))
    assert session.feel(idle(60.0) * (1.0 - 0.09 * slow))
    assert session.feel(idle(60.0) * (0.91 + 0.02 * slow))
    assert session.feel(idle(60.0) * (0.93 + 0.06 * slow)) == ()


def test_a_lead_that_is_off_is_named_and_one_that_crackles_is_told() -> None:
    session = Session()
    session.feel(idle(5.0))
    cut = idle(3.0)
    cut[:, :, 2] = 1.0
    assert session.feel(cut) == ("column 2: no signal, play goes on without; fasten the lead",)
    assert session.feel(idle(3.0)) == ()
    for _ in range(3):
        session.feel(cut[:3])
        found = session.feel(idle(1.0))
    assert found[0].startswith("a lead crackles")


def test_a_hand_that_never_leaves_is_told() -> None:
    session = Session()
    session.feel(idle(5.0))
    pressed = idle(70.0)
    pressed[:, 1:4, 1:4] *= np.float32(0.8)
    assert session.feel(pressed) == ("something has touched the orb for 1 min; take it off",)
    restless = Session()
    moving = idle(12.0) * (0.97 ** np.arange(120))[:, None, None]
    assert restless.feel(moving)[0].startswith("no quiet second")


def test_sentences_fit_on_the_wire() -> None:
    session = Session()
    session.feel(idle(5.0))
    slow = np.linspace(0.0, 1.0, 1800)[:, None, None]
    far = np.exp(np.random.default_rng(8).normal(-0.5, 0.8, (5, 5)))
    found = session.feel(idle(180.0) * (1.0 + (far - 1.0) * slow))
    assert 0 < len(found) <= MOST
    assert max(map(len, found)) <= LETTERS
    assert all(line.isascii() and line.isprintable() for line in found)
