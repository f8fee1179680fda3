"""The keyboard as a target: what comes over the link, and which strokes become of it."""

import os
from collections.abc import Iterable
from pathlib import Path

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import pytest

from controller.shared.errors import UserError
from controller.shared.keymap.key_state import Stroke
from controller.shared.keymap.keymap import KEYBOARD, parse
from controller.shared.protocol.messages import Command, Message, State, Telemetry
from host import targets
from host import window_loop as loop
from host.connection.receiver import Connected, Delivered, Lost, Received, Receiver, Refused, Stale
from host.connection.transport import LinkError
from host.injection.backends import BackendError
from host.injection.injector import PrintingSender
from host.targets import TargetOptions
from host.targets.keys import KeysTarget
from tests.support.fake_device import welcome

MAP = parse(
    {
        "everywhere": {"menu": {"arm": True}},
        "profile": {
            "game": {
                "left": "left",
                "down": {"key": "down", "mode": "hold"},
                "right": {"key": "right", "mode": "repeat"},
            },
            "desk": {"left": "pageup"},
        },
    },
    KEYBOARD,
)


class Wire(PrintingSender):
    """Takes strokes, and can fail."""

    def __init__(self) -> None:
        self.made: list[str] = []
        self.trouble = ""
        self.refusal = ""
        self.starts = 0
        self.running = True
        self.closed = False
        self.interrupted = False  # by a signal, when it has made the next strokes

    def start(self) -> str:
        self.starts += 1
        if self.refusal:
            raise BackendError(self.refusal)
        was_running, self.running = self.running, True
        return "" if was_running else "a wire"

    def send(self, strokes: Iterable[Stroke]) -> None:
        self.made += [f"{'+' if one.down else '-'}{one.key}" for one in strokes]
        if self.interrupted:
            self.interrupted = False
            raise SystemExit

    def check(self) -> str:
        trouble, self.trouble = self.trouble, ""
        self.running = self.running and not trouble
        return trouble

    def close(self) -> None:
        self.closed = True


class Bench:
    """A target with everything that it touches."""

    def __init__(self) -> None:
        self.wire = Wire()
        self.said: list[str] = []
        self.heard: list[bool] = []
        self.now_s = 0.0
        self.target = KeysTarget(MAP, self.wire, self.said.append, self.heard.append)
        self.tick(Connected(welcome()))

    def tick(self, *received: Received | Message) -> list[str]:
        """Let a hundredth of a second pass; return the strokes that were made."""
        self.now_s += 0.01
        news = [item if isinstance(item, Received) else Delivered(item, 0) for item in received]
        self.wire.made.clear()
        self.target.tick(self.now_s, news)
        return list(self.wire.made)

    def arm(self) -> None:
        self.tick(said("menu"))
        assert self.target.keys.armed


def said(name: str) -> Command:
    return Command(name, "press", 0.99, None, 1)


def felt(gesture: str) -> Telemetry:
    return Telemetry(1, bytes([128] * 25), (1.0, 0, 0, 0, 0), None, gesture, True, 10.0)


def test_it_begins_disarmed_and_a_gesture_arms_it_with_a_line_and_a_sound() -> None:
    bench = Bench()
    assert bench.tick(said("left")) == []
    assert bench.tick(said("menu"), said("left")) == ["+left"]
    assert bench.said == ["armed by the orb: profile game"]
    assert bench.heard == [True]


def test_hot_key_arms_disarms_and_changes_the_profile() -> None:
    bench = Bench()
    for key in ("f9", "f8"):
        bench.target.hot_key(key)
    assert bench.tick(said("left")) == ["+pageup"]
    bench.target.hot_key("f9")
    assert bench.tick(said("left")) == ["-pageup"]
    assert bench.said == ["armed by hand: profile game", "profile desk", "disarmed by hand"]


@pytest.mark.parametrize("end", [State(()), felt(""), Stale(), Lost("gone"), said("menu")])
def test_held_key_goes_up(end: Received | Message) -> None:
    bench = Bench()
    bench.arm()
    assert bench.tick(said("down"), State(("down",)), felt("press")) == ["+down"]
    assert bench.tick(felt("press")) == []
    assert bench.tick(end) == ["-down"]


def test_silence_keeps_it_armed_and_a_lost_link_does_not() -> None:
    bench = Bench()
    bench.arm()
    bench.tick(Stale())
    assert bench.target.keys.armed
    bench.tick(Lost("port: nothing came for 1 s"), Refused("busy"), Connected(welcome()))
    assert not bench.target.keys.armed
    assert bench.said[-1] == "disarmed because the link is gone: port: nothing came for 1 s"
    assert bench.tick(said("left")) == []


def test_trouble_of_the_watchdog_disarms_and_arming_starts_it_again() -> None:
    bench = Bench()
    bench.arm()
    bench.tick(said("down"))
    bench.wire.trouble = "with every key up: the watchdog has died"
    assert bench.tick() == []  # whoever noticed it has lifted the key
    assert not bench.target.keys.armed
    assert bench.said[-1] == "disarmed with every key up: the watchdog has died"
    starts = bench.wire.starts
    bench.arm()
    assert bench.wire.starts > starts


def test_what_comes_with_the_arming_is_dropped_if_the_watchdog_had_to_start() -> None:
    bench = Bench()
    bench.wire.running = False
    assert bench.tick(said("menu"), said("left")) == []
    assert bench.target.keys.armed
    assert bench.tick() == []
    assert bench.tick(said("left")) == ["+left"]


def test_a_repeat_does_not_go_on_after_the_program_stood_still() -> None:
    bench = Bench()
    bench.arm()
    bench.tick(said("right"), State(("right",)))
    while bench.target.keys.down:
        bench.tick(felt("press"))
    bench.now_s += 0.3
    assert bench.tick(felt("press")) == []
    for _ in range(100):
        assert bench.tick(felt("press")) == []


def test_watchdog_that_does_not_start_again_leaves_it_disarmed() -> None:
    bench = Bench()
    bench.wire.refusal = "there is no /dev/uinput"
    assert bench.tick(said("menu"), said("left")) == []
    assert not bench.target.keys.armed
    assert bench.said[-1] == "disarmed because no key can be pressed: there is no /dev/uinput"


def test_command_of_the_mapping_that_no_orb_has_is_told_once() -> None:
    misspelt = parse({"profile": {"game": {"laft": "left", "menu": {"arm": True}}}}, KEYBOARD)
    said: list[str] = []
    target = KeysTarget(misspelt, Wire(), said.append, lambda armed: None)
    target.tick(0.0, [Connected(welcome())])
    target.tick(0.1, [Connected(welcome())])
    [line] = said
    assert line.startswith("the orb has no command laft, which the mapping names; it has: left, ")


def test_end_lifts_everything() -> None:
    bench = Bench()
    bench.arm()
    bench.tick(said("down"))
    bench.target.close()
    bench.target.close()
    assert bench.wire.made == ["+down", "-down"]
    assert bench.wire.closed
    assert bench.heard == [True, False]


def test_end_in_the_middle_of_a_stroke_makes_none_twice() -> None:
    bench = Bench()
    bench.arm()
    bench.wire.interrupted = True
    with pytest.raises(SystemExit):
        bench.tick(said("down"))
    bench.target.close()
    assert bench.wire.made == ["+down", "-down"]


class FakeReceiver(Receiver):
    def __init__(self, *news: list[Received]) -> None:
        self.news = list(news)

    def poll(self) -> list[Received]:
        return self.news.pop(0) if self.news else []

    def send(self, message: Message) -> bool:
        return True

    def wait(self, timeout_s: float) -> None:
        pass


def test_without_a_window_it_acts_until_its_time_is_up() -> None:
    bench = Bench()
    news = FakeReceiver([Connected(welcome())], [Delivered(said("menu"), 0)])
    clock = iter(range(100))
    loop.serve(bench.target, news, seconds=0.5, clock=lambda: next(clock) / 10)
    assert bench.target.keys.armed


def test_without_a_window_a_first_connection_that_fails_is_the_end() -> None:
    with pytest.raises(LinkError, match="COM7 is busy"):
        loop.serve(Bench().target, FakeReceiver([Refused("COM7 is busy")]))


def test_mapping_or_back_end_that_cannot_be_used_is_one_sentence(tmp_path: Path) -> None:
    keys = tmp_path / "keys.toml"
    keys.write_text('[profile.a]\nleft = "lefft"')
    for name, options, status, words in (
        ("keyboard", TargetOptions(mapping=keys), 2, "line 2 .*there is no key 'lefft'"),
        ("gamepad", TargetOptions(backend="x11"), 1, "x11 has no pads"),
    ):
        with pytest.raises(UserError, match=words) as refused:
            targets.load(name, options)
        assert refused.value.status == status
        assert "\n" not in str(refused.value)
