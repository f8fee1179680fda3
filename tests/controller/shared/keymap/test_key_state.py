"""Held keys on a simulated clock, by scripts and in any order of events."""

from collections.abc import Callable

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from controller.shared.keymap.key_names import danger
from controller.shared.keymap.key_state import SILENCE_S, KeyState
from controller.shared.keymap.keymap import KEYBOARD, KeyMap, parse

MAP = parse(
    {
        "allow": ["meta+d"],
        "everywhere": {"menu": {"arm": True}, "pause": {"profile": "desk"}},
        "profile": {
            "game": {
                "left": "left",
                "right": "shift+left",
                "down": {"key": "down", "mode": "hold"},
                "drop": {"key": "space", "mode": "repeat", "down_ms": 50, "every_ms": 200},
                "hold": {"key": "shift", "mode": "toggle"},
                "rotate_cw": {"key": "alt", "mode": "toggle"},
                "rotate_ccw": "f4",
                "desk": {"key": "meta+d", "mode": "hold"},
            },
            "desk": {"left": "pageup", "pause": {"profile": "game"}},
        },
    },
    KEYBOARD,
)


def armed(key_map: KeyMap = MAP) -> KeyState:
    pressed = KeyState(key_map)
    pressed.arm("by the test")
    return pressed


def strokes(pressed: KeyState) -> str:
    """Return what has been done since the last call, as in "+a -a"."""
    made = " ".join(f"{'+' if one.down else '-'}{one.key}" for one in pressed.strokes)
    pressed.strokes.clear()
    return made


def test_nothing_is_pressed_until_it_is_armed() -> None:
    pressed = KeyState(MAP)
    pressed.command("left", 0.0)
    assert strokes(pressed) == ""
    pressed.command("menu", 1.0)
    pressed.command("left", 2.0)
    assert strokes(pressed) == "+left"
    assert pressed.notes == ["armed by the orb: profile game"]


HELD = parse(
    {
        "profile": {"game": {"drop": "space"}, "desk": {"drop": "a"}},
        "long": {"drop": {"arm": True}, "hold": {"profile": "desk"}},
    },
    KEYBOARD,
)


def hold(pressed: KeyState, name: str, began_s: float, until_s: float) -> None:
    """Give a command, and say ten times a second that it is still held."""
    pressed.command(name, began_s)
    for tenth in range(round(began_s * 10) + 1, round(until_s * 10) + 1):
        pressed.state((name,), tenth / 10)


def let_go(pressed: KeyState, now_s: float) -> None:
    pressed.state((), now_s)


def test_long_hold_arms_and_the_next_one_disarms() -> None:
    pressed = KeyState(HELD)
    hold(pressed, "drop", 1.0, 2.4)
    let_go(pressed, 2.45)
    assert not pressed.armed
    hold(pressed, "drop", 3.0, 9.0)
    let_go(pressed, 9.1)
    assert pressed.notes == ["armed by the orb: profile game"]
    assert strokes(pressed) == ""
    hold(pressed, "drop", 10.0, 19.0)
    assert strokes(pressed) == "+space -space"  # it is still a command, and taps first
    assert pressed.notes[1:] == ["disarmed by the orb"]


def test_long_hold_changes_the_profile() -> None:
    pressed = KeyState(HELD)
    hold(pressed, "hold", 1.0, 2.5)
    assert pressed.profile == "desk"


def test_hold_that_ends_or_falls_silent_does_nothing_long() -> None:
    pressed = KeyState(HELD)
    hold(pressed, "drop", 1.0, 2.0)
    let_go(pressed, 2.1)
    hold_again = KeyState(HELD)
    hold(hold_again, "drop", 1.0, 1.2)
    hold_again.tick(1.2 + SILENCE_S)  # the orb has fallen silent
    silent = KeyState(HELD)
    hold(silent, "drop", 1.0, 2.0)
    silent.release()  # as when the link is stale
    for one in (pressed, hold_again, silent):
        for tenth in range(21, 90):
            one.state(("drop",), tenth / 10)  # a word alone presses and arms nothing
        assert not one.armed


def told(pressed: KeyState, line: str) -> str:
    """Play a line, and return the strokes: seconds, a colon, and what happens then.

    A name is a command, "tick" passes time, "word" says that what was held still is, and names in
    brackets are all that is held.
    """
    for moment in line.split(", "):
        now, _, what = moment.partition(": ")
        now_s = float(now)
        if what == "tick":
            pressed.tick(now_s)
        elif what == "word":
            pressed.still_held(now_s)
        elif what.startswith("["):
            pressed.state(tuple(what.strip("[]").split()), now_s)
        else:
            pressed.command(what, now_s)
    return strokes(pressed)


WORDS = ", ".join(f"{hundredth / 100}: word" for hundredth in range(101, 141))


@pytest.mark.parametrize(
    ("line", "made"),
    [
        ("1.0: left, 1.04: tick", "+left"),
        ("1.0: left, 1.05: tick", "+left -left"),  # a tap goes up by itself
        ("1.0: left, 1.01: left", "+left -left +left"),  # a second tap is a second press
        ("1.0: [down]", ""),  # a snapshot never presses
        ("1.0: drop, 1.9: word", "+space -space +space"),  # a pause of ours is not made up for
        ("1.0: hold, 1.1: right, 1.2: tick", "+shift +left -left"),  # both hold shift
        ("1.0: hold, 1.1: right, 1.2: tick, 1.3: hold", "+shift +left -left -shift"),
        ("1.0: desk, 1.1: left", "+meta +d"),  # an allowed chord allows no key beside it
        (f"1.0: hold, {1.0 + SILENCE_S}: tick", "+shift -shift"),  # the orb fell silent
        (f"1.0: down, {1.0 + SILENCE_S}: tick", "+down -down"),
        (f"1.0: down, 1.0: [down], {WORDS}", "+down"),  # until the orb says that it is let go
        (f"1.0: down, 1.0: [down], {WORDS}, 1.5: []", "+down -down"),
        (f"1.0: drop, {WORDS}, 1.41: tick", "+space -space +space -space +space"),
        (f"1.0: drop, {WORDS}, 1.41: []", "+space -space +space -space +space -space"),
        ("1.0: hold, 1.9: [], 2.8: [], 3.7: []", "+shift"),  # until the next time
        ("1.0: hold, 1.9: [], 2.8: [], 3.0: hold", "+shift -shift"),
    ],
)
def test_commands_snapshots_and_time_press_keys(line: str, made: str) -> None:
    assert told(armed(), line) == made


def test_two_commands_cannot_make_a_chord_that_neither_may() -> None:
    pressed = armed()
    pressed.command("rotate_cw", 1.0)
    pressed.command("rotate_ccw", 1.5)
    assert strokes(pressed) == "+alt"
    assert pressed.notes[-1] == "rotate_ccw was dropped: with what is down it would make alt+f4"


def test_disarming_and_another_profile_lift_everything() -> None:
    ends: tuple[Callable[[KeyState], None], ...] = (
        lambda p: p.disarm("now"),
        lambda p: p.switch("desk"),
        lambda p: p.command("menu", 1.1),
        lambda p: p.command("pause", 1.1),
        lambda p: p.switch(),
        lambda p: p.release(),
    )
    for end in ends:
        pressed = armed()
        pressed.command("hold", 1.0)
        pressed.command("down", 1.0)
        end(pressed)
        pressed.tick(100.0)
        assert strokes(pressed) == "+shift +down -down -shift"


def test_profiles_have_keys_of_their_own() -> None:
    pressed = armed()
    pressed.command("pause", 1.0)
    pressed.command("left", 1.0)
    assert strokes(pressed) == "+pageup"
    pressed.switch()
    assert pressed.profile == "game"


COMMANDS = (*MAP.profiles["game"], "unheard_of")


class AnyMoment(RuleBasedStateMachine):
    """Commands, snapshots, arming, profiles, losses and time in any order."""

    @initialize()
    def begin(self) -> None:
        self.pressed = KeyState(MAP)
        self.now_s = 0.0
        self.down: set[str] = set()  # as the kernel would see it
        self.asked: set[str] = set()  # by commands since the keys were all up

    def follow(self, *, lifted: bool = False) -> None:
        for stroke in self.pressed.strokes:
            assert stroke.down is (stroke.key not in self.down), "a stroke that changes nothing"
            if stroke.down:
                assert self.pressed.armed
                assert stroke.key in MAP.keys
                self.down.add(stroke.key)
                assert not danger(self.down, MAP.allowed)
            else:
                self.down.remove(stroke.key)
        self.pressed.strokes.clear()
        assert not (lifted and self.down)

    @rule(name=st.sampled_from(COMMANDS))
    def command(self, name: str) -> None:
        self.pressed.command(name, self.now_s)
        self.follow(lifted=name in ("pause",))

    @rule(held=st.sets(st.sampled_from(COMMANDS)))
    def snapshot(self, held: set[str]) -> None:
        before = set(self.down)
        self.pressed.state(held, self.now_s)
        self.follow()
        repeated = {"space"} | {"shift", "a", "b"}  # by time alone, after an earlier command
        assert self.down <= before | repeated

    @rule(passed_s=st.sampled_from((0.001, 0.02, 0.06, 0.3, 5.0)))
    def time(self, passed_s: float) -> None:
        self.now_s += passed_s
        self.pressed.tick(self.now_s)
        self.follow()

    @rule()
    def word(self) -> None:
        self.pressed.still_held(self.now_s)
        self.follow()

    @precondition(lambda self: not self.pressed.armed)
    @rule()
    def arm(self) -> None:
        self.pressed.arm("by hand")
        self.follow(lifted=True)

    @rule()
    def disarm(self) -> None:
        self.pressed.disarm("by hand")
        self.follow(lifted=True)

    @rule()
    def change_profile(self) -> None:
        self.pressed.switch()
        self.follow(lifted=True)

    @rule()
    def lose_the_link(self) -> None:
        self.pressed.release()
        self.follow(lifted=True)

    @invariant()
    def what_it_knows_is_what_is_down(self) -> None:
        assert set(self.pressed.down) == self.down
        assert self.pressed.armed or not self.down

    def teardown(self) -> None:
        self.pressed.disarm("at the end")
        self.follow(lifted=True)


TestAnyMoment = AnyMoment.TestCase
TestAnyMoment.settings = settings(max_examples=60, stateful_step_count=40, deadline=None)


def test_a_chord_whose_keys_are_held_releases_its_last_key_for_a_moment() -> None:
    pressed = KeyState(MAP, gap_s=0.02)
    pressed.arm("by the test")
    for name in ("hold", "left", "right"):  # shift, left, and both
        pressed.command(name, 0.0)
    assert strokes(pressed) == "+shift +left -left"
    pressed.tick(0.02)
    assert strokes(pressed) == "+left"
