"""Replay files: what is written is read again; what is no replay is refused in a sentence."""

import hashlib
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, get_type_hints

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tetris.engine import rules
from tetris.engine.game import Action, Config, Gravity
from tetris.history.replay import LAST_SEED, Moment, Outcome, Player, Recorder, Replay
from tetris.history.replay_file import ReplayError, decode, encode, load, save

HELD = (Action.ROTATE_CW, Action.ROTATE_CCW, Action.HOLD)
INPUT = st.one_of(
    st.sampled_from(list(Action)),
    st.integers(1, 9_999_999).map(Gravity),
)


@st.composite
def moments(draw: st.DrawFn) -> tuple[Moment, ...]:
    waits = draw(st.lists(st.integers(0, 10**9), min_size=1, max_size=30))
    return tuple(
        Moment(
            sum(waits[: number + 1]),
            tuple(draw(st.lists(INPUT, max_size=4))),
            draw(st.booleans()),
            tuple(action for action in HELD if draw(st.booleans())),
        )
        for number in range(len(waits))
    )


CONFIGS = st.builds(
    Config,
    start_level=st.integers(1, 30),
    gravity_cap=st.integers(1, 20),
    lock_delay_s=st.floats(0.001, 100),
    lock_resets=st.none() | st.integers(0, 100),
    gravity=st.booleans(),
    lines_goal=st.none() | st.integers(1, 1000),
    time_limit_s=st.none() | st.floats(0.001, 1e4),
    board=st.sampled_from(["", "####.#####\n#########."]),
    kicks=st.sampled_from(["srs", "srs+"]),
    randomiser=st.sampled_from(["7-bag", "uniform"]),
)


def small() -> Replay:
    recorder = Recorder(7, Config(lines_goal=40), mode="sprint")
    recorder.update(0.0)
    recorder.update(0.4, [Action.LEFT, Gravity(400_000)], soft_drop=True)
    recorder.update(0.65, [Action.HARD_DROP], initial=[Action.HOLD])
    recorder.update(2.0)
    return recorder.replay()


def sealed(text: str) -> bytes:
    """Give a text the checksum that it would have if we had written it."""
    body = text.partition("sha256")[0]
    return f"{body}sha256 {hashlib.sha256(body.encode()).hexdigest()}\n".encode()


def test_a_file_is_a_few_lines_that_a_person_can_read() -> None:
    lines = encode(small()).decode().splitlines()
    assert lines[:4] == ["tetris-replay 1", f"rules {rules.VERSION}", "seed 7", "mode sprint"]
    assert "lines_goal 40" in lines
    assert "time_limit_s none" in lines
    assert "outcome 25 0 1 0" in lines
    assert lines[-2] == "0 400000lf400000S 250000Ds[h] 1350000[]"
    assert re.fullmatch("sha256 [0-9a-f]{64}", lines[-1])


@settings(max_examples=150)
@given(st.integers(0, 2**64 - 1), CONFIGS, moments(), st.integers(0, 10**9))
def test_round_trip(seed: int, config: Config, played: tuple[Moment, ...], rest_us: int) -> None:
    end_us = played[-1].time_us + rest_us
    replay = Replay(seed, config, "ultra_2", played, end_us, Outcome(1, 2, 3, True))
    assert decode(encode(replay)) == replay


def test_a_saved_game_is_loaded_and_played(tmp_path: Path) -> None:
    path = tmp_path / "games" / "one.tetris"
    save(path, small())
    player = Player(load(path))
    player.seek(player.end_s)
    assert player.game.pieces_placed == 1
    assert not player.differs
    assert [entry.name for entry in path.parent.iterdir()] == ["one.tetris"]


def test_an_hour_at_an_orbs_pace_takes_few_bytes() -> None:
    recorder = Recorder(1, Config(gravity=False, lock_resets=None))
    for number in range(3600):
        recorder.update(number * 1.013377, [Action.LEFT])
    assert len(encode(recorder.replay())) < 40_000


@settings(max_examples=300)
@given(st.binary(max_size=200))
def test_noise_is_refused(noise: bytes) -> None:
    with pytest.raises(ReplayError):
        decode(noise)


@settings(max_examples=300)
@given(st.data())
def test_a_file_with_any_byte_changed_is_refused(data: st.DataObject) -> None:
    content = bytearray(encode(small()))
    at = data.draw(st.integers(0, len(content) - 1))
    content[at] ^= data.draw(st.integers(1, 255))
    with pytest.raises(ReplayError):
        decode(bytes(content))


@given(st.integers(0, 400))
def test_a_file_that_was_cut_off_is_refused(cut: int) -> None:
    content = encode(small())
    with pytest.raises(ReplayError):
        decode(content[: max(0, len(content) - 1 - cut)])


@pytest.mark.parametrize(
    ("seed", "mode", "says"),
    [
        (-1, "", "seed -1 must be from 0 to 18446744073709551615"),
        (2**64, "", "seed 18446744073709551616 must be"),
        (1, "Foo", "mode 'Foo' must be up to 32 of a-z"),
        (1, "a" * 33, "must be up to 32"),
        (1, "a\n", "must be up to 32"),
    ],
)
def test_game_no_file_can_hold_is_refused(seed: int, mode: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=re.escape(says)):
        Recorder(seed, Config(), mode)
    replay = Replay(seed, Config(), mode, (Moment(0),), 0, Outcome(0, 0, 0, False))
    with pytest.raises(ReplayError):
        save(tmp_path / "game.tetris", replay)
    assert not list(tmp_path.iterdir())


def test_the_largest_game_that_a_file_can_hold_is_recorded_and_read() -> None:
    most = Config(start_level=10_000, lock_resets=10_000, soft_drop_factor=10_000, previews=100)
    recorder = Recorder(LAST_SEED, most, "a" * 32)
    recorder.update(0.0, [Action.RESTART] * 999)
    recorder.update(400 * 3600.0)
    assert decode(encode(recorder.replay())) == recorder.replay()


def test_every_whole_number_in_the_rules_has_a_bound_that_is_the_files_too() -> None:
    whole = [name for name, kind in get_type_hints(Config).items() if kind in (int, int | None)]
    for name in whole:
        with pytest.raises(ValueError):
            Config(**{name: 10**6})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"moments": ()}, "moments do not fit its head"),
        ({"moments": (Moment(5), Moment(4))}, "'-1' is no moment"),
        ({"moments": (Moment(-1),)}, "end cannot be '-1'"),
        ({"end_us": -1}, "end cannot be '-1'"),
        ({"end_us": 400 * 3_600_000_000 + 1}, "end cannot be"),
        ({"moments": (Moment(0, initial=(Action.LEFT,)),)}, "is no moment"),
        ({"moments": (Moment(0, initial=HELD[::-1]),)}, "is no moment"),
        ({"moments": (Moment(0, (Action.RESTART,) * 1000),)}, "1000 games at most; this .* 1001"),
        ({"moments": (Moment(0, (Action.LEFT,) * 1_000_001),)}, "1,000,000 inputs at most"),
        ({"outcome": Outcome(-1, 0, 0, False)}, "outcome cannot be '-1'"),
        ({"outcome": Outcome(0, 0, 2**64, False)}, "outcome cannot be"),
    ],
)
def test_a_replay_that_would_be_refused_is_not_saved(change: dict[str, Any], says: str) -> None:
    plain = Replay(1, Config(), "", (Moment(0),), 0, Outcome(0, 0, 0, False))
    assert decode(encode(plain)) == plain
    end_us = max((moment.time_us for moment in change.get("moments", ())), default=0)
    with pytest.raises(ReplayError, match=says):
        encode(replace(plain, **{"end_us": end_us, **change}))


@pytest.mark.slow
def test_a_million_changes_of_gravity_are_saved_and_read() -> None:
    moment = Moment(0, (Gravity(12),) * 1_000_000)
    replay = Replay(1, Config(), "", (moment,), 0, Outcome(0, 0, 0, False))
    assert decode(encode(replay)) == replay


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ({"guard_s": 0}, {"guard_s": 0.0}),
        ({"guard_s": -0.0}, {"guard_s": 0.0}),
        ({"time_limit_s": 120}, {"time_limit_s": 120.0}),
        ({"start_level": True}, {"start_level": 1}),
        ({"hold": 1}, {"hold": True}),
    ],
)
def test_equal_replays_have_equal_files(one: dict[str, Any], other: dict[str, Any]) -> None:
    first, second = (
        Replay(1, Config(**rules_), "", (Moment(0),), 0, Outcome(0, 0, 0, False))
        for rules_ in (one, other)
    )
    assert first == second
    assert encode(first) == encode(second)
    assert decode(encode(first)) == first


FORGED: list[tuple[Callable[[str], str], str]] = [
    (lambda t: t.replace("tetris-replay 1", "tetris-replay 2"), "form 2.* reads form 1"),
    (lambda t: t.replace("rules ", "rules 9"), "plays rules"),
    (lambda t: t.replace("seed 7", "seed -7"), "seed cannot be '-7'"),
    (lambda t: t.replace("seed 7", "seed " + "9" * 5000), "seed cannot be"),
    (lambda t: t.replace("seed 7", "seed \N{ARABIC-INDIC DIGIT SEVEN}"), "other than text"),
    (lambda t: t.replace("mode sprint", "mode ../../etc"), "must be up to 32"),
    (lambda t: t.replace("previews 5", "previews 5000"), "previews 5000 must be"),
    (lambda t: t.replace("rows 20", "rows 900"), "rows 900 must be from 4"),
    (lambda t: t.replace("lines_goal 40", "lines_goal 0"), "cannot be played"),
    (lambda t: t.replace("lock_delay_s 0.5", "lock_delay_s nan"), "lock_delay_s cannot be"),
    (lambda t: t.replace("lock_delay_s 0.5", "lock_delay_s 1e999"), "lock_delay_s cannot be"),
    (lambda t: t.replace("kicks srs", "kicks mine"), "cannot be played"),
    (lambda t: t.replace("board -", "board IIII"), "cannot be played"),
    (lambda t: t.replace("dig no", "dig maybe"), "dig cannot be 'maybe'"),
    (lambda t: t.replace("hold yes\n", ""), "stands where hold should"),
    (lambda t: t.replace("outcome 25 0 1 0", "outcome 36"), "not four numbers"),
    (lambda t: t.replace("moments 4", "moments 5"), "do not fit its head"),
    (lambda t: t.replace("end 2000000", "end 1999999"), "do not fit its head"),
    (lambda t: t.replace("end 2000000", "end 99999999999999999"), "end cannot be"),
    (lambda t: t.replace("250000Ds", "-250000Ds"), "is no moment"),
    (lambda t: t.replace("lf400000S", "lg12S"), "is no moment"),
    (lambda t: t.replace("f400000", "f0"), "is no moment"),
    (lambda t: t.replace("lf400000S", "lf12Z"), "is no moment"),
    (lambda t: t.replace("lf400000S", "l" * 1_000_001 + "S"), "1,000,000 inputs at most"),
    (
        lambda t: t.replace("lf400000S", "l" + "n" * 1000 + "S"),
        "1000 games at most; this one has 1001",
    ),
]


@pytest.mark.parametrize(("forge", "says"), FORGED)
def test_a_forged_file_is_refused_in_a_sentence(forge: Callable[[str], str], says: str) -> None:
    text = encode(small()).decode()
    forged = forge(text)
    assert forged != text
    with pytest.raises(ReplayError, match=says) as refused:
        decode(sealed(forged))
    assert "\n" not in str(refused.value)


def test_a_huge_file_is_refused_before_it_is_read_through() -> None:
    with pytest.raises(ReplayError, match="8 MB at most"):
        decode(b"tetris-replay 1\n" + b"0l " * 3_000_000)


@pytest.mark.parametrize("content", [b"", b"GIF89a", b"{}", b"\x00" * 100, b"tetris-replay"])
def test_another_programs_file_is_named_as_such(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "other.tetris"
    path.write_bytes(content)
    with pytest.raises(ReplayError, match="this is no replay of this game"):
        load(path)


def test_a_file_that_is_not_there_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(ReplayError, match=r"cannot read .*: No such file"):
        load(tmp_path / "none.tetris")
    with pytest.raises(ReplayError, match="cannot read"):
        load(tmp_path)
