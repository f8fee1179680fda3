"""Best lists: who is in them, and that neither a crash nor a damaged file loses them."""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.support.pytest_types import Patch
from tetris.engine.modes import MODES
from tetris.files import config_folder, data_folder, write_beside
from tetris.history.high_scores import FILE_NAME, PLACES, Entry, HighScores

GAME = Entry(score=100, lines=40, pieces=100, time_s=60.0)


def add(records: HighScores, mode: str, won: bool = True, **figures: Any) -> int | None:
    return records.add(MODES[mode], replace(GAME, **figures), won=won)


def test_the_most_points_come_first() -> None:
    records = HighScores(None)
    places = [add(records, "marathon", score=score) for score in (500, 900, 700, 100)]
    assert places == [1, 1, 2, 4]
    assert [entry.score for entry in records.best("marathon")] == [900, 700, 500, 100]


def test_a_sprint_counts_its_time_and_only_when_it_is_finished(tmp_path: Path) -> None:
    records = HighScores(tmp_path)
    assert add(records, "sprint", time_s=62.0) == 1
    assert add(records, "sprint", time_s=58.5) == 1
    assert add(records, "sprint", won=False, time_s=3.0) is None
    assert [entry.time_s for entry in records.best("sprint")] == [58.5, 62.0]
    assert records.games("sprint") == (3, 2)


def test_an_orb_marathon_counts_its_pace_once_the_pace_has_risen(tmp_path: Path) -> None:
    records = HighScores(tmp_path)
    assert add(records, "orb_marathon", won=False, pace_hz=1.2, lines=30) == 1
    assert add(records, "orb_marathon", won=False, pace_hz=1.5, lines=10) == 1
    assert add(records, "orb_marathon", won=False, pace_hz=9.0, lines=9) is None
    assert [entry.pace_hz for entry in HighScores(tmp_path).best("orb_marathon")] == [1.5, 1.2]


def test_each_start_level_has_a_list_of_its_own(tmp_path: Path) -> None:
    records, marathon = HighScores(tmp_path), MODES["marathon"]
    assert records.add(marathon, replace(GAME, score=165_000), won=True) == 1
    assert records.add(marathon, replace(GAME, score=390_000), won=True, level=20) == 1
    again = HighScores(tmp_path)
    assert [entry.score for entry in again.best("marathon")] == [165_000]
    assert [entry.score for entry in again.best("marathon", 20)] == [390_000]
    assert (again.games("marathon", 20), again.best("marathon", 2)) == ((1, 1), ())


def test_of_equals_the_earlier_one_leads(tmp_path: Path) -> None:
    records = HighScores(tmp_path)
    add(records, "marathon", score=500, lines=1)
    assert add(records, "marathon", score=500, lines=2) == 2


def test_a_list_has_ten_places(tmp_path: Path) -> None:
    records = HighScores(tmp_path)
    for score in range(1000, 1000 + PLACES):
        add(records, "marathon", score=score)
    assert add(records, "marathon", score=5) is None
    assert add(records, "marathon", score=5000) == 1
    assert len(records.best("marathon")) == PLACES


def test_what_was_added_is_there_the_next_time(tmp_path: Path) -> None:
    records = HighScores(tmp_path / "new" / "folder")
    add(records, "zen", won=False, date="2025-06-01")
    again = HighScores(tmp_path / "new" / "folder")
    assert again.best("zen") == records.best("zen")
    assert again.games("zen") == (1, 0)
    (entry,) = again.best("zen")
    assert entry.date == "2025-06-01"
    assert again.trouble == ""


def test_two_programs_add_to_one_list(tmp_path: Path) -> None:
    one, other = HighScores(tmp_path), HighScores(tmp_path)
    add(one, "marathon", score=1)
    add(other, "marathon", score=2)
    assert [entry.score for entry in HighScores(tmp_path).best("marathon")] == [2, 1]


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00\xff" * 50,
        b"[1, 2",
        b"{}",
        b'{"form": 2, "modes": {}}',
        b'{"form": 1, "modes": []}',
        b'{"form": 1, "modes": {"zen": {"best": [], "totals": {}}}}',
        b'{"form": 1, "modes": {"zen": {"best": "score"}}}',
        b'{"form": 1, "modes": {"zen": {"best": [{"score": NaN}], "totals": {}}}}',
        b"[" * 100_000,
    ],
)
def test_a_damaged_file_is_put_aside_and_said_so(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / FILE_NAME
    path.write_bytes(content)
    records = HighScores(tmp_path)
    aside = tmp_path / "records-damaged-1.json"
    assert aside.read_bytes() == content
    assert records.trouble == f"{FILE_NAME} is damaged and was put aside as {aside.name}"
    assert add(records, "zen") == 1
    assert records.trouble == ""
    assert len(HighScores(tmp_path).best("zen")) == 1


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("score", "9" * 9),
        ("score", -1),
        ("time_s", None),
        ("lines", 1e400),
        ("pieces", 2.5),
    ],
)
def test_a_value_of_another_kind_is_damage(key: str, value: object, tmp_path: Path) -> None:
    records = HighScores(tmp_path)
    add(records, "zen")
    path = tmp_path / FILE_NAME
    document = json.loads(path.read_text())
    document["modes"]["zen"]["best"][0][key] = value
    path.write_text(json.dumps(document))
    again = HighScores(tmp_path)
    assert (again.best("zen"), again.games("zen")) == ((), (0, 0))
    assert "damaged" in again.trouble


@pytest.mark.parametrize("count", [-1, "2", 1.0, None])
def test_a_count_of_another_kind_is_damage(count: object, tmp_path: Path) -> None:
    add(HighScores(tmp_path), "zen")
    path = tmp_path / FILE_NAME
    document = json.loads(path.read_text())
    document["modes"]["zen"]["totals"]["games"] = count
    path.write_text(json.dumps(document))
    assert "damaged" in HighScores(tmp_path).trouble


def test_figures_that_an_earlier_version_kept_are_left_out(tmp_path: Path) -> None:
    add(HighScores(tmp_path), "zen")
    path = tmp_path / FILE_NAME
    document = json.loads(path.read_text())
    document["modes"]["zen"]["totals"] |= {"lines": 40, "clears": {"tetris": 2}}
    document["modes"]["zen"]["best"][0] |= {"level": 5, "won": True, "seed": 7}
    path.write_text(json.dumps(document))
    assert (HighScores(tmp_path).games("zen"), HighScores(tmp_path).trouble) == ((1, 1), "")
    assert len(HighScores(tmp_path).best("zen")) == 1


def test_a_second_damaged_file_does_not_replace_the_first(tmp_path: Path) -> None:
    for number in (1, 2):
        (tmp_path / FILE_NAME).write_text(f"damaged {number}")
        HighScores(tmp_path)
    assert (tmp_path / "records-damaged-1.json").read_text() == "damaged 1"
    assert (tmp_path / "records-damaged-2.json").read_text() == "damaged 2"


def test_a_folder_that_cannot_be_written_is_told_and_the_game_is_listed(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    records = HighScores(tmp_path / "file")
    assert add(records, "zen") == 1
    assert records.trouble.startswith("cannot ")
    assert len(records.best("zen")) == 1


def test_a_crash_while_writing_leaves_the_old_file(tmp_path: Path, monkeypatch: Patch) -> None:
    path = tmp_path / "list"
    write_beside(path, b"old")

    def crash(_: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", crash)
    with pytest.raises(KeyboardInterrupt):
        write_beside(path, b"new")
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["list"]


@pytest.mark.skipif(sys.platform != "linux", reason="XDG's rules are those of Linux")
def test_the_users_folders_follow_the_systems_rules(tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    assert data_folder() == tmp_path / "data" / "orbtouch" / "tetris"
    assert config_folder() == tmp_path / "config" / "orbtouch" / "tetris"
    assert not list(tmp_path.iterdir())  # nothing is made before it is needed
