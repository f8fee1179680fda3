"""From the link to the key, on a clock of our own, cut, hung and killed at any moment."""

import os
from collections.abc import Iterable

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from controller.shared.keymap.key_state import Stroke
from controller.shared.keymap.keymap import KEYBOARD, parse
from controller.shared.protocol.messages import Command, Message, State, Telemetry
from host.connection.receiver import Connected, Delivered, Lost, Received, Refused, Stale
from host.injection.backends import Backend
from host.injection.injector import PrintingSender
from host.injection.watchdog import HANG_MS, Watchdog
from host.targets.keys import KeysTarget
from tests.support.fake_device import welcome

MAP = parse(
    {
        "everywhere": {"menu": {"arm": True}, "pause": {"profile": "desk"}},
        "profile": {
            "game": {
                "left": "left",
                "down": {"key": "down", "mode": "hold"},
                "drop": {"key": "space", "mode": "repeat"},
                "hold": {"key": "shift", "mode": "toggle"},
            },
            "desk": {"left": "ctrl+pageup", "pause": {"profile": "game"}},
        },
    },
    KEYBOARD,
)
COMMANDS = (*MAP.profiles["game"], "unheard_of")


class Board(Backend):
    """A keyboard as the kernel sees it."""

    def __init__(self) -> None:
        self.down: set[str] = set()

    def set(self, key: str, *, down: bool) -> None:
        assert not (down and key in self.down)
        (self.down.add if down else self.down.discard)(key)

    def close(self) -> None:
        assert not self.down


class Pipe(PrintingSender):
    """The two ends of the watchdog's pipe in one process, on one clock."""

    def __init__(self, board: Board, now_ms: int) -> None:
        self.now_ms = now_ms
        self.dead = False
        self._board, self._answers = board, [""]
        self._guard = Watchdog(board, MAP.keys, now_ms)

    def start(self) -> str:
        if not self.dead:
            return ""
        self.dead = False
        self._guard = Watchdog(self._board, MAP.keys, self.now_ms)
        return "a pipe"

    def send(self, strokes: Iterable[Stroke]) -> None:
        for stroke in strokes:
            self._write(f"{'d' if stroke.down else 'u'} {self.now_ms} {stroke.key}")

    def check(self) -> str:
        self._write(f"b {self.now_ms}")
        told = [a.partition(" ")[2] for a in self._answers if a.startswith("released")]
        if told:
            self._write(f"c {self.now_ms}")
        elif self.dead and self._board.down:
            self._board.down.clear()  # as the kernel, or the spare keyboard, would
            told = ["the watchdog has died"]
        self._answers.clear()
        return told[0] if told else ""

    def close(self) -> None:
        self._guard.release()

    def pass_ms(self, passed_ms: int) -> None:
        """Let time pass for the watchdog alone."""
        self.now_ms += passed_ms
        if not self.dead:
            self._answers.append(self._guard.tick(self.now_ms))

    def _write(self, line: str) -> None:
        if not self.dead:
            self._answers.append(self._guard.line(line, self.now_ms))


class AnyMoment(RuleBasedStateMachine):
    """A player, a link, a program and its watchdog."""

    @initialize()
    def begin(self) -> None:
        self.board = Board()
        self.now_ms = 0
        self.start()

    def start(self) -> None:
        self.pipe = Pipe(self.board, self.now_ms)
        self.target = KeysTarget(MAP, self.pipe, lambda line: None, lambda armed: None)

    def take(self, *received: Received | Message) -> None:
        news = [item if isinstance(item, Received) else Delivered(item, 0) for item in received]
        self.target.tick(self.now_ms / 1000, news)

    def wait(self, passed_ms: int) -> None:
        self.now_ms += passed_ms
        self.pipe.pass_ms(passed_ms)

    @rule(name=st.sampled_from(COMMANDS), held=st.booleans())
    def command(self, name: str, held: bool) -> None:
        self.take(Command(name, "press", 0.9, None, 1), State((name,) if held else ()))

    @rule(held=st.sets(st.sampled_from(COMMANDS), max_size=2))
    def snapshot(self, held: set[str]) -> None:
        before = set(self.board.down)
        self.take(State(tuple(held)))
        typed = {"shift", "a", "b", "space"}  # what an earlier command still does
        assert self.board.down <= before | typed

    @rule(gesture=st.sampled_from(("", "press")))
    def frame(self, gesture: str) -> None:
        self.take(Telemetry(1, bytes([128] * 25), (1.0, 0, 0, 0, 0), None, gesture, True, 10.0))

    @rule(cut=st.sampled_from((Stale(), Lost("gone"), Refused("busy"), Connected(welcome()))))
    def cut(self, cut: Received) -> None:
        self.take(cut)
        assert not self.board.down
        assert not (isinstance(cut, Lost | Refused) and self.target.keys.armed)

    @rule(key=st.sampled_from(("f9", "f8", "x")))
    def hot_key(self, key: str) -> None:
        self.target.hot_key(key)
        self.take()
        assert key == "x" or not self.board.down

    @rule(ticks=st.integers(1, 30))
    def play_on(self, ticks: int) -> None:
        for _ in range(ticks):
            self.wait(17)
            self.take()

    @rule(passed_ms=st.integers(HANG_MS, 5000), name=st.sampled_from(COMMANDS))
    def hang(self, passed_ms: int, name: str) -> None:
        was_down = bool(self.board.down)
        self.wait(passed_ms)
        assert not self.board.down
        self.take()
        assert not (was_down and self.target.keys.armed)

    @rule()
    def kill_the_program(self) -> None:
        self.pipe.close()  # the watchdog sees the end of its input
        assert not self.board.down
        self.start()

    @rule()
    def kill_the_watchdog(self) -> None:
        was_down = bool(self.board.down)
        self.pipe.dead = True
        self.take()
        assert not was_down or not (self.board.down or self.target.keys.armed)

    @rule()
    def end(self) -> None:
        self.target.close()
        assert not self.board.down
        self.start()

    @invariant()
    def only_what_is_named_is_down_and_nothing_while_disarmed(self) -> None:
        assert self.board.down <= MAP.keys
        assert self.board.down == set(self.target.keys.down)
        assert self.target.keys.armed or not self.board.down


TestAnyMoment = AnyMoment.TestCase
TestAnyMoment.settings = settings(max_examples=50, stateful_step_count=40, deadline=None)
