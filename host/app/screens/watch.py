"""The demo in the window: the virtual orb's own hand plays, and the player may take over."""

import math
import secrets
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import pygame

from controller.shared.event_metric import Score
from controller.shared.protocol.messages import Command, GroundTruth, Perform, Report
from host.actions import ACTIONS
from host.app.screen import GamePage, Line, Orb
from host.demo.autoplayer import Autoplayer, DemoRecord
from host.ui import naming
from tetris.engine.game import Action, Phase
from tetris.engine.modes import MODES
from tetris.history.replay import Recorder
from tetris.kit import theme
from tetris.kit.menu import Menu
from tetris.kit.stage import Stage
from tetris.window.game_session import Session
from tetris.window.view import Figure, figures_of

_SEED_BITS: Final = 31
_STUCK_S: Final = 8.0  # a performance that has not ended by then was not begun
_HUSH_S: Final = 0.8  # after leaving, in which the last gesture may still be recognised
_LONGEST_S: Final = 0.1  # time that one frame may bring: the game waits while it is not seen
_STOP: Final = Perform(0, "", 0.0, 0.0)

TakeOver = Callable[[Recorder], None]


class WatchScreen(GamePage):
    """A game that only recognised commands play, and what the hand meant by them.

    Attributes:
        session: The game; its clock stands still while the orb is away.
        record: What was meant and understood since the orb was connected.
        score: The record's last judgement.
    """

    def __init__(
        self, stage: Stage, orb: Orb, take_over: TakeOver, seed: int | None = None
    ) -> None:
        """Begin a game of a seed, or of any; `take_over` goes on with it as the player's game."""
        seed = secrets.randbits(_SEED_BITS) if seed is None else seed
        self.session = Session.new(MODES["orb_marathon"], seed, stage.settings)
        self._time_s, self._seen_s = 0.0, stage.time_s  # of the game, and of the last frame
        self._chosen = stage.settings.figures
        self._take_over, self._free = take_over, False  # whether the dome has been let go
        self._meet(orb)
        super().__init__(stage, orb, self.session.game)

    def _meet(self, orb: Orb) -> None:
        """Let a hand begin that knows this orb."""
        self._welcome = orb.state.welcome
        self.record, self.score = DemoRecord(), Score()
        self._player = Autoplayer(self.session.recorder.seed, math.inf)
        self._player_s = self._time_s  # when it began
        self._last: Perform | None = None  # what the hand did last
        self._busy_s: float | None = None  # since when that has been under way
        self._understood = ""  # the last command since then
        if self._welcome is not None:
            self._player.meet(self._welcome)

    def page(self) -> Menu:
        """Return the ways out."""
        take_over = self.item("watch.take_over", self._hand_over, hint="")
        return Menu(self.words("watch.title"), [take_over, self.back_item()])

    # -- what the orb says ---------------------------------------------------------------

    def recognised(self, command: Command, time_s: float) -> bool:
        """Let the game do what was understood."""
        action, over = ACTIONS.get(command.name), self.game.phase is Phase.OVER
        if over:
            action = Action.RESTART if action is Action.HARD_DROP else None
        if action is not None and action is not Action.PAUSE:
            self.show(self.session.update(self._time_s, [action], commands=1))
        self.record.commands.append((round(time_s * 1000), command.name))
        self._understood = command.name
        if self._busy_s is None:
            self.score = self.record.score()
        return True

    def report(self, message: Report, time_s: float) -> None:
        """Take what the hand truly did; its times are shifted to the clock of the commands."""
        if not isinstance(message, GroundTruth) or message.number not in self.record.meant:
            return
        end_ms = round(time_s * 1000)
        begun_ms = end_ms - (message.release_ms - message.onset_ms)
        self.record.truths.append(replace(message, onset_ms=begun_ms, release_ms=end_ms))
        self._ended(message.number)
        self.score = self.record.score()

    def _ended(self, number: int) -> None:
        self._busy_s = None
        self._player.left(number, self._time_s - self._player_s)

    # -- time ----------------------------------------------------------------------------

    @property
    def _away(self) -> bool:
        return self.orb.state.link != "live" or not self.orb.state.ready

    def tick(self, time_s: float) -> None:
        """Let the game's time pass, and the hand decide; a touch of the player takes over."""
        passed_s, self._seen_s = time_s - self._seen_s, time_s
        self.orb.note = self.words("watch.label")
        super().tick(time_s)
        if self.orb.state.contacts:  # a pinch that opened this page may still be held
            if self._free:
                self._hand_over()
            return
        self._free = True
        if self.orb.state.welcome is not self._welcome:
            self._meet(self.orb)
        if self._away:
            return
        self._time_s += min(_LONGEST_S, max(0.0, passed_s))
        self.show(self.session.update(self._time_s))
        if self._busy_s is not None and self._last and self._time_s > self._busy_s + _STUCK_S:
            self._ended(self._last.number)
        if decision := self._player.decide(self.game, self._time_s - self._player_s):
            self._perform(*decision)

    def _perform(self, performance: Perform, command: str) -> None:
        self.record.meant[performance.number] = command
        self._last, self._busy_s, self._understood = performance, self._time_s, ""
        self.orb.send(performance)

    def _hand_over(self) -> None:
        self._stop()
        self._take_over(self.session.recorder)

    def leave(self) -> None:
        """Stop the hand, and go back."""
        self._stop()
        self.orb.ignore(_HUSH_S)
        super().leave()

    def _stop(self) -> None:
        self.orb.send(_STOP)
        self.orb.note = ""

    # -- what is seen --------------------------------------------------------------------

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the page, and above the board that this is a demo."""
        super().draw(surface, self._time_s)
        accent, board = self._stage.look.palette.accent, self._game_view.layout.board
        label = theme.fitted(self.words("watch.board"), board.width // 10, accent, board.width)
        surface.blit(label, label.get_rect(midbottom=board.move(0, -3).midtop))

    def figures(self) -> Sequence[Figure]:
        """Return the game's numbers."""
        return figures_of(self.game, self._chosen)

    def lines(self, time_s: float) -> list[Line]:
        """Return what the hand means, what was understood, and how often the two agreed."""
        words, palette, score = self.words, self._stage.look.palette, self.score
        if self._away:
            return [Line(words("watch.away"), 25, palette.warn)]
        counts = words("watch.counts", hits=score.hits, intended=score.intended)
        alarms = score.false_alarms + score.duplicates
        faults = words("watch.faults", missed=score.missed, wrong=score.wrong, alarms=alarms)
        return [
            Line(words("watch.means"), 22, palette.dim, after=2),
            self._intention(),
            Line(words("watch.understood"), 22, palette.dim, after=2),
            self._answer(),
            Line(counts, 27, palette.text, after=2),
            Line(faults, 22, palette.dim, after=20),
            Line(words("watch.take_over_hint"), 22, palette.dim),
        ]

    @property
    def _command(self) -> str:
        """What the hand means; "" for nothing."""
        return self.record.meant[self._last.number] if self._last else ""

    def _intention(self) -> Line:
        words, palette = self.words, self._stage.look.palette
        if self._last is None:
            return Line(words("watch.waiting"), 32, palette.dim, after=16)
        if command := self._command:
            return Line(naming.command(words, command), 32, palette.text, command, after=16)
        return Line(words("watch.stray_touch"), 32, palette.dim, "null", after=16)

    def _answer(self) -> Line:
        words, palette, understood = self.words, self._stage.look.palette, self._understood
        if understood:
            colour = palette.good if understood == self._command else palette.bad
            return Line(naming.command(words, understood), 32, colour, understood, after=20)
        if self._last is None or self._busy_s is not None:
            return Line(words("watch.waiting"), 32, palette.dim, after=20)
        missed = bool(self._command)
        colour = palette.bad if missed else palette.good
        return Line(words("watch.nothing" if missed else "watch.stray"), 32, colour, "null", 20)
