"""The target that acts outside our own window: commands become keys of a keyboard or a pad.

`KeysTarget.tick` is the core; it needs no window and no clock. It begins disarmed.
"""

import contextlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import pygame

from controller.keymap.key_state import KeyState
from controller.keymap.keymap import Arm, KeyMap, Kind
from controller.keymap.keymap_file import read
from controller.keymap.terminal import Keyboard, keyboard
from controller.keymap.terminal_decoder import Action, KeyEvent
from controller.protocol.messages import (
    COMMANDS,
    Command,
    Health,
    Message,
    State,
    Telemetry,
    UserIdentified,
    Welcome,
)
from host.connection.receiver import Connected, Delivered, Lost, Received, Refused, Stale
from host.injection.backends import BackendError
from host.injection.injector import DryRunInjector, Injector, Sender
from host.injection.watchdog import HANG_MS
from host.targets import TargetOptions
from host.ui.key_window import SIZE, OrbWindow
from host.ui.orb_state import OrbState
from host.ui.pointer_input import DomeArea

Say = Callable[[str], None]


class KeysTarget:
    """The keys, the orb that presses them, and whatever makes the strokes.

    Attributes:
        pressed: What is down, and whether it is armed.
    """

    size: Final = SIZE

    def __init__(
        self, key_map: KeyMap, sender: Sender, say: Say, sound: Callable[[bool], None]
    ) -> None:
        """Begin disarmed.

        Args:
            key_map: What commands do.
            sender: Where strokes go; it has been started.
            say: Takes a line for the user.
            sound: Lets the user hear that it was armed (True), or disarmed.
        """
        self.pressed = KeyState(key_map)
        self._terminal: Keyboard | None = None
        self._resources = contextlib.ExitStack()  # the terminal, until the end
        self._map, self._sender, self._say, self._sound = key_map, sender, say, sound
        self._window = OrbWindow()
        self._unknown: list[str] = []  # commands of the mapping that the orb has not
        self._now_s = 0.0
        self._closed = False

    @property
    def orb(self) -> OrbState:
        """What is known of the orb."""
        return self._window.orb

    # -- the core ----------------------------------------------------------------------

    def tick(self, now_s: float, received: Sequence[Received] = ()) -> None:
        """Let time pass, take what came over the link, and press what it asks for."""
        stood_s, self._now_s = now_s - self._now_s, now_s
        was_armed = self.pressed.armed
        if stood_s >= HANG_MS / 1000:  # a text or a repeat must not go on after a pause
            self.pressed.release()
        if trouble := self._sender.check():
            self._fail(trouble)
        for _, event in self._terminal.poll() if self._terminal else ():
            if isinstance(event, KeyEvent) and event.action is not Action.RELEASED:
                self.hot_key(event.key)
        for item in received:
            self._take(item, now_s)
        self.pressed.tick(now_s)
        if self.pressed.armed:
            self._ready()
        self._tell(was_armed)
        self._make_strokes()
        self.orb.advance(now_s)

    def read_terminal(self) -> None:
        """Take keys of the terminal as well, until `close`; in the main thread only."""
        self._terminal = self._resources.enter_context(keyboard())

    def hot_key(self, key: str) -> None:
        """Take a key of our own window or terminal."""
        if key == self._map.arm_key:
            if self.pressed.armed:
                self.pressed.disarm("by hand")
            else:
                self.pressed.arm("by hand")
        elif key == self._map.profile_key:
            self.pressed.switch_on()

    def close(self) -> None:
        """Let go of everything, for good."""
        if self._closed:
            return
        self._closed, was_armed = True, self.pressed.armed
        try:
            self.pressed.disarm("at the end")
            self._make_strokes()
        finally:
            self._sender.close()
            self._resources.close()
        if trouble := self._sender.check():
            self._say(f"disarmed {trouble}")
        self._tell(was_armed)

    def _take(self, item: Received, now_s: float) -> None:
        """Take what came over the link."""
        match item:
            case Connected(welcome=welcome):
                self.pressed.release()
                self._note_unknown(welcome)
                self.orb.connected(welcome)
                self._window.touch.lift_all()
                self._window.touch.pad = DomeArea(welcome.rows, welcome.columns, welcome.pitch_mm)
            case Stale():
                if self.pressed.down:
                    self._say("the orb is silent: every key is up")
                self.pressed.release()
                self.orb.silent("stale", "the orb is silent")
                self._window.touch.lift_all()
            case Lost(reason=reason) | Refused(reason=reason):
                self.pressed.disarm(f"because the link is gone: {reason}")
                self.orb.silent("lost", reason)
                self._window.touch.lift_all()
            case Delivered(message=message):
                self.orb.heard()
                self._message(message, now_s)

    def _note_unknown(self, welcome: Welcome) -> None:
        """Say which commands of the mapping no orb has, this one included: they are misspelt."""
        unknown = sorted(self._map.commands.difference(COMMANDS, ("menu",), welcome.commands))
        if unknown and unknown != self._unknown:
            self._say(
                f"the orb has no command {', '.join(unknown)}, which the mapping names; "
                f"it has: {', '.join(welcome.commands)}"
            )
        self._unknown = unknown

    def _message(self, message: Message, now_s: float) -> None:
        match message:
            case Command():
                self.orb.command(message, now_s)
                self.pressed.command(message.name, now_s)
            case State(pressed=held):
                self.pressed.state(held, now_s)
            case Health(found=found):
                self.orb.health = found
            case UserIdentified():
                self.orb.who(message)
            case Telemetry():
                self.orb.telemetry(message, now_s)
                if message.gesture:
                    self.pressed.word(now_s)
                else:  # the wire may have lost the State that said so
                    self.pressed.state((), now_s)

    def _make_strokes(self) -> None:
        # Taken first: a signal may end us in the middle, and none may be made twice.
        strokes, self.pressed.output = self.pressed.output, []
        self._sender.send(strokes)

    def _ready(self) -> None:
        """Start what presses the keys, if it does not run."""
        try:
            started = self._sender.start()
        except BackendError as error:
            self._fail(f"because no key can be pressed: {error}")
        else:
            if started:  # that took time, so what came with the arming is too late
                self.pressed.release()
                self.pressed.output.clear()

    def _fail(self, trouble: str) -> None:
        """Disarm without a stroke: the sender has released what it could."""
        self.pressed.disarm(trouble)
        self.pressed.output.clear()

    def _tell(self, was_armed: bool) -> None:
        for line in self.pressed.told:
            self._say(line)
        self.pressed.told.clear()
        if self.pressed.armed is not was_armed:
            self._sound(self.pressed.armed)

    # -- the window --------------------------------------------------------------------

    def handle(self, event: pygame.event.Event, now_s: float) -> None:
        """Take one event of the window."""
        if event.type == pygame.KEYDOWN:
            self.hot_key(pygame.key.name(event.key))
        self._window.handle(event, now_s)

    def outgoing(self, now_s: float) -> list[Message]:
        """Return the contacts that a virtual orb has to be told of now, if any."""
        return self._window.outgoing(now_s)

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the orb, and whether it is armed."""
        word = "disarms" if self.pressed.armed else "arms"
        lines = (
            f"{self._map.arm_key} {word}, {self._map.profile_key} changes the profile",
            f"{self.pressed.profile}: {' '.join(self.pressed.down) or 'nothing is down'}",
        )
        self._window.draw(surface, self._now_s, armed=self.pressed.armed, lines=lines)


def create(kind: Kind, options: TargetOptions) -> KeysTarget:
    """Read the mapping, and start what presses the keys.

    Raises:
        KeyMapError: The mapping cannot be used.
        BackendError: Nothing presses keys here.
    """
    path = options.mapping or Path(__file__).with_name(f"{kind}.toml")
    key_map = read(path, kind).beginning(options.profile)
    sender = _sender(kind, key_map, options)
    presses = sender.start()
    target = KeysTarget(key_map, sender, _say, _ring)
    target.read_terminal()
    arming = [f"{key_map.arm_key} here", *_arming(key_map)]
    _say(f"disarmed; {' or '.join(arming)} arms ({presses}, {path.name}, {key_map.first})")
    return target


def _sender(kind: Kind, key_map: KeyMap, options: TargetOptions) -> Sender:
    if options.dry_run:
        return DryRunInjector(lambda line: print(line, flush=True))
    return Injector(options.backend, kind, key_map.keys)


def _arming(key_map: KeyMap) -> list[str]:
    """Return the commands that arm in the first profile."""
    entries = key_map.profiles[key_map.first].items()
    held = [name for name, entry in key_map.long.items() if isinstance(entry, Arm)]
    return [
        *(f"the orb's {command}" for command, entry in entries if isinstance(entry, Arm)),
        *(f"the orb's {command} held for {key_map.long_s:g} s" for command in held),
    ]


def _say(line: str) -> None:
    with contextlib.suppress(OSError):  # the terminal has gone; the keys go up all the same
        print(line, file=sys.stderr, flush=True)


def _ring(armed: bool) -> None:
    """Ring the terminal's bell: once for armed, twice for disarmed."""
    if sys.stderr is not None and sys.stderr.isatty():
        with contextlib.suppress(OSError):
            print("\a" if armed else "\a\a", end="", file=sys.stderr, flush=True)
