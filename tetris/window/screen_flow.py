"""Flow between screens: from the title to a game, its pause and its end, and back."""

import secrets
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from tetris.bots import BOTS
from tetris.engine.game import Finish, Game
from tetris.engine.modes import MODES, Mode
from tetris.history.replay import Player, Recorder
from tetris.history.replay_file import ReplayError, load
from tetris.kit.menu import Item, Menu, Row
from tetris.kit.settings import Settings, stepped
from tetris.kit.stage import Stage
from tetris.window.game_session import BotPlayer, SavedGame, Saves, Session
from tetris.window.menu_screen import AttractMode, MenuScreen
from tetris.window.pages import (
    BindingScreen,
    back_item,
    best_screen,
    control_item,
    open_settings,
    replays_screen,
    result_rows,
)
from tetris.window.play_screen import PlayScreen
from tetris.window.replay_screen import ReplayScreen

_SEED_BITS: Final = 32
_BOT_ACTION_S: Final = 0.08  # quick, and still to be followed by eye
_QUIET_S: Final = 0.6  # without input, before the results take any
_TITLES: Final = {Finish.GOAL: "over.won", Finish.TIME: "over.time"}


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
        self._attract = AttractMode(stage)
        self._help: BindingScreen | None = None  # shown last
        self.game: Game | None = None  # the one played last

    @property
    def mode(self) -> Mode:
        """The mode of the settings; the usual one for a name that is unknown here."""
        chosen, usual = (
            getattr(settings, self._stage.mode_setting)
            for settings in (self._stage.settings, Settings())
        )
        return MODES.get(chosen) or MODES[usual]

    def begin(self, start: Start) -> None:
        """Show the first screens."""
        attract, nowhere = self._attract, lambda: None  # a game is closed by choosing so
        self._stage.push(MenuScreen(self._stage, self._title, attract=attract, back=nowhere))
        if start.replay is not None:
            self.watch(start.replay)
        elif any(each is not None for each in (start.mode, start.seed, start.level, start.bot)):
            mode = MODES.get(start.mode or "") or self.mode
            if start.mode is None and start.level is not None and not mode.levels:
                mode = next(mode for mode in MODES.values() if mode.levels)
            self.play(mode, seed=start.seed, level=start.level, player=start.bot)

    def _title(self) -> Menu:
        stage, words = self._stage, self._stage.look.words
        play = partial(MenuScreen, stage, self._modes, attract=self._attract)
        settings = partial(open_settings, stage, self._attract)
        about = "title.orb" if stage.mode_setting == "orb_mode" else "title.play"
        items = [
            Item(words("menu.play"), lambda: stage.push(play()), hint=words(about)),
            *stage.further(),
            Item(words("menu.settings"), settings, hint=words("title.settings")),
            Item(words("menu.quit"), stage.quit),
        ]
        return Menu(stage.name, items, notice=stage.notice, corner=True)

    def _modes(self) -> Menu:
        """Return the page from which games begin, and those that were played are reached."""
        stage, saves, attract, mode = self._stage, self._saves, self._attract, self.mode
        words = stage.look.words
        title, text = words(f"modes.{mode.name}.title"), words(f"modes.{mode.name}.text")

        def turn_level(step: int) -> None:
            stage.change(stepped(stage.settings, "level", step))

        def best() -> None:
            stage.push(best_screen(stage, saves, attract, self.mode.name))

        def replays() -> None:
            stage.push(replays_screen(stage, saves, attract, self.watch))

        items = [
            Item(words("menu.start"), lambda: self.play(self.mode), hint=text),
            Item(words("menu.mode"), value=title, step=self._turn_mode, hint=text),
        ]
        if mode.levels:
            level = str(stage.settings.level)
            items.append(Item(words("menu.level"), value=level, step=turn_level, hint=text))
        items += [
            *control_item(stage),
            Item(words("menu.best"), best, hint=words("title.best")),
            Item(words("menu.replays"), replays, hint=words("title.replays")),
            back_item(stage),
        ]
        return Menu(words("menu.play"), items, notice=stage.notice)

    def _turn_mode(self, step: int) -> None:
        stage, names = self._stage, list(MODES)
        name = names[(names.index(self.mode.name) + step) % len(names)]
        chosen: dict[str, Any] = {stage.mode_setting: name}
        stage.change(replace(stage.settings, **chosen))

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
        session = Session.new(mode, chosen, self._stage.settings, level=level)
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

    def _pause(self, screen: PlayScreen, reason: str, cures: Sequence[Item]) -> None:
        stage = self._stage

        def resume() -> None:
            stage.pop()
            screen.resume()

        def build() -> Menu:
            words = stage.look.words
            items = (
                Item(words("menu.resume"), resume),
                *cures,
                Item(words("menu.restart"), partial(self._restart, screen)),
                Item(words("menu.settings"), partial(open_settings, stage)),
                Item(words("menu.leave"), partial(self._leave, screen)),
            )
            return Menu(words("pause.title"), items, notice=reason or stage.notice)

        stage.push(MenuScreen(stage, build, behind=screen, back=resume))

    def _over(self, screen: PlayScreen) -> None:
        kept, leave = self._saves.keep(screen.session), self._stage.home
        self._stage.notice = self._stage.told(kept.notice)
        build = partial(self._results, screen.session, kept)
        self._stage.push(
            MenuScreen(self._stage, build, behind=screen, back=leave, quiet_s=_QUIET_S)
        )

    def _results(self, session: Session, kept: SavedGame) -> Menu:
        words, mode, result = self._stage.look.words, session.mode, session.game.result
        title = _TITLES[result] if isinstance(result, Finish) else "over.lost"
        table = result_rows(session, words)
        if kept.place:
            best = words("over.best") if kept.place == 1 else words("over.place", place=kept.place)
            table.insert(0, Row((best,), marked=True))
        items = (
            Item(words("menu.again"), partial(self.play, mode)),
            Item(words("menu.watch"), lambda: self._watch(Player(session.recorder.replay()))),
            Item(words("menu.leave"), self._stage.home),
        )
        return Menu(words(title), items, table, notice=self._stage.notice)

    def _restart(self, screen: PlayScreen) -> None:
        self._saves.keep(screen.session)
        self.play(screen.session.mode)

    def _leave(self, screen: PlayScreen) -> None:
        self._stage.notice = self._stage.told(self._saves.keep(screen.session).notice)
        self._stage.home()

    def toggle_help(self) -> None:
        """Show the keys, and pause a game for it; or leave them again."""
        stage = self._stage
        if self._help and stage.screen is self._help:
            stage.pop()
            return
        if isinstance(stage.screen, PlayScreen):
            stage.screen.pause()
        self._help = BindingScreen(stage, "keys")
        stage.push(self._help)

    def watch(self, path: Path) -> None:
        """Show a replay's file, or say why it cannot be shown."""
        try:
            replay = load(path)
        except ReplayError as error:
            self._stage.notice = self._stage.told(str(error))
            return
        self._stage.notice = ""
        self._watch(Player(replay))

    def _watch(self, player: Player) -> None:
        self._stage.push(ReplayScreen(self._stage, player, take_over=self.go_on))

    def go_on(self, recorder: Recorder) -> None:
        """Let the player go on with a game that was recorded so far; it is not ranked."""
        mode = MODES.get(recorder.mode) or next(iter(MODES.values()))
        self._show(Session(mode, recorder), mode)
