"""Tetris as a target: commands become actions, and the window shows game and orb side by side.

`TetrisTarget.tick` is the pure core, without a window and a clock.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import pygame

from controller.protocol.messages import Command, Message, State, UploadStatus
from host.connection.latency import EndToEndLatency
from host.connection.receiver import Connected, Delivered, Lost, Missed, Received, Refused, Stale
from host.targets import Target, TargetOptions
from host.ui.correction_keys import CorrectionKeys
from host.ui.layout import DESIGN, WindowLayout
from host.ui.orb_state import LinkState
from host.ui.panel import Projection
from host.ui.pause_menu import PauseMenu
from tetris.engine.events import Paused
from tetris.engine.game import Action, Config, Event, Game, Phase
from tetris.files import config_folder
from tetris.window import bindings
from tetris.window.keys import Code, Keys
from tetris.window.menu import OF_ACTION, OF_CODE, MenuStep
from tetris.window.settings import FILE_NAME, Settings, changed, hands, load
from tetris.window.tiles import ThemeChoice

# An orb gives about one command a second, and a placement needs up to eight: at level 3 a
# piece falls for 12 s, and what has landed can still be moved by one more gesture.
PACE: Final = Config(gravity_cap=3, lock_delay_s=1.0)
AGAIN_S: Final = 1.0  # a drop meant for the last piece does not start the next game

ACTIONS: Final[dict[str, Action]] = {
    "left": Action.LEFT,
    "right": Action.RIGHT,
    "down": Action.DOWN,
    "drop": Action.HARD_DROP,
    "rotate_cw": Action.ROTATE_CW,
    "rotate_ccw": Action.ROTATE_CCW,
    "hold": Action.HOLD,
    "pause": Action.PAUSE,
}
HINTS: Final = {Phase.PAUSED: "P to go on", Phase.OVER: "pinch, or R, to play again"}
_TWO_FINGERS: Final = pygame.K_2
_CTRL: Final = (pygame.K_LCTRL, pygame.K_RCTRL)
# What acts for as long as its key is down, or its gesture is held.
_HELD: Final[dict[Code, Action]] = {"left": Action.LEFT, "right": Action.RIGHT, "down": Action.DOWN}
# A tap holds for some frames longer than a key: the orb needs them to see that the finger has left.
_LINGER_FRAMES: Final = 10


@dataclass(frozen=True, slots=True)
class TickResult:
    """Result of one tick.

    Attributes:
        acted: Received commands, each with its action, oldest first.
        events: Events of the game.
    """

    acted: tuple[tuple[Command, Action], ...]
    events: tuple[Event, ...]


class TetrisTarget(Target):
    """A game, and the orb that plays it.

    Attributes:
        game: The engine.
        keys: The player's keyboard.
        reason: Reason of a pause by the link; "" without one.
    """

    size = DESIGN

    def __init__(
        self, seed: int, config: Config | None = None, settings: Settings | None = None
    ) -> None:
        """Begin a game; its time begins with the first tick.

        Args:
            seed: Which game.
            config: The rules; an orb's pace without them.
            settings: The player's keys, and what they want to see.
        """
        super().__init__()
        self._settings = settings or Settings()
        self._look = _look(self._settings)
        self.game = Game(seed, config or PACE)
        self.keys = hands(self._settings)
        self._gestures = HeldGestures(self._settings)
        self.correcting = CorrectionKeys()
        self.reason = ""
        self._now_s = 0.0
        self._running_s = 0.0  # when a game was last running or paused
        self._waiting = 0  # Ctrl, which acts when it comes up: a correction may follow
        self._scene: WindowLayout | None = None
        self._asked: list[Action] = []  # by the menu
        self.menu = PauseMenu(
            lambda: self._settings,
            self._change,
            resume=lambda: self._asked.append(Action.PAUSE),
            restart=lambda: self._asked.append(Action.RESTART),
        )

    @property
    def in_menu(self) -> bool:
        """Whether the player has stopped the game, and commands move through its menu."""
        return self.game.phase is Phase.PAUSED and not self.reason

    def _change(self, settings: Settings) -> None:
        """Apply changed settings."""
        self._settings, self._look = settings, _look(settings)
        self._scene = None

    # -- the core ----------------------------------------------------------------------

    def tick(
        self, now_s: float, received: Sequence[Received] = (), actions: Sequence[Action] = ()
    ) -> TickResult:
        """Advance to the present time; process received events, and then the player's keys.

        Args:
            now_s: The present time, never earlier than before.
            received: Events of the receiver since the last tick, oldest first.
            actions: Further actions, after those of the keyboard.
        """
        self._now_s = now_s
        acted: list[tuple[Command, Action]] = []
        events: list[Event] = []
        for item in received:
            due = self._take(item, now_s)
            if isinstance(item, Delivered) and isinstance(item.message, Command):
                action = self._action(item.message.name)
                if action is not None and self.in_menu:
                    self._navigate(OF_ACTION.get(action))
                elif action is not None:
                    acted.append((item.message, action))
                    due = (*due, action)
            events += self.game.update(now_s, due, soft_drop=self._soft_drop(now_s))
        mine = (*self.keys.poll(now_s), *self._gestures.poll(now_s), *self._asked, *actions)
        self._asked.clear()
        if Action.PAUSE in mine or Action.RESTART in mine:
            self.reason = ""  # to pause, or to go on without the orb, is now the player's affair
        events += self.game.update(now_s, mine, soft_drop=self._soft_drop(now_s))
        if any(isinstance(event, Paused) for event in events):
            self.menu.open()
        if self.game.phase is not Phase.OVER:
            self._running_s = now_s
        self.orb.advance(now_s)
        if self._scene:
            self._scene.game.show(events)
        return TickResult(tuple(acted), tuple(events))

    def _take(self, item: Received, now_s: float) -> tuple[Action, ...]:
        """Process a received event; return the actions caused by a change of the link."""
        before = self.orb.link
        self._observe(item, now_s)
        match item:
            case Connected(welcome=welcome):
                self.correcting.labels = welcome.labels
                self._gestures = HeldGestures(self._settings, welcome.rate_hz)
                return self._go_on()
            case Stale():
                self._gestures.hold((), now_s)
                return self._stop(before, "the orb is silent")
            case Lost() | Refused():
                self._gestures.hold((), now_s)
                return self._stop(before, "the link to the orb is lost")
            case Delivered(message=message):
                if isinstance(message, State):
                    self._gestures.hold(message.pressed, now_s)
                if isinstance(message, UploadStatus):
                    self.correcting.answer(message, now_s)
                self.correcting.labels = self.orb.labels  # they may have changed
                return self._go_on() if before == "stale" else ()
            case Missed():
                return ()  # too late to be played

    def _stop(self, link: LinkState, reason: str) -> tuple[Action, ...]:
        """Pause a game that was running when the link went."""
        if self.reason or (link == "live" and self.game.phase is Phase.RUNNING):
            self.reason, before = reason, self.reason
            return () if before else (Action.PAUSE,)
        return ()

    def _go_on(self) -> tuple[Action, ...]:
        """End the pause that the link made; one that the player made stays."""
        ours, self.reason = bool(self.reason), ""
        return (Action.PAUSE,) if ours and self.game.phase is Phase.PAUSED else ()

    def _soft_drop(self, now_s: float) -> bool:
        return self.keys.soft_drop or self._gestures.soft_drop(now_s)

    def _navigate(self, nav: MenuStep | None) -> None:
        if nav:
            self.menu.nav(nav)

    def _action(self, command: str) -> Action | None:
        if self.game.phase is Phase.OVER and command == "drop":
            return Action.RESTART if self._now_s - self._running_s >= AGAIN_S else None
        return ACTIONS.get(command)

    # -- the window --------------------------------------------------------------------

    def handle(self, event: pygame.event.Event, now_s: float) -> None:
        """Process an event of the window: a key, the mouse, a finger, the focus."""
        match event.type:
            case pygame.KEYDOWN if self.correcting.key(event.key, getattr(event, "mod", 0), now_s):
                self._waiting = 0
            case pygame.KEYDOWN if event.key in _CTRL and self._waits(event.key):
                self._waiting = event.key
            case pygame.KEYDOWN if event.key == _TWO_FINGERS:
                self.touch.hold_two(True)
            case pygame.KEYUP if event.key == _TWO_FINGERS:
                self.touch.hold_two(False)
            case pygame.KEYDOWN if self.in_menu and event.key in OF_CODE:
                self._navigate(OF_CODE[event.key])
            case pygame.KEYDOWN:
                self._act(now_s)
                self.keys.press(event.key, now_s)
            case pygame.KEYUP:
                if event.key == self._waiting:
                    self._act(now_s)
                self.keys.release(event.key, now_s)
            case pygame.WINDOWFOCUSLOST:
                self._waiting = 0
                self.touch.lift_all()
                self.keys.release_all()
            case _ if self._scene:
                self._point(event, now_s, self._scene.panel.projection, self._scene.size)

    def _waits(self, code: int) -> bool:
        """Return whether Ctrl acts when it comes up; not while nothing can be corrected."""
        action = bindings.table(self._settings.keys).get(code)
        return bool(self.correcting.labels) and action not in _HELD.values()

    def _act(self, now_s: float) -> None:
        """Press the Ctrl that waits: it was no part of a correction."""
        code, self._waiting = self._waiting, 0
        if code:
            self.keys.press(code, now_s)
            self.keys.release(code, now_s)

    def outgoing(self, now_s: float) -> list[Message]:
        """Return the messages for the device: corrections, and contacts on a virtual orb."""
        return [*self.correcting.outgoing(), *super().outgoing(now_s)]

    def draw(self, surface: pygame.Surface) -> None:
        """Draw game, orb and cards as they were at the last tick."""
        size = surface.get_size()
        if self._scene is None or self._scene.size != size:
            self._scene = WindowLayout(size, self._look, HINTS)
        self.orb.hint = self._hint()
        menu = self.menu if self.in_menu else None
        self._scene.draw(
            surface, self.game, self.orb, self.touch.pad, self._now_s, self.reason, menu
        )

    def paced(self, hops: EndToEndLatency) -> None:
        """Show the latency of frames, about once a second."""
        pace = hops.pace
        if pace is not None and hops.frames % max(1, round(1000 / pace.period_ms)) == 0:
            self.orb.hops, self.orb.period_ms = tuple(hops.digest()), pace.period_ms

    def _hint(self) -> str:
        words = self._look.words
        if message := self.correcting.told(self._now_s, words):
            return message
        if not self._touchable:
            return ""
        if self.touch.two_fingers:
            return words("orb.two_fingers")
        return "" if self.orb.history else words("orb.first_touch")

    @property
    def projection(self) -> Projection | None:
        """Rectangle of the dome in the window; None before the first picture."""
        return self._scene.panel.projection if self._scene else None


class HeldGestures:
    """Commands whose gesture is held: after the first step they repeat as held keys do."""

    def __init__(self, settings: Settings, rate_hz: float = 10.0) -> None:
        """Begin with nothing held, on an orb of so many frames a second."""
        self._das_s = settings.das_ms / 1000 + _LINGER_FRAMES / rate_hz
        self._keys = Keys(_HELD, das_s=self._das_s, arr_s=settings.arr_ms / 1000)
        self._held: frozenset[str] = frozenset()
        self._lowering_s = math.inf  # since when "down" is held

    def hold(self, commands: Sequence[str], now_s: float) -> None:
        """Take the commands that are held now."""
        held = frozenset(commands)
        for name in sorted(self._held - held):
            self._keys.release(name, now_s)
        for name in sorted(held - self._held):
            self._keys.press(name, now_s)
        if ("down" in held) != ("down" in self._held):
            self._lowering_s = now_s if "down" in held else math.inf
        self._held = held

    def poll(self, now_s: float) -> list[Action]:
        """Return the repeats that are due."""
        return [due.action for due in self._keys.due(now_s) if due.repeated]

    def soft_drop(self, now_s: float) -> bool:
        """Whether "down" is held for so long that it lowers the piece."""
        return now_s - self._lowering_s >= self._das_s


def _look(settings: Settings) -> ThemeChoice:
    """Return the player's theme settings, in the colours and the language of the panel."""
    return ThemeChoice.chosen(changed(settings, theme="dark", language="en"))


def create(options: TargetOptions) -> TetrisTarget:
    """Make the game of a seed, with the player's settings of `tetris`."""
    settings, _ = load(config_folder() / FILE_NAME)
    return TetrisTarget(options.seed, settings=settings)
