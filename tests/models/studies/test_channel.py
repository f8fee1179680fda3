"""Channels whose capacity is known, and games as channels."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from models.results.storage import UserFileError
from models.studies.paper import channel

LN2 = math.log(2)


def flips(p: float) -> NDArray[np.float64]:
    return np.array([[1 - p, p], [p, 1 - p]])


def test_a_channel_that_flips_bits_carries_what_shannon_says() -> None:
    h = -(0.11 * math.log(0.11) + 0.89 * math.log(0.89))
    nats, share = channel.best_use(flips(0.11))
    assert nats == pytest.approx(LN2 - h)
    assert share == pytest.approx([0.5, 0.5])


@settings(deadline=None, max_examples=10)
@given(st.integers(2, 5), st.integers(2, 6), st.integers(0, 2**32 - 1))
def test_no_use_is_better_than_the_best(inputs: int, outputs: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    table = rng.dirichlet(np.full(outputs, 0.5), inputs)
    best, _ = channel.best_use(table)
    other = rng.dirichlet(np.ones(inputs))
    assert channel.information(other, table) <= best + 1e-6
    assert -1e-9 <= best <= math.log(min(inputs, outputs)) + 1e-9


def test_counts_of_a_useless_channel_carry_nothing_once_their_bias_is_off() -> None:
    rng = np.random.default_rng(0)
    counts = rng.multinomial(100, np.full(5, 0.2), 5)
    assert channel.counted(counts) < 0.02
    assert channel.counted(np.diag([10, 10])) == pytest.approx(LN2, abs=0.06)


def game(*meant: tuple[int, int, str], heard: list[tuple[int, str]]) -> dict[str, object]:
    return {"seconds": 60.0, "events": [list(one) for one in meant], "commands": heard}


def test_what_was_meant_comes_out_as_the_first_command_that_answers_it() -> None:
    played = channel.gather(
        channel.session(one) for one in [
            game(
                (1000, 1500, "left"), (3000, 4000, "drop"), (6000, 6500, "left"),
                heard=[(500, "drop"), (1300, "left"), (1400, "left"), (3500, "left")],
            ),
            game((1000, 2000, "drop"), heard=[(1500, "drop")]),
        ]
    )  # fmt: skip
    assert played.commands == ("drop", "left")
    assert played.counts().tolist() == [[1, 1, 0], [0, 1, 1]]  # the last column: nothing
    assert (played.alarms, played.minutes) == (1, 2.0)
    # Gestures of 1.0 and 0.5 s, and a pause of 1.75 s, the median of 1.5 and 2.0 s.
    assert played.seconds == pytest.approx([2.75, 2.25])
    assert played.late_s == pytest.approx(0.5)  # of 0.3, 0.5 and 0.5 s


def test_a_player_who_is_always_understood_says_what_the_commands_are_worth() -> None:
    four = ("left", "right", "drop", "down")
    meant = [(2000 * i, 2000 * i + 1000, four[i % 4]) for i in range(1, 81)]
    one = game(*meant, heard=[(ms + 200, name) for ms, _, name in meant])
    found = channel.figures(channel.gather([channel.session(one)]))
    assert found["capacity"] == pytest.approx(math.log(4))
    assert found["right"] == 1.0
    assert found["mean_s"] == pytest.approx(2.0)
    assert found["played"][1] <= found["played"][0] <= found["played"][2] + 0.05
    json.dumps(found)  # plain data


def test_a_game_is_the_last_line_that_is_json(tmp_path: Path) -> None:
    path = tmp_path / "game.json"
    path.write_text("hello\n" + json.dumps(game((0, 1, "left"), heard=[])) + "\n")
    assert channel.read(path).minutes == 1.0
    path.write_text('{"commands": []}\n')
    with pytest.raises(channel.GameError, match="host --demo"):
        channel.read(path)
    with pytest.raises(UserFileError, match="cannot read"):
        channel.read(tmp_path / "none.json")
    with pytest.raises(channel.GameError, match="no intended gesture"):
        channel.gather([channel.session(game(heard=[]))])
