"""Target that injects keys of a keyboard or a gamepad into other programs.

`KeysTarget.tick` is the core, without a window and a clock. It begins disarmed.
"""

import contextlib
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import pygame

from controller.shared.aliases import Say
from controller.shared.keymap import keymap
from controller.shared.keymap.key_state import KeyState
from controller.shared.keymap.keymap import GAMEPAD, KEYBOARD, Arm, KeyMap, Kind, Outputs
from controller.shared.protocol.messages import COMMANDS, Command, State, Telemetry, Welcome
from host.connection.receiver import Connected, Delivered, Lost, Received, Refused, Stale
from host.injection.backends import PRINT, BackendError
from host.injection.injector import Injector, PrintingSender, Sender
from host.injection.terminal import Poll, keyboard
from host.injection.watchdog import HANG_MS
from host.targets import Target, TargetOptions
from host.ui import sprites
from host.ui.orb_state import OrbState
from host.ui.panel.panel import Panel, Projection
from host.ui.pointer_input import DomeArea
from tetris.kit.look import Look

_OUTPUTS: Final[dict[Kind, Outputs]] = {"keyboard": KEYBOARD, "gamepad": GAMEPAD}


WINDOW: Final = (390, 720)  # its first size
_STRIP: Final = 96  # design units below the panel
_MARGIN: Final = 12
_LEAST: Final = 0.05  # of the first size; in a smaller window the edges are cut off


class KeysTarget(Target):
    """Key state, orb state, and the sender of strokes.

    Attributes:
        keys: State of held keys, and whether it is armed.
    """

    size = WINDOW

    def __init__(
        self, key_map: KeyMap, sender: Sender, say: Say, sound: Callable[[bool], None]
    ) -> None:
        """Begin disarmed, with a started sender of strokes.

        `say` is called with each line for the user, `sound` on arming (True) and disarming.
        """
        super().__init__()
        self.keys = KeyState(key_map)
        self._typed: Poll = list
        self._resources = contextlib.ExitStack()  # the terminal
        self._map, self._sender, self._say, self._sound = key_map, sender, say, sound
        self._window = OrbWindow()
        self._unknown: list[str] = []  # commands of the mapping that the orb does not have
        self._now_s = 0.0
        self._closed = False

    @property
    def profile(self) -> str:
        """The profile of the key mapping in force."""
        return self.keys.profile

    # -- the core ----------------------------------------------------------------------

    def tick(self, now_s: float, received: Sequence[Received] = ()) -> None:
        """Process received events and the passed time, and press keys."""
        passed_s, self._now_s = now_s - self._now_s, now_s
        was_armed = self.keys.armed
        if passed_s >= HANG_MS / 1000:  # a text or a repeat must not continue after a pause
            self.keys.release()
        if trouble := self._sender.check():
            self._fail(trouble)
        for key in self._typed():
            self.hot_key(key)
        for item in received:
            self._take(item, now_s)
        self.keys.tick(now_s)
        if self.keys.armed:
            self._ready()
        self._report(was_armed)
        self._send_strokes()
        for item in received:  # for the picture, which has more time than a stroke
            self._observe(item, now_s)
        self.orb.advance(now_s)

    def read_terminal(self) -> None:
        """Read hot keys from the terminal, too, until `close`; in the main thread only."""
        self._typed = self._resources.enter_context(keyboard())

    def hot_key(self, key: str) -> None:
        """Process a hot key of the program's window or terminal."""
        if key == self._map.arm_key:
            self.keys.toggle("by hand")
        elif key == self._map.profile_key:
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
            self._resources.close()
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

    # -- the window --------------------------------------------------------------------

    def handle(self, event: pygame.event.Event, now_s: float) -> None:
        """Process an event of the window."""
        if event.type == pygame.KEYDOWN:
            self.hot_key(pygame.key.name(event.key))
        elif event.type == pygame.WINDOWFOCUSLOST:
            self.touch.lift_all()
        elif self._window.drawn:
            self._point(event, now_s, self._window.projection, self._window.drawn.size)

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the orb, and the state of arming."""
        word = "disarms" if self.keys.armed else "arms"
        lines = (
            f"{self._map.arm_key} {word}, {self._map.profile_key} changes the profile",
            f"{self.keys.profile}: {' '.join(self.keys.down) or 'nothing is down'}",
        )
        self._window.draw(
            surface, self._now_s, self.orb, self.touch.pad, armed=self.keys.armed, lines=lines
        )


class OrbWindow:
    """Draws the window: the orb, and how it is armed; in the dark theme and in English.

    Attributes:
        drawn: Its last place and size in the surface; empty before the first drawing.
    """

    def __init__(self) -> None:
        self.drawn = pygame.Rect(0, 0, 0, 0)
        self._panel, self._look = Panel(), Look()

    @property
    def projection(self) -> Projection:
        """Rectangle of the dome in the window."""
        return self._panel.projection

    def draw(
        self,
        surface: pygame.Surface,
        now_s: float,
        orb: OrbState,
        dome: DomeArea,
        *,
        armed: bool,
        lines: tuple[str, ...],
    ) -> None:
        """Draw the orb, and below it the state of arming and some lines of text."""
        self.drawn = surface.get_rect()
        palette = self._look.palette
        factor = min(self.drawn.width / WINDOW[0], self.drawn.height / WINDOW[1])
        unit = sprites.SpriteScale(max(_LEAST, factor), palette)
        surface.fill(palette.background)
        page = pygame.Rect(0, 0, unit.px(WINDOW[0]), unit.px(WINDOW[1]))
        page.center = self.drawn.center
        inner = page.inflate(-2 * unit.px(_MARGIN), -2 * unit.px(_MARGIN))
        strip = pygame.Rect(inner.left, 0, inner.width, unit.px(_STRIP))
        strip.bottom = inner.bottom
        inner.height -= strip.height + unit.px(_MARGIN)
        inner.size = max(1, inner.width), max(1, inner.height)
        self._panel.place(inner, dome, gestures=len(orb.labels[1:]))
        self._panel.draw(surface, orb, now_s, self._look)
        unit.card(surface, strip)
        left, top = strip.left + unit.px(18), strip.top + unit.px(12)
        word, colour = ("ARMED", palette.warn) if armed else ("DISARMED", palette.dim)
        surface.blit(unit.text(word, 28, colour), (left, top))
        for line in lines:
            top += unit.px(26)
            shown = unit.text(line, 18, palette.text, strip.width - 2 * unit.px(18))
            surface.blit(shown, (left, top))


def create(kind: Kind, options: TargetOptions) -> KeysTarget:
    """Read the mapping (KeyMapError), and start the sender (BackendError)."""
    path = options.mapping or Path(kind)
    key_map = keymap.load(path, _OUTPUTS[kind]).beginning(options.profile)
    sender: Sender = Injector(options.backend, kind, key_map.keys)
    if options.backend == PRINT:
        sender = PrintingSender(partial(print, flush=True))
    presses = sender.start()
    target = KeysTarget(key_map, sender, _say, _ring)
    target.read_terminal()
    arming = [f"{key_map.arm_key} here", *_arming(key_map)]
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
