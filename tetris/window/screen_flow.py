"""Flow between screens: from the title to a game, its pause and its end, and back."""

import secrets
from dataclasses import dataclass
from pathlib import Path

from tetris.bots import BOTS
from tetris.engine.game import Game
from tetris.engine.modes import MODES, Mode
from tetris.history.replay import Player, Recorder
from tetris.history.replay_file import ReplayError, load
from tetris.kit.stage import Stage
from tetris.window.game_session import BotPlayer, Saves, Session
from tetris.window.screens.menu_screen import AttractMode, MenuScreen
from tetris.window.screens.menus import (
    best_screen,
    chosen_mode,
    help_screen,
    over_screen,
    pause_screen,
    replays_screen,
    title_screen,
)
from tetris.window.screens.pages import open_settings
from tetris.window.screens.play_screen import PlayScreen
from tetris.window.screens.replay_screen import ReplayScreen

_SEED_BITS = 32
_BOT_ACTION_S = 0.08  # quick, and still to be followed by eye


@dataclass(frozen=True, slots=True)
class Start:
    """Game or replay with which the window begins; without any, the menu."""

    mode: str | None = None  # that of the settings, or if that has no levels, the first with some
    seed: int | None = None  # a new game each time if there is none
    level: int | None = None  # that of the settings if there is none
    bot: str | None = None  # plays in the player's place
    replay: Path | None = None  # the file of one to show


class ScreenFlow:
    """Leads from screen to screen."""

    def __init__(self, stage: Stage, saves: Saves) -> None:
        self._stage, self._saves = stage, saves
        self._attract = AttractMode()
        self._help: MenuScreen | None = None  # shown last
        self.game: Game | None = None  # the one played last

    def begin(self, start: Start) -> None:
        """Show the first screens."""
        stage, saves, attract = self._stage, self._saves, self._attract
        title = title_screen(
            stage,
            attract,
            play=lambda: self.play(chosen_mode(stage)),
            best=lambda: stage.push(best_screen(stage, saves, attract)),
            replays=lambda: stage.push(replays_screen(stage, saves, attract, self.watch)),
            settings=lambda: open_settings(stage, attract),
        )
        stage.push(title)
        if start.replay is not None:
            self.watch(start.replay)
        elif any(each is not None for each in (start.mode, start.seed, start.level, start.bot)):
            mode = MODES.get(start.mode or "") or chosen_mode(stage)
            if start.mode is None and start.level is not None and not mode.levels:
                mode = next(mode for mode in MODES.values() if mode.levels)
            self.play(mode, seed=start.seed, level=start.level, player=start.bot)

    def play(
        self,
        mode: Mode,
        *,
        seed: int | None = None,
        level: int | None = None,
        player: str | None = None,
    ) -> None:
        """Begin a game."""
        chosen = secrets.randbits(_SEED_BITS) if seed is None else seed
        session = Session(mode, chosen, self._stage.settings, level=level)
        self._show(session, mode, level, player)

    def _show(
        self, session: Session, mode: Mode, level: int | None = None, player: str | None = None
    ) -> None:
        again = lambda _: self.play(mode, level=level, player=player)  # noqa: E731
        self.game = session.game
        screen = PlayScreen(
            self._stage,
            session,
            paused=self._pause,
            over=again if player else self._over,
            restart=again if player else self._restart,
            bot=BotPlayer(_BOT_ACTION_S, BOTS[player]) if player else None,
        )
        self._stage.home(screen)

    def _pause(self, screen: PlayScreen, reason: str) -> None:
        self._stage.push(
            pause_screen(
                self._stage,
                screen,
                reason=reason,
                restart=lambda: self._restart(screen),
                settings=lambda: open_settings(self._stage),
                leave=lambda: self._leave(screen),
            )
        )

    def _over(self, screen: PlayScreen) -> None:
        kept = self._saves.keep(screen.session)
        self._stage.notice = kept.notice
        session = screen.session
        self._stage.push(
            over_screen(
                self._stage,
                screen,
                kept,
                again=lambda: self.play(session.mode),
                watch=lambda: self._watch(Player(session.recorder.replay())),
                leave=lambda: self._stage.home(),
            )
        )

    def _restart(self, screen: PlayScreen) -> None:
        self._saves.keep(screen.session)
        self.play(screen.session.mode)

    def _leave(self, screen: PlayScreen) -> None:
        self._stage.notice = self._saves.keep(screen.session).notice
        self._stage.home()

    def toggle_help(self) -> None:
        """Show the keys in use, and pause a game for it; or leave them again."""
        stage = self._stage
        if self._help and stage.screen is self._help:
            stage.pop()
            return
        if isinstance(stage.screen, PlayScreen):
            stage.screen.pause()
        self._help = help_screen(stage)
        stage.push(self._help)

    def watch(self, path: Path) -> None:
        """Show a replay's file, or say why it cannot be shown."""
        try:
            replay = load(path)
        except ReplayError as error:
            self._stage.notice = str(error)
            return
        self._stage.notice = ""
        self._watch(Player(replay))

    def _watch(self, player: Player) -> None:
        self._stage.push(ReplayScreen(self._stage, player, take_over=self.go_on))

    def go_on(self, recorder: Recorder) -> None:
        """Let the player go on with a game that was recorded so far; it is not ranked."""
        mode = MODES.get(recorder.mode) or next(iter(MODES.values()))
        self._show(Session.going_on(mode, recorder), mode)
