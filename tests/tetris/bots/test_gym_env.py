"""The environment for learning players: Gymnasium's own check, seeds, and what is observed."""

import importlib
import sys

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs the extra [gym]")

from gymnasium.utils.env_checker import check_env  # noqa: E402

from tests.support.tetris_games import set_up  # noqa: E402
from tetris.bots.gym_env import INPUTS, Acts, TetrisEnv  # noqa: E402
from tetris.engine.board import Board  # noqa: E402
from tetris.engine.game import Config  # noqa: E402
from tetris.engine.pieces import Piece  # noqa: E402


def drawn(picture: "np.ndarray[tuple[int, int], np.dtype[np.uint8]]") -> str:
    rows = ["".join(".#"[cell] for cell in row) for row in picture]
    return "\n".join(row for row in rows if "#" in row)


def test_without_gymnasium_a_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "tetris.bots.gym_env")
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(ModuleNotFoundError, match=r"Gymnasium.* pip install 'orbtouch\[gym\]'"):
        importlib.import_module("tetris.bots.gym_env")


@pytest.mark.parametrize("name", ["Tetris/Inputs-v0", "Tetris/Placements-v0"])
@pytest.mark.parametrize("config", [Config(), Config(columns=6, rows=9, hold=False)])
def test_gymnasium_finds_no_fault(name: str, config: Config) -> None:
    env = gymnasium.make(name, config=config, render_mode="ansi")
    check_env(env.unwrapped)  # it raises, or warns, which is an error here
    observation, _ = env.reset(seed=1)
    assert env.observation_space.contains(observation)


@pytest.mark.parametrize("acts", ["inputs", "placements"])
def test_a_seed_repeats_a_game_and_the_next_reset_begins_another(acts: Acts) -> None:
    def play(env: TetrisEnv, seed: int | None) -> list[object]:
        observation, _ = env.reset(seed=seed)
        env.action_space.seed(3)
        seen: list[object] = [observation["pieces"].tolist()]
        for _ in range(40):
            observation, reward, *_ = env.step(env.action_space.sample())
            seen.append((drawn(observation["board"]), drawn(observation["piece"]), reward))
        return seen

    env, other = TetrisEnv(acts), TetrisEnv(acts)
    assert play(env, 8) == play(other, 8)
    assert play(env, None) == play(other, None)
    assert play(env, None) != play(env, 8)


def test_board_and_piece_are_seen_apart_the_top_row_first() -> None:
    env = TetrisEnv()
    env.reset(seed=1)
    set_up(env.game, Board.parse("T.........\nTTI......."), Piece("S", 5, 0))
    observation, reward, terminated, truncated, info = env.step(0)
    assert observation["board"].shape == (24, 10)
    assert drawn(observation["board"]) == "#.........\n###......."
    assert drawn(observation["piece"]) == "......##..\n.....##..."
    assert (reward, terminated, truncated, info["lines"]) == (0.0, False, False, 0)


def test_the_pieces_are_the_hold_whether_it_is_free_and_the_next_ones() -> None:
    env = TetrisEnv()
    env.reset(seed=1)
    first, following = env.game.piece.kind, env.game.next
    observation, *_ = env.step(7)
    numbers = ["-", "I", "O", "T", "S", "Z", "J", "L"]
    hold, free, *coming = observation["pieces"].tolist()
    assert (numbers[hold], free) == (first, False)
    assert [numbers[n] for n in coming[:4]] == list(following[1:])


def test_time_passes_with_every_input() -> None:
    env = TetrisEnv(step_s=0.25)
    env.reset(seed=1)
    row = env.game.piece.y
    for _ in range(4):
        env.step(0)
    assert env.game.piece.y == row - 1


def test_the_reward_is_the_points_of_a_step() -> None:
    env = TetrisEnv()
    env.reset(seed=1)
    set_up(env.game, Board.parse("JJJJJJJJJ.\n" * 4), Piece("I", 7, 10, turn=1))
    _, reward, *_, info = env.step(INPUTS.index(INPUTS[4]))
    assert (reward, info["lines"]) == (2 * 10 + 800 + 2000, 4)  # the drop, four rows, all empty


def test_a_placement_may_be_one_that_only_a_spin_reaches() -> None:
    env = TetrisEnv("placements")
    env.reset(seed=1)
    board = Board.parse("...J......\nJJJ...JJJJ\nJJJJ.JJJJJ")
    set_up(env.game, board, Piece("T", 3, 18))
    action = env.encode(Piece("T", 3, 0, turn=2))
    assert env.action_masks()[action]
    _, reward, *_, info = env.step(action)
    assert (reward, info["reachable"], info["lines"]) == (1200.0, True, 2)


def test_after_a_hold_the_other_piece_is_placed() -> None:
    env = TetrisEnv("placements")
    env.reset(seed=1)
    kind = env.game.next[0]
    action = next(
        env.encode(piece, hold=True)
        for piece in (Piece(kind, 0, y) for y in (-2, -1, 0))
        if env.action_masks()[env.encode(piece, hold=True)]
    )
    env.step(action)
    assert kind in str(env.game.board)


def test_a_placement_out_of_reach_is_a_drop_from_where_the_piece_is() -> None:
    env = TetrisEnv("placements")
    env.reset(seed=1)
    action = env.encode(Piece("O", 0, 9))
    assert not env.action_masks()[action]
    *_, info = env.step(action)
    assert not info["reachable"]
    assert env.game.pieces_placed == 1


def test_every_placement_of_the_mask_is_in_reach_until_the_game_ends() -> None:
    env = TetrisEnv("placements", Config(rows=8))
    _, info = env.reset(seed=5)
    random = np.random.default_rng(2)
    for _ in range(150):
        mask = info["action_mask"]
        _, _, over, _, info = env.step(int(random.choice(np.flatnonzero(mask))))
        assert info["reachable"]
        if over:
            assert not info["action_mask"].any()
            _, info = env.reset()


def test_the_game_is_drawn_as_text() -> None:
    env = TetrisEnv(config=Config(rows=4, columns=4), render_mode="ansi")
    env.reset(seed=1)
    set_up(env.game, Board.parse("JJJ.", 4), Piece("O", 0, 2))
    assert env.render() == "....\n" * 4 + "oo..\noo..\n....\nJJJ."


def test_a_picture_has_the_top_row_first_and_the_piece_in_its_colour() -> None:
    env = TetrisEnv(config=Config(rows=4, columns=4), render_mode="rgb_array")
    env.reset(seed=3)
    set_up(env.game, Board.parse("JJJ.", 4), Piece("O", 0, 2))
    picture = env.render()
    assert isinstance(picture, np.ndarray)
    assert picture.shape == (8 * 12, 4 * 12, 3)
    well, yellow, blue = (16, 20, 30), (255, 213, 79), (92, 132, 235)
    assert tuple(picture[-1, 0]) == blue
    assert tuple(picture[-1, -1]) == tuple(picture[0, 0]) == well
    assert (picture == yellow).all(axis=2).sum() == 4 * 12 * 12


def test_observations_are_contiguous() -> None:
    seen, _ = TetrisEnv().reset(seed=3)
    assert all(array.flags.c_contiguous and array.flags.writeable for array in seen.values())
