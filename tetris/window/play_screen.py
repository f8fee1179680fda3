"""The game itself: keys and buttons in, the board and what happens on it out."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from math import ceil
from operator import itemgetter
from typing import Final

import pygame

from tetris.bots import beam_search
from tetris.bots.greedy import Plan
from tetris.engine.events import Action, Event, Held, Locked, Spawned
from tetris.engine.game import Phase
from tetris.kit import bindings
from tetris.kit.bindings import Code, DueAction, Keys
from tetris.kit.menu import Item
from tetris.kit.stage import PLAY_HZ, Screen, Stage
from tetris.window.effects import sounds_of
from tetris.window.game_session import BotPlayer, Session
from tetris.window.view import GameView, figures_of, in_danger

READY_S: Final = 0.9  # before the first piece moves
LEAST_CARD: Final = 310  # pixels of width: letters do not become smaller without end
RESUME_S: Final = 1.0  # after a pause, in which 3, 2, 1 is shown
ASK_S: Final = 30.0  # of play, after which a restart is asked for
LONGEST_S: Final = 0.25  # that one frame may bring
_POINTER_S: Final = 2.0  # after the mouse has moved, in which it is seen
_LEAST_BUTTON: Final = 26  # pixels, of the button that pauses
_LAST_S: Final = 5  # of a limited time, which are counted down
_REST_S: Final = 1.2  # after the end, before a menu covers the board
_INITIAL: Final = (Action.ROTATE_CW, Action.ROTATE_CCW, Action.HOLD)
_OURS: Final = (Action.PAUSE, Action.RESTART)  # the screen sees to these itself


class PlayScreen(Screen):
    """Plays one session, by hand or by a bot."""

    def __init__(
        self,
        stage: Stage,
        session: Session,
        *,
        paused: Callable[["PlayScreen", str, Sequence[Item]], None],
        over: Callable[["PlayScreen"], None],
        restart: Callable[["PlayScreen"], None],
        bot: BotPlayer | None = None,
    ) -> None:
        """Show a game that has not begun; the functions lead to other screens.

        `paused` is given a sentence that says why, "" when the player wanted it, and what helps.
        """
        self._stage, self.session = stage, session
        self._paused, self._over, self._restart = paused, over, restart
        self._bot = bot
        self._view = GameView(stage.area, look=stage.look)
        # A game has a clock of its own: one that was taken over goes on where it was.
        self._offset_s = session.recorder.time_s - stage.time_s
        self._time_s = session.recorder.time_s
        self._begin_s: float | None = None  # when the piece begins to move
        self._over_s: float | None = None
        self._resuming = False
        self._warned = 0, False  # the count down and the danger that were heard
        self._hold_spent = False  # whether the hold that is held down has swapped a piece
        self._moved_s = -_POINTER_S  # when the mouse moved last, by the window's clock
        self._tapped: set[Action] = set()  # turns and holds while no piece is in play
        self._hint: Plan | None = None
        self._heard: list[Event] = []
        self._given: list[DueAction[Action]] = []
        self._held: frozenset[Action] = frozenset()  # by a controller of actions
        self._take_over_hands()

    def _take_over_hands(self) -> None:
        settings = self._stage.settings
        self._keys = Keys(
            bindings.table(Action, settings.keys, settings.pads),
            das_s=settings.das_ms / 1000,
            arr_s=settings.arr_ms / 1000,
            shifts=(Action.LEFT, Action.RIGHT),
        )
        self._hint_codes = bindings.codes(bindings.HINT, settings.keys, settings.pads)

    @property
    def by_hand(self) -> bool:
        """Whether the player plays, not a bot."""
        return self._bot is None

    # -- what comes in -----------------------------------------------------------------

    def press(self, code: Code, time_s: float) -> None:
        """Take a key or a button that went down."""
        if code in self._hint_codes and self.session.game.in_play:
            self._hint = beam_search.plan(self.session.game)
        self._keys.press(code, time_s + self._offset_s)

    def release(self, code: Code, time_s: float) -> None:
        """Take a key or a button that came up."""
        self._keys.release(code, time_s + self._offset_s)

    def act(self, action: Action, time_s: float) -> None:
        """Take a command, which is one press and never repeats."""
        self._given.append(DueAction(time_s + self._offset_s, action, held=self._down))

    def hold(self, held: Collection[Action], repeats: Sequence[Action], time_s: float) -> None:
        """Take what a controller of actions holds down, and the repeats that are due."""
        self._held = frozenset(held)
        at_s = time_s + self._offset_s
        self._given += [DueAction(at_s, action, True, self._down) for action in repeats]

    @property
    def pointer(self) -> bool:
        """The pointer is seen for a moment after the mouse has moved."""
        return self._stage.time_s < self._moved_s + _POINTER_S

    @property
    def frames_hz(self) -> int:
        """As often as the display shows."""
        return PLAY_HZ

    def mouse(self, event: pygame.event.Event, time_s: float) -> None:
        """Show the pointer; pause by a click on the button, or with the right button."""
        self._moved_s = time_s
        if event.type == pygame.MOUSEBUTTONDOWN and (
            event.button == pygame.BUTTON_RIGHT
            or (event.button == pygame.BUTTON_LEFT and self.button.collidepoint(event.pos))
        ):
            self.pause()

    @property
    def room(self) -> pygame.Rect:
        """Where a card may lie: on the board, or on figures too where that is narrow."""
        layout = self._view.layout
        wide = layout.area.width if layout.tall else 2 * (layout.next.left - layout.board.centerx)
        room = layout.board.inflate(wide - layout.board.width - layout.cell // 2, 0)
        least = round(LEAST_CARD * max(1.0, self._stage.settings.scale / 100))
        left = max(layout.area.left, min(room.left, room.right - least))
        return pygame.Rect(left, room.top, room.right - left, room.height)

    @property
    def button(self) -> pygame.Rect:
        """Where the mouse pauses the game: the corner of the card of next pieces."""
        card, side = self._view.layout.next, max(_LEAST_BUTTON, round(self._view.layout.cell))
        place = pygame.Rect(0, 0, side, side)
        place.topright = card.right - 2, card.top + 2
        return place

    def release_all(self, reason: str) -> None:
        """Let go of everything, and pause a game that is played by hand."""
        self._keys.release_all()
        if self._bot is None:
            self.pause(self._stage.look.words(reason))

    def pause(self, reason: str = "", *cures: Item) -> None:
        """Stop time, and show why and what helps."""
        game = self.session.game
        if game.phase is Phase.OVER:
            return
        self._keys.release_all()
        if game.phase is Phase.RUNNING and self._begun:
            self._show(self.session.update(self._time_s, [Action.PAUSE]))
        self._paused(self, reason, cures)

    def resume(self) -> None:
        """Go on in a moment; the player's hands may have changed meanwhile."""
        self._take_over_hands()
        self._resuming = True
        self._begin_s = self._stage.time_s + self._offset_s + RESUME_S

    # -- time --------------------------------------------------------------------------

    @property
    def _down(self) -> frozenset[Action]:
        return self._keys.held | self._held

    @property
    def _begun(self) -> bool:
        return self._begin_s is not None and self._time_s >= self._begin_s

    def tick(self, time_s: float) -> None:
        """Let time pass, and do what the player asks for.

        The game's clock leaves out what a frame takes longer than LONGEST_S: nobody saw it.
        """
        if self._begun:
            late_s = time_s + self._offset_s - self._time_s - LONGEST_S
            self._offset_s -= max(0.0, late_s)
        now_s = self._time_s = time_s + self._offset_s
        if self._begin_s is None:
            self._begin_s = now_s + (0.0 if self._bot else READY_S)
            self._stage.sounds.play("ready", "effects")
        if self._begun and self.session.game.phase is Phase.PAUSED:
            self._update(now_s, [Action.PAUSE], self._down)  # no menu covers it any more
        due = sorted(self._keys.due(now_s) + self._given, key=itemgetter(0))
        self._given = []
        wanted = [each.action for each in due if each.action in _OURS]
        if Action.RESTART in wanted:
            self._ask_restart()
        elif Action.PAUSE in wanted:
            self.pause()
        elif self._begun:
            self._play([each for each in due if each.action not in _OURS])
        self._warn()
        for sound in sounds_of(self._heard):  # all of a frame together
            self._stage.sounds.play(sound, "effects")
        self._heard = []

    @property
    def _count(self) -> int:
        """The number of a count down: 3 to 1 after a pause, 5 to 1 before time is over; else 0."""
        game = self.session.game
        if self._resuming and self._begin_s is not None and not self._begun:
            return min(3, 1 + int(3 * (self._begin_s - self._time_s) / RESUME_S))
        left_s = (game.config.time_limit_s or 0.0) - game.time_s
        return ceil(left_s) if 0 < left_s <= _LAST_S and game.phase is Phase.RUNNING else 0

    def _warn(self) -> None:
        """Sound a count down, and a stack that has come near the top."""
        (count, danger), game = self._warned, self.session.game
        self._warned = self._count, in_danger(game)
        if self._warned[0] not in (0, count):
            self._stage.sounds.play("count", "effects")
        if self._warned[1] and not danger:
            self._stage.sounds.play("danger", "effects")

    def _ask_restart(self) -> None:
        """Begin anew; a game of more than ASK_S is paused, and the menu offers it."""
        game = self.session.game
        if self.by_hand and game.phase is not Phase.OVER and game.time_s > ASK_S:
            self.pause(self._stage.look.words("pause.restart"))
        else:
            self._restart(self)

    def _play(self, due: list[DueAction[Action]]) -> None:
        game, time_s = self.session.game, self._time_s
        if game.phase is Phase.OVER and all(each.action is not Action.UNDO for each in due):
            self._over_s = self._time_s if self._over_s is None else self._over_s
            if self._time_s >= self._over_s:
                self._over_s = self._time_s + _REST_S
                self._over(self)
            return
        began_s = self._begin_s or 0.0
        self._over_s = None
        for at_s, action, repeated, held in due:
            if not (repeated and self._idle(action)):
                at_s = min(max(at_s, began_s), time_s)
                self._update(at_s, [action], held, commands=int(not repeated))
        planned = self._bot.actions(game, time_s) if self._bot else []
        self._update(time_s, planned, self._down, commands=len(planned))
        if game.phase is Phase.OVER and self._over_s is None:
            self._over_s = time_s + _REST_S

    def _update(
        self, at_s: float, actions: list[Action], held: Collection[Action], commands: int = 0
    ) -> None:
        """Act with what is held down at that moment, not yet with presses still to come."""
        at_s = max(at_s, self.session.recorder.time_s)  # presses while another screen was seen
        if Action.HOLD in actions or Action.HOLD not in held:
            self._hold_spent = False  # one press is one hold
        spent = (Action.HOLD,) if self._hold_spent else ()
        kind = self._stage.settings.initial
        early = held if kind == "hold" else self._tapped if kind == "tap" else ()
        initial = [action for action in _INITIAL if action in early and action not in spent]
        events = self.session.update(
            at_s, actions, commands=commands, soft_drop=Action.DOWN in held, initial=initial
        )
        if self._bot:
            self._bot.watch(events)
        self._hold_spent |= any(isinstance(event, Held) for event in events)
        self._follow(events)
        if not self.session.game.in_play:
            self._tapped.update(actions)
        self._show(events)

    def _follow(self, events: list[Event]) -> None:
        """Forget what was meant for the piece before; a hint that began with a hold goes on."""
        kinds = {type(event) for event in events}
        if Spawned not in kinds:
            return
        self._tapped.clear()
        hint, self._hint = self._hint, None
        if hint and hint.actions[0] is Action.HOLD and Held in kinds and Locked not in kinds:
            self._hint = replace(hint, actions=hint.actions[1:])

    def _idle(self, action: Action) -> bool:
        """Return whether a shift that repeats at once has nowhere to go; replays need it not."""
        game = self.session.game
        if self._stage.settings.arr_ms or not game.in_play:
            return False
        piece = game.piece.left if action is Action.LEFT else game.piece.right
        return bool(game.board.bits & piece.mask)

    def _show(self, events: list[Event]) -> None:
        self._view.show(events)
        self._heard += events
        self._stage.watch(events)

    # -- what comes out ----------------------------------------------------------------

    def draw(self, surface: pygame.Surface, time_s: float) -> list[pygame.Rect]:
        """Draw the game."""
        game, mode, pace = self.session.game, self.session.mode, self.session.pace
        figures = figures_of(
            game,
            self._stage.settings.figures,
            by_time=mode.ranking == "time",
            rate_hz=pace.rate_hz if pace else None,
            commands_per_piece=self.session.commands_per_piece,
        )
        self._view.place(self._stage.area, self._stage.look)
        changed = self._view.draw(
            surface,
            game,
            self._time_s,
            figures=figures,
            hint=self._hint,
            ready=self._ready(),
            kept=self._stage.kept,
        )
        if self._stage.screen is self:
            self._draw_button(surface)
        return changed

    def _ready(self) -> str:
        """Return what is said before the first piece, or the count down after a pause."""
        if self._begun or self._stage.screen is not self:
            return ""
        return str(self._count or self._stage.look.words("view.ready"))

    def _draw_button(self, surface: pygame.Surface) -> None:
        palette, place = self._stage.look.palette, self.button
        pygame.draw.rect(surface, palette.raised, place, border_radius=place.width // 4)
        bar = pygame.Rect(0, 0, place.width // 6, round(0.46 * place.height))
        for shift in (-1, 1):
            bar.center = place.centerx + shift * place.width // 6, place.centery
            pygame.draw.rect(surface, palette.text, bar, border_radius=1)
