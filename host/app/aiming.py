"""Aim in the window: contacts and gestures of the orb to actions of the game that is played."""

from typing import Final

from controller.shared.protocol.messages import LATE_MS, Command, ContactState, Message, Welcome
from host.actions import ACTIONS
from host.aim import Aim
from host.app.screens.learn import LearnScreen
from host.ui.orb_state import OrbState
from host.ui.zones import Columns
from tetris.engine.game import Action, Game
from tetris.kit.stage import Screen, Stage
from tetris.window.menu_screen import MenuScreen
from tetris.window.play_screen import PlayScreen

_SHIFTS: Final = (Action.LEFT, Action.RIGHT)


class Aiming:
    """Plays by Aim where the player wants it and the orb gives contacts.

    Attributes:
        given: Whether the connected orb has given a contact.
    """

    def __init__(self, stage: Stage, orb: OrbState) -> None:
        """Follow the setting of a stage, and the gestures of an orb."""
        self._stage, self._orb = stage, orb
        self._aim, self.given = Aim(), False
        self._lacks = False  # whether a command came in time, and no contact before
        self._rows = 4  # of the dome, less one
        self._steered = False  # whether the touch has moved the piece

    @property
    def wanted(self) -> bool:
        """Whether the player has chosen it."""
        return self._stage.settings.control == "aim"

    @property
    def on(self) -> bool:
        """Whether touches steer."""
        return self.wanted and self.given

    def connected(self, welcome: Welcome) -> None:
        """Begin with an orb."""
        self._aim, self.given, self._lacks = Aim(welcome.rows, welcome.columns), False, False
        self._rows = max(1, welcome.rows - 1)

    def lost(self) -> None:
        """Lift what touches: the link is silent."""
        self._aim = self._aim.again()

    @property
    def expected(self) -> bool:
        """Whether touches steer, unless the orb gives no contacts: before the first, none tells."""
        return self.wanted and (self.given or not self._lacks)

    def game(self, screen: Screen | None) -> Game | None:
        """Return the game that touches steer on a screen; None if they steer none."""
        return _game(screen) if self.on else None

    def take(self, message: Message, t_s: float, screen: Screen | None, now_s: float) -> bool:
        """Take a contact or a command, at the orb's time; return whether it is for Aim alone."""
        contact = message if isinstance(message, ContactState) else None
        self.given |= contact is not None
        if isinstance(message, Command):
            self._lacks = max(self._ages_ms(), default=0.0) <= LATE_MS
        game = self.game(screen)
        if screen and game and (contact or isinstance(message, Command)):
            self._steer(message, t_s, screen, game, now_s)
            return True
        if contact:
            self.lost()  # of a touch that began in a game, the end may not be seen there
        if type(screen) is not MenuScreen or not self.on:
            return contact is not None
        if contact and contact.fingers == 1:
            screen.point(1 - contact.y / self._rows)
        return contact is not None or (isinstance(message, Command) and self._orb.located(message))

    def _steer(
        self, message: Message, t_s: float, screen: Screen, game: Game, now_s: float
    ) -> None:
        """Act in the game before the next message comes; all steps of a touch are one command."""
        actions: list[Action] = []
        if isinstance(message, ContactState):
            steered, self._steered = self._aim.touching, self._steered and message.fingers > 0
            actions = self._aim.touch(message, t_s, game)
            if (steered and not message.fingers) or Action.HOLD in actions:
                self._orb.answered()
        elif isinstance(message, Command) and (action := ACTIONS.get(message.name)):
            actions = self._aim.command(action, self._orb.located(message), t_s, game)
        for action in actions:
            if isinstance(screen, PlayScreen) and action in _SHIFTS and self._steered:
                screen.hold((), [action], now_s)
            else:
                screen.act(action, now_s)
            self._steered |= action in _SHIFTS
        if actions:
            screen.tick(now_s)

    def columns(self, screen: Screen | None) -> Columns | None:
        """Return what the dome shows of it on a screen; None while it is off."""
        if not self.expected or (game := _game(screen)) is None:
            return None
        lit = sorted({x for x, _ in game.piece.cells}) if game.in_play else []
        return Columns(game.config.columns, *((lit[0], len(lit)) if lit else (0, 0)))

    def hint(self, *, mouse: bool) -> str:
        """Return the key of what to do, or of why touches do not steer; or ""."""
        ages_ms = self._ages_ms()
        if self.wanted and ages_ms and ages_ms[len(ages_ms) // 2] > LATE_MS:
            return "aim.late"
        if self.on:
            return "aim.mouse" if mouse else "aim.touch"
        return "aim.lacks" if self.wanted and self._lacks else ""

    def _ages_ms(self) -> list[float]:
        """Return the ages of recent frames, ascending; the link drops contacts of late ones."""
        return self._orb.latency.recent_ms() if self._orb.latency else []


def _game(screen: Screen | None) -> Game | None:
    """Return the game that a screen lets the player play by the orb; None without one."""
    if isinstance(screen, LearnScreen):
        return screen.game if screen.step else None
    return screen.session.game if isinstance(screen, PlayScreen) and screen.by_hand else None
