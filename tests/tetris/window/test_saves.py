"""Saved games: best lists, replays, and which games count."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from tetris.bots import BOTS
from tetris.engine.game import Action, Phase
from tetris.engine.modes import MODES
from tetris.history.replay import Player
from tetris.history.replay_file import load
from tetris.kit.settings import Settings
from tetris.window.game_session import Saves, Session


def played(mode: str, pieces: int = 10_000, *, seed: int = 1, action_s: float = 0.1) -> Session:
    """Let the bot play a game to its end, or so many pieces."""
    session, now_s = Session.new(MODES[mode], seed, Settings()), 0.0
    session.update(now_s)
    game = session.game
    while game.phase is Phase.RUNNING and game.pieces_placed < pieces:
        for action in BOTS["dellacherie"](game).actions:
            now_s += action_s
            session.update(now_s, [action], commands=1)
    return session


def lost(mode: str = "marathon") -> Session:
    session = Session.new(MODES[mode], 1, Settings())
    now_s = 0.0
    while session.game.phase is Phase.RUNNING:
        now_s += 1.0
        session.update(now_s, [Action.HARD_DROP], commands=1)
    return session


def replays(folder: Path) -> Sequence[Path]:
    return sorted(folder.rglob("*.tetris"))


def test_a_finished_sprint_has_a_place_and_a_replay(tmp_path: Path) -> None:
    slow, quick = played("sprint", action_s=0.2), played("sprint", action_s=0.1)
    saves = Saves(tmp_path)
    assert saves.keep(slow).place == 1
    assert saves.keep(quick).place == 1
    assert [entry.time_s for entry in saves.records.best("sprint")] == [
        quick.game.time_s,
        slow.game.time_s,
    ]
    assert len(replays(tmp_path)) == 2
    assert Saves(tmp_path).records.best("sprint") == saves.records.best("sprint")


def test_a_lost_sprint_has_no_place_but_a_replay(tmp_path: Path) -> None:
    assert Saves(tmp_path).keep(lost("sprint")).place is None
    assert len(replays(tmp_path)) == 1


def test_a_game_that_was_left_keeps_its_replay_if_it_had_begun_in_earnest(tmp_path: Path) -> None:
    saves = Saves(tmp_path)
    saves.keep(played("marathon", 9))
    assert replays(tmp_path) == []
    assert saves.keep(played("marathon", 10)).place is None
    assert len(replays(tmp_path)) == 1


def test_zen_counts_when_it_is_left_because_it_has_no_other_end(tmp_path: Path) -> None:
    assert Saves(tmp_path).keep(played("zen", 30)).place == 1


def test_a_game_that_was_taken_over_is_kept_but_counts_for_no_list(tmp_path: Path) -> None:
    first = lost()
    player = Player(first.recorder.replay())
    player.seek(player.start_s + 5.0)
    session = Session(MODES["marathon"], player.take_over())
    while session.game.phase is Phase.RUNNING:
        session.update(session.recorder.time_s + 0.5, [Action.HARD_DROP], commands=1)
    assert session.commands == session.game.pieces_placed
    saves = Saves(tmp_path)
    assert saves.keep(session).place is None
    (path,) = replays(tmp_path)
    again = Player(load(path))
    again.advance(again.end_s)
    assert again.game.score == session.game.score


def test_a_folder_that_cannot_be_written_is_a_sentence_and_the_game_goes_on(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    kept = Saves(blocked).keep(lost())
    assert "cannot" in kept.notice


def test_without_a_folder_nothing_is_kept() -> None:
    saves = Saves(None)
    assert saves.keep(lost()).place is None
    assert saves.records.best("marathon") == ()
    assert saves.replays() == []


@pytest.mark.parametrize("name", list(MODES))
def test_the_players_settings_reach_the_rules_of_every_mode(name: str) -> None:
    settings = Settings(soft_drop=7, guard_ms=900, level=5)
    config = Session.new(MODES[name], 3, settings).game.config
    assert config.soft_drop_factor == 7
    assert config.guard_s == 0.9
    assert config.start_level == (5 if MODES[name].levels else 1)
    assert Session.new(MODES[name], 3, settings, level=9).game.config.start_level in (1, 9)


def test_a_game_that_no_file_can_hold_is_a_sentence_and_has_its_place(tmp_path: Path) -> None:
    session = played("zen", pieces=10)
    session.recorder.update(500 * 3600.0)
    kept = Saves(tmp_path).keep(session)
    assert "end cannot be" in kept.notice
    assert kept.place == 1
    assert replays(tmp_path) == []
