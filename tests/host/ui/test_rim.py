"""Pulses of the dome's rim: strongest for what matters most, and never many."""

import pytest

from host.ui.orb_state import PULSE_LEAST_S, Rim, pulse_strength
from tetris.engine.events import Event, LevelUp, Locked
from tetris.engine.moves import Spin
from tetris.engine.pieces import Piece
from tetris.engine.scoring import Clear

PIECE = Piece.entering("O")


def locked(*rows: int) -> Event:
    return Locked(0.0, PIECE, rows, Clear(len(rows), Spin.NONE, False, -1, False, 0))


def test_clears_and_levels_are_stronger_than_locks() -> None:
    calm = pulse_strength([])
    lock, one, four = (pulse_strength([locked(*range(rows))]) for rows in (0, 1, 4))
    assert calm == 0.0
    assert 0.0 < lock < one < four <= 1.0
    assert pulse_strength([locked(0), LevelUp(0.0, 2)]) == 1.0


def test_a_pulse_rises_softly_and_fades() -> None:
    rim = Rim()
    rim.strike(1.0, 5.0)
    levels = [rim.level(5.0 + ms / 1000) for ms in (0, 30, 60, 300, 1000)]
    assert levels[0] < levels[1] < levels[2] > levels[3] > levels[4]
    assert levels[-1] == 0.0


def test_no_more_than_three_pulses_begin_in_a_second() -> None:
    rim, begun = Rim(), 0
    for frame in range(60):
        before = rim.level(frame / 60 + 0.01)
        rim.strike(1.0, frame / 60)
        begun += rim.level(frame / 60 + 0.01) != before
    assert begun <= 3
    assert pytest.approx(1 / 3) == PULSE_LEAST_S
