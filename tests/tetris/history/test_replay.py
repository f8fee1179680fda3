"""Replays: the same game again, to any moment of it, and on from there."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tetris.engine.events import Locked, Spawned
from tetris.engine.game import Action, Config, Gravity
from tetris.history.replay import Moment, Outcome, Player, Recorder, Replay

Steps = list[tuple[float, list[Action], bool, set[Action]]]
WAIT_S = st.integers(0, 3_000_000_000).map(lambda ns: ns / 1e9)  # finer than a replay's clock
INPUT = st.one_of(
    st.sampled_from(list(Action)),
    st.integers(1, 9_999_999).map(Gravity),
)
HELD = st.sets(st.sampled_from([Action.ROTATE_CW, Action.ROTATE_CCW, Action.HOLD]), max_size=2)
STEPS = st.lists(st.tuples(WAIT_S, st.lists(INPUT, max_size=3), st.booleans(), HELD), max_size=40)
CONFIGS = st.sampled_from(
    [
        Config(),
        Config(start_level=18, undo=True),
        Config(gravity=False, lock_resets=None, undo=True),
        Config(lines_goal=1, columns=4, rows=8, randomiser="uniform", kicks="srs+"),
        Config(time_limit_s=5.0, generation_delay_s=0.2, guard_s=0.3),
        Config(dig=True, board="####.#####\n.#########"),
    ]
)


def played(config: Config, steps: Steps) -> Replay:
    recorder = Recorder(3, config)
    now_s = 1.0
    recorder.update(now_s)
    for wait_s, inputs, soft_drop, held in steps:
        now_s += wait_s
        recorder.update(now_s, inputs, soft_drop=soft_drop, initial=held)
    return recorder.replay()


def short_game() -> Recorder:
    recorder = Recorder(5, Config(start_level=3), mode="marathon")
    recorder.update(0.0)
    for number in range(1, 27):
        action = (Action.LEFT, Action.ROTATE_CW, Action.RIGHT, Action.HARD_DROP)[number % 4]
        recorder.update(number * 0.7, [action])
    return recorder


@settings(max_examples=60)
@given(CONFIGS, STEPS)
def test_a_replay_gives_the_same_events_as_the_game(config: Config, steps: Steps) -> None:
    recorder = Recorder(3, config, mode="zen")
    now_s, events = 1.25, recorder.update(1.25)
    for wait_s, inputs, soft_drop, held in steps:
        now_s += wait_s
        events += recorder.update(now_s, inputs, soft_drop=soft_drop, initial=held)
    player = Player(recorder.replay())
    assert player.first_events + player.advance(1e9) == events
    assert player.game.snapshot() == recorder.game.snapshot()
    assert player.at_end
    assert not player.differs


@settings(max_examples=60)
@given(CONFIGS, STEPS, st.lists(st.floats(0, 130), min_size=1, max_size=6))
def test_a_seek_comes_to_where_playing_would_have_come(
    config: Config, steps: Steps, times_s: list[float]
) -> None:
    replay = played(config, steps)
    player = Player(replay)
    for time_s in times_s:  # there and back again
        player.seek(time_s)
        fresh = Player(replay)
        fresh.advance(time_s)
        assert player.time_s == fresh.time_s
        assert player.game.snapshot() == fresh.game.snapshot()


def test_only_what_the_player_did_is_kept() -> None:
    recorder = Recorder(1)
    for frame in range(600):  # ten seconds at sixty frames a second
        recorder.update(frame / 60, [Action.LEFT] if frame == 90 else ())
    assert recorder.replay().moments == (Moment(0), Moment(1_500_000, (Action.LEFT,)))
    assert recorder.replay().end_us == 9_983_333


def test_times_are_played_to_the_microsecond_that_is_kept() -> None:
    recorder = Recorder(1)
    recorder.update(0.000_000_4)
    (spawned,) = [e for e in recorder.update(0.1, [Action.HARD_DROP]) if isinstance(e, Spawned)]
    assert spawned.time_s == 0.1
    assert recorder.replay().moments[0].time_us == 0


def test_what_is_held_down_is_kept_as_it_changes() -> None:
    log = Recorder(1)
    log.update(0.0)
    log.update(1.0, soft_drop=True, initial={Action.HOLD, Action.ROTATE_CW})
    log.update(2.0, soft_drop=True, initial=[Action.ROTATE_CW, Action.HOLD])
    log.update(3.0)
    held = (Action.ROTATE_CW, Action.HOLD)
    assert log.replay().moments == (Moment(0), Moment(1_000_000, (), True, held), Moment(3_000_000))


def test_a_replay_with_another_outcome_than_it_says_is_noticed() -> None:
    replay = short_game().replay()
    boast = replace(replay, outcome=Outcome(999_999, 40, 15, True))
    player = Player(boast)
    assert not player.differs  # nobody knows yet
    player.seek(player.end_s)
    assert player.differs


def test_playing_on_from_a_position_keeps_what_was_before() -> None:
    recorder = short_game()
    old = Player(recorder.replay())
    old.seek(16.0)
    pieces = old.game.pieces_placed
    again = old.take_over()
    assert again.time_s == 16.0
    events = again.update(16.5, [Action.HARD_DROP])
    assert [event for event in events if isinstance(event, Locked)]
    assert again.game.pieces_placed > pieces
    assert old.game.pieces_placed == pieces  # the replay's own game stays where it was

    both = Player(again.replay())
    both.seek(again.time_s)
    assert both.game.snapshot() == again.game.snapshot()
    assert both.replay.moments[: old.moments_played] == old.replay.moments[: old.moments_played]


def test_a_player_goes_no_further_than_the_end() -> None:
    recorder = short_game()
    player = Player(recorder.replay())
    player.advance(1e6)
    assert player.time_s == player.end_s == recorder.time_s
    assert player.advance(1e7) == []
    player.seek(-5.0)
    assert player.time_s == player.start_s


def test_nothing_played_is_no_replay() -> None:
    with pytest.raises(ValueError, match="nothing has been played"):
        Recorder(1).replay()


def test_a_clock_below_zero_is_refused() -> None:
    with pytest.raises(ValueError, match="0 s or later"):
        Recorder(1).update(-1.0)


def test_an_older_recording_of_a_turn_held_and_pressed_turns_twice_as_it_did() -> None:
    recorder = Recorder(3)
    recorder.update(0.0)
    held = [Action.ROTATE_CW]
    recorder.update(0.5, [Action.HARD_DROP], initial=held)  # as the window once recorded it
    recorder.update(0.5, [Action.ROTATE_CW], initial=held)
    player = Player(recorder.replay())
    player.advance(player.end_s)
    assert (player.game.piece.turn, player.differs) == (2, False)
