"""Target that injects keys of a keyboard or a gamepad into other programs.

It has no window, and begins disarmed. `KeysTarget.tick` is the core, without a clock.
"""

import contextlib
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from controller.shared.aliases import Say
from controller.shared.keymap import keymap
from controller.shared.keymap.key_state import KeyState
from controller.shared.keymap.keymap import (
    GAMEPAD,
    KEYBOARD,
    Arm,
    KeyMap,
    KeyMapError,
    Kind,
    Outputs,
)
from controller.shared.protocol.messages import COMMANDS, Command, State, Telemetry, Welcome
from host.connection.receiver import Connected, Delivered, Lost, Received, Refused, Stale
from host.injection.backends import PRINT, BackendError
from host.injection.injector import Injector, PrintingSender, Sender
from host.injection.watchdog import HANG_MS
from host.targets import Target, TargetOptions

ARM_KEY, PROFILE_KEY = "f9", "f8"  # hot keys of the application's window
OUTPUTS: Final[dict[Kind, Outputs]] = {"keyboard": KEYBOARD, "gamepad": GAMEPAD}


class KeysTarget(Target):
    """Key state, orb state, and the sender of strokes.

    Attributes:
        keys: State of held keys, and whether it is armed.
    """

    windowed = False

    def __init__(
        self, key_map: KeyMap, sender: Sender, say: Say, sound: Callable[[bool], None]
    ) -> None:
        """Begin disarmed, with a started sender of strokes.

        `say` is called with each line for the user, `sound` on arming (True) and disarming.
        """
        super().__init__()
        self.keys = KeyState(key_map)
        self._map, self._sender, self._say, self._sound = key_map, sender, say, sound
        self._unknown: list[str] = []  # commands of the mapping that the orb does not have
        self._now_s = 0.0
        self._closed = False

    @property
    def profile(self) -> str:
        """The profile of the key mapping in force."""
        return self.keys.profile

    def tick(self, now_s: float, received: Sequence[Received] = ()) -> None:
        """Process received events and the passed time, and press keys."""
        passed_s, self._now_s = now_s - self._now_s, now_s
        was_armed = self.keys.armed
        if passed_s >= HANG_MS / 1000:  # a repeat must not continue after a pause
            self.keys.release()
        if trouble := self._sender.check():
            self._fail(trouble)
        for item in received:
            self._take(item, now_s)
        self.keys.tick(now_s)
        if self.keys.armed:
            self._ready()
        self._report(was_armed)
        self._send_strokes()
        for item in received:  # for the picture, which has more time than a stroke
            self.observe(item, now_s)
        self.orb.advance(now_s)

    def hot_key(self, key: str) -> None:
        """Process a hot key of the application's window."""
        if key == ARM_KEY:
            self.keys.toggle("by hand")
        elif key == PROFILE_KEY:
            self.keys.switch()

    def close(self) -> None:
        """Release all keys, and end."""
        if self._closed:
            return
        self._closed, was_armed = True, self.keys.armed
        try:
            self.keys.disarm("at the end")
            self._send_strokes()
        finally:
            self._sender.close()
        if trouble := self._sender.check():
            self._say(f"disarmed {trouble}")
        self._report(was_armed)

    def _take(self, item: Received, now_s: float) -> None:
        match item:
            case Connected(welcome=welcome):
                self.keys.release()
                self._note_unknown(welcome)
            case Stale():
                if self.keys.down:
                    self._say("the orb is silent: every key is up")
                self.keys.release()
            case Lost(reason=reason) | Refused(reason=reason):
                self.keys.disarm(f"because the link is gone: {reason}")
            case Delivered(message=Command(name=name)):
                self.keys.command(name, now_s)
            case Delivered(message=State(pressed=held)):
                self.keys.state(held, now_s)
            case Delivered(message=Telemetry(gesture="")):  # the State of that may have been lost
                self.keys.state((), now_s)
            case Delivered(message=Telemetry()):
                self.keys.still_held(now_s)

    def _note_unknown(self, welcome: Welcome) -> None:
        """Warn about commands of the mapping that neither this orb nor any other has."""
        unknown = sorted(self._map.commands.difference(COMMANDS, ("menu",), welcome.commands))
        if unknown and unknown != self._unknown:
            self._say(
                f"the orb has no command {', '.join(unknown)}, which the mapping names; "
                f"it has: {', '.join(welcome.commands)}"
            )
        self._unknown = unknown

    def _send_strokes(self) -> None:
        # Removed first: after a signal, `close` must not send a stroke twice.
        strokes, self.keys.strokes = self.keys.strokes, []
        self._sender.send(strokes)

    def _ready(self) -> None:
        try:
            started = self._sender.start()
        except BackendError as error:
            self._fail(f"because no key can be pressed: {error}")
        else:
            if started:  # that took time, so strokes of this tick are too late
                self.keys.release()
                self.keys.strokes.clear()

    def _fail(self, trouble: str) -> None:
        """Disarm without strokes: the sender has released the keys itself."""
        self.keys.disarm(trouble)
        self.keys.strokes.clear()

    def _report(self, was_armed: bool) -> None:
        for line in self.keys.notes:
            self._say(line)
        self.keys.notes.clear()
        if self.keys.armed is not was_armed:
            self._sound(self.keys.armed)


def create(kind: Kind, options: TargetOptions) -> KeysTarget:
    """Read the mapping (KeyMapError), and start the sender (BackendError)."""
    path = options.mapping or Path(kind)
    key_map = keymap.load(path, OUTPUTS[kind]).beginning(options.profile)
    if not (arming := _arming(key_map)):
        raise KeyMapError(
            f"no command of {path} arms; write menu = {{ arm = true }} ({OUTPUTS[kind].docs})"
        )
    sender: Sender = Injector(options.backend, kind, key_map.keys)
    if options.backend == PRINT:
        sender = PrintingSender(partial(print, flush=True))
    presses = sender.start()
    target = KeysTarget(key_map, sender, _say, _ring)
    _say(f"disarmed; {' or '.join(arming)} arms ({presses}, {path.name}, {key_map.first})")
    return target


def _arming(key_map: KeyMap) -> list[str]:
    """Return the commands that arm in the first profile."""
    entries = key_map.profiles[key_map.first].items()
    held = [name for name, entry in key_map.long.items() if isinstance(entry, Arm)]
    return [
        *(f"the orb's {command}" for command, entry in entries if isinstance(entry, Arm)),
        *(f"the orb's {command} held for {key_map.long_s:g} s" for command in held),
    ]


def _say(line: str) -> None:
    with contextlib.suppress(OSError):  # the terminal is closed
        print(line, file=sys.stderr, flush=True)


def _ring(armed: bool) -> None:
    """Ring the terminal's bell: once for armed, twice for disarmed."""
    if sys.stderr is not None and sys.stderr.isatty():
        with contextlib.suppress(OSError):
            print("\a" if armed else "\a\a", end="", file=sys.stderr, flush=True)
