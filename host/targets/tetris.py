"""Tetris as a target: commands become actions, and the window shows game and orb side by side.

`TetrisTarget.tick` is the pure core; it needs no window and no clock, so tests and the demo
call it as often as they like. Drawing and the events of the window come after it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import pygame

from controller.protocol import Command, Message, Telemetry
from host import cards, sprites
from host.orb_view import LinkState, OrbView
from host.panel import Panel, Projection
from host.receiver import Connected, Delivered, Lost, Received, Refused, Stale
from host.targets import TargetOptions
from host.touch import Pad, Touch
from tetris.engine import Action, Config, Event, Game, Phase
from tetris.window import theme
from tetris.window.keys import Keys
from tetris.window.view import GameView

DESIGN: Final = (1280, 720)  # the window's first size; any other is filled in proportion
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
_RIGHT_BUTTON: Final = 3
_BUTTONS: Final = (1, _RIGHT_BUTTON)
_LEAST: Final = 0.05  # of the first size; in a smaller window the edges are cut off
_MARGIN, _LEFT, _RIGHT, _GAP, _TOUCHES = 20, 358, 222, 8, 214  # design units


@dataclass(frozen=True, slots=True)
class Ticked:
    """What one tick did.

    Attributes:
        acted: The commands that came in, each with the action it became, oldest first.
        events: What happened in the game.
    """

    acted: tuple[tuple[Command, Action], ...]
    events: tuple[Event, ...]


class TetrisTarget:
    """A game, the orb as it was last heard of, and the fingers on it.

    Attributes:
        game: The engine.
        orb: What the panel shows.
        touch: The player's fingers on a virtual orb.
        keys: The player's keyboard.
        reason: Why the link made the game pause; "" when it did not.
    """

    size: Final = DESIGN

    def __init__(self, seed: int, config: Config | None = None) -> None:
        """Begin a game; its time begins with the first tick."""
        self.game = Game(seed, config or PACE)
        self.orb = OrbView()
        self.touch = Touch()
        self.keys = Keys()
        self.reason = ""
        self._now_s = 0.0
        self._running_s = 0.0  # when a game was last running or paused
        self._button = 0
        self._scene: _Scene | None = None

    # -- the core ----------------------------------------------------------------------

    def tick(
        self, now_s: float, received: Sequence[Received] = (), actions: Sequence[Action] = ()
    ) -> Ticked:
        """Let time pass; take what came over the link, and then what the player's keys say.

        Args:
            now_s: The present time, never earlier than before.
            received: What the receiver gave since the last tick, oldest first.
            actions: Further actions, after those of the keyboard.
        """
        self._now_s = now_s
        acted: list[tuple[Command, Action]] = []
        events: list[Event] = []
        for item in received:
            due = self._take(item, now_s)
            if isinstance(item, Delivered) and isinstance(item.message, Command):
                action = self._action(item.message.name)
                if action is not None:
                    acted.append((item.message, action))
                    due = (*due, action)
            events += self.game.update(now_s, due, soft_drop=self.keys.soft_drop)
        mine = (*self.keys.poll(now_s), *actions)
        if Action.PAUSE in mine or Action.RESTART in mine:
            self.reason = ""  # to pause, or to go on without the orb, is now the player's affair
        events += self.game.update(now_s, mine, soft_drop=self.keys.soft_drop)
        if self.game.phase is not Phase.OVER:
            self._running_s = now_s
        self.orb.advance(now_s)
        if self._scene:
            self._scene.game.show(events)
        return Ticked(tuple(acted), tuple(events))

    def _take(self, item: Received, now_s: float) -> tuple[Action, ...]:
        """Take what came over the link; return what a change of the link asks of the game."""
        match item:
            case Connected(welcome=welcome):
                self.orb.connected(welcome)
                self.touch.lift_all()
                self.touch.pad = Pad(welcome.rows, welcome.columns, welcome.pitch_mm)
                return self._go_on()
            case Stale():
                return self._stop("stale", "the orb is silent", "")
            case Lost(reason=reason) | Refused(reason=reason):
                return self._stop("lost", "the link to the orb is lost", reason)
            case Delivered(message=message):
                if isinstance(message, Telemetry):
                    self.orb.telemetry(message, now_s)
                elif isinstance(message, Command):
                    self.orb.command(message, now_s)
                return self._go_on() if self.orb.heard() else ()

    def _stop(self, link: LinkState, reason: str, details: str) -> tuple[Action, ...]:
        """Let go of everything, and pause a game that was running when the link went."""
        was_live = self.orb.link == "live"
        self.orb.silent(link, details or reason)
        self.touch.lift_all()
        if self.reason or (was_live and self.game.phase is Phase.RUNNING):
            self.reason, before = reason, self.reason
            return () if before else (Action.PAUSE,)
        return ()

    def _go_on(self) -> tuple[Action, ...]:
        """End the pause that the link made; one that the player made stays."""
        ours, self.reason = bool(self.reason), ""
        return (Action.PAUSE,) if ours and self.game.phase is Phase.PAUSED else ()

    def _action(self, command: str) -> Action | None:
        if self.game.phase is Phase.OVER and command == "drop":
            return Action.RESTART if self._now_s - self._running_s >= AGAIN_S else None
        return ACTIONS.get(command)

    # -- the window --------------------------------------------------------------------

    def handle(self, event: pygame.event.Event, now_s: float) -> None:
        """Take one event of the window: a key, the mouse, a finger, the focus."""
        match event.type:
            case pygame.KEYDOWN if event.key == _TWO_FINGERS:
                self.touch.hold_two(True)
            case pygame.KEYUP if event.key == _TWO_FINGERS:
                self.touch.hold_two(False)
            case pygame.KEYDOWN:
                self.keys.press(event.key, now_s)
            case pygame.KEYUP:
                self.keys.release(event.key, now_s)
            case pygame.WINDOWFOCUSLOST:
                self.touch.lift_all()
                self.keys.release_all()
            case _ if self._scene:
                self._point(event, now_s, self._scene)

    def outgoing(self, now_s: float) -> list[Message]:
        """Return the contacts that a virtual orb has to be told of now, if any."""
        if not self._touchable:
            self.orb.contacts = ()
            return []
        self.orb.contacts = self.touch.contacts(now_s)
        contacts = self.touch.update(now_s)
        return [contacts] if contacts else []

    def draw(self, surface: pygame.Surface) -> None:
        """Draw game, orb and cards as they were at the last tick."""
        size = surface.get_size()
        if self._scene is None or self._scene.size != size:
            self._scene = _Scene(size)
        self.orb.hint = self._hint()
        self._scene.draw(surface, self, self._now_s)

    def close(self) -> None:
        """Nothing outside the window has to be let go."""

    def _hint(self) -> str:
        if not self._touchable:
            return ""
        if self.touch.two_fingers:
            return "two fingers: the left button pinches, 2 switches back"
        return "" if self.orb.history else "hold the mouse button on the dome"

    @property
    def projection(self) -> Projection | None:
        """Where the dome is in the window; None before the first picture."""
        return self._scene.panel.projection if self._scene else None

    @property
    def _touchable(self) -> bool:
        return self.orb.link == "live" and bool(self.orb.welcome and self.orb.welcome.virtual)

    def _point(self, event: pygame.event.Event, now_s: float, scene: "_Scene") -> None:
        """Take an event of the mouse or of a touch screen."""
        if not self._touchable or getattr(
            event, "touch", False
        ):  # SDL shows a finger as a mouse too
            return
        to_grid = scene.panel.projection.to_grid
        match event.type:
            case pygame.MOUSEBUTTONDOWN if event.button in _BUTTONS:
                pinch = event.button == _RIGHT_BUTTON
                if self.touch.press(*to_grid(*event.pos), now_s, pinch=pinch):
                    self._button = event.button
            case pygame.MOUSEMOTION:
                self.touch.move(*to_grid(*event.pos))
            case pygame.MOUSEBUTTONUP if event.button == self._button:
                self.touch.release()
            case pygame.FINGERDOWN | pygame.FINGERMOTION:
                x, y = event.x * scene.size[0], event.y * scene.size[1]
                down = event.type == pygame.FINGERDOWN
                self.touch.finger(event.finger_id, *to_grid(x, y), down=down)
            case pygame.FINGERUP:
                self.touch.finger_up(event.finger_id)


class _Scene:
    """Where everything is in a window of one size."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        factor = max(_LEAST, min(size[0] / DESIGN[0], size[1] / DESIGN[1]))
        self.unit = unit = sprites.Scale(factor)
        page = pygame.Rect(0, 0, round(DESIGN[0] * factor), round(DESIGN[1] * factor))
        page.center = size[0] // 2, size[1] // 2
        inner = page.inflate(-2 * unit.px(_MARGIN), 0)
        left, right = unit.px(_LEFT), unit.px(_RIGHT)
        area = pygame.Rect(inner.left + left, page.top + unit.px(6), 0, page.height - unit.px(42))
        area.width = inner.width - left - right
        self.game = GameView(area, hints=HINTS)
        # Everything stands on the board's lower edge and hangs from its upper one.
        top, bottom = self.game.layout.board.top, self.game.layout.board.bottom
        self.panel = Panel()
        self.orb = pygame.Rect(inner.left, top, left - unit.px(_GAP), bottom - top)
        column = pygame.Rect(0, top, right - unit.px(_GAP), bottom - top)
        column.right = inner.right
        self.touches = column.copy()
        self.touches.height = unit.px(_TOUCHES)
        self.touches.bottom = bottom
        self.history = column
        self.history.height = self.touches.top - unit.px(2 * _GAP) - top
        self.keys = pygame.Rect(page.left, bottom, page.width, page.bottom - bottom)

    def draw(self, surface: pygame.Surface, target: TetrisTarget, now_s: float) -> None:
        """Draw the whole window."""
        surface.fill(theme.BACKGROUND)
        self.game.draw(surface, target.game, now_s, reason=target.reason)
        self.panel.place(self.orb, target.touch.pad)
        self.panel.draw(surface, target.orb, now_s)
        cards.draw_history(surface, self.history, self.unit, target.orb, now_s)
        cards.draw_touches(surface, self.touches, self.unit, target.orb)
        cards.draw_keys(surface, self.keys, self.unit)


def create(options: TargetOptions) -> TetrisTarget:
    """Make the game for one seed."""
    return TetrisTarget(options.seed)
