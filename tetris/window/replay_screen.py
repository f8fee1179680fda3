"""A replay on the screen: play, stop, seek both ways, and play on from any moment."""

from collections.abc import Callable
from typing import Final

import pygame

from tetris.engine.modes import MODES
from tetris.history.replay import Player, Recorder
from tetris.kit.bindings import Code
from tetris.kit.menu import Item, Menu
from tetris.kit.stage import IDLE_HZ, PLAY_HZ, Stage
from tetris.kit.theme import draw_bar
from tetris.window.effects import sounds_of
from tetris.window.menu_screen import MenuScreen
from tetris.window.play_screen import LONGEST_S
from tetris.window.view import GameView, clock, figures_of

_SPEEDS: Final = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
_USUAL: Final = 2  # which of them
_STEP_S: Final = 5.0  # of a seek
_COLUMN: Final = 430  # width of the menu, design units
_TALL: Final = 1.2  # height of a window to its width, from which menu and game are stacked


class ReplayScreen(MenuScreen):
    """Plays a replay beside a menu that commands it."""

    def __init__(
        self,
        stage: Stage,
        player: Player,
        *,
        take_over: Callable[[Recorder], None],
    ) -> None:
        """Show a replay from its start; `take_over` plays on from where it has come to."""
        self._player, self._take_over = player, take_over
        self._playing, self._speed = True, _USUAL
        self._seen_s: float | None = None
        self._game_view = GameView(stage.area, look=stage.look)
        super().__init__(stage, self._page)

    def tick(self, time_s: float) -> None:
        """Let the replay go on."""
        super().tick(time_s)
        passed_s = min(LONGEST_S, time_s - self._seen_s) if self._seen_s is not None else 0.0
        self._seen_s = time_s
        player = self._player
        if self._playing and not player.at_end:
            events = player.advance(player.time_s + passed_s * _SPEEDS[self._speed])
            self._game_view.show(events)
            for sound in sounds_of(events):
                self._stage.sounds.play(sound, "effects")
            self._playing = not player.at_end
        self.rebuild()

    @property
    def frames_hz(self) -> int:
        """As a game while it plays."""
        return PLAY_HZ if self._playing else IDLE_HZ

    def press(self, code: Code, time_s: float) -> None:
        """Move about; space plays and stops wherever one is."""
        if code == pygame.K_SPACE:
            self._toggle()
        else:
            super().press(code, time_s)

    def _page(self) -> Menu:
        words, player = self._stage.look.words, self._player
        here_s, whole_s = player.time_s - player.start_s, player.replay.length_s
        place = f"{clock(here_s)[:-3]} / {clock(whole_s)[:-3]}"
        times = words("settings.times", value=words.number(_SPEEDS[self._speed], "g"))
        items = [
            Item(words("replays.stop" if self._playing else "replays.play"), self._toggle),
            Item(words("replays.position"), value=place, step=self._seek),
            Item(words("replays.speed"), value=times, step=self._faster),
            Item(words("replays.take_over"), self._play_on, hint=words("replays.take_over_hint")),
            Item(words("menu.back"), self._stage.pop),
        ]
        notice = words("replays.differs") if player.differs else ""
        mode = player.replay.mode
        title = words(f"modes.{mode}.title") if mode in MODES else words("replays.title")
        return Menu(title, items, notice=notice)

    def _toggle(self) -> None:
        if self._player.at_end:
            self._player.seek(self._player.start_s)
            self._playing = True
        else:
            self._playing = not self._playing

    def _seek(self, step: int) -> None:
        self._player.seek(self._player.time_s + step * _STEP_S)
        self._game_view.clear()  # what flashed there is not to be seen here

    def _faster(self, step: int) -> None:
        self._speed = max(0, min(len(_SPEEDS) - 1, self._speed + step))

    def _play_on(self) -> None:
        if not self._player.at_end:
            self._take_over(self._player.take_over())

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the menu, the game, and how far it is."""
        stage, area, unit = self._stage, self._stage.area, self._stage.unit
        palette = stage.look.palette
        surface.fill(palette.background)
        column, beside = self._places(area, unit)
        self._game_view.place(beside, stage.look)
        game = self._player.game
        mode = MODES.get(self._player.replay.mode)
        chosen, by_time = self._stage.settings.figures, bool(mode and mode.ranking == "time")
        figures = figures_of(game, chosen, by_time=by_time)
        self._game_view.draw(surface, game, self._player.time_s, figures=figures)
        self._view.draw(surface, column, self._menu, self.selected, unit)
        self._draw_bar(surface, area, unit)

    def _places(self, area: pygame.Rect, unit: float) -> tuple[pygame.Rect, pygame.Rect]:
        """Return where the menu and the game are: side by side, or in a tall window stacked."""
        bottom = area.bottom - round(54 * unit)
        if area.height > _TALL * area.width:
            high = min(self._view.height(self._menu, unit), bottom // 2)
            column = pygame.Rect(0, bottom - high, area.width, high)
            return column, pygame.Rect(0, 0, area.width, column.top - round(12 * unit))
        left, top = round(24 * unit), round(min(56 * unit, 0.08 * area.height))
        column = pygame.Rect(left, top, round(_COLUMN * unit), bottom - top)
        column.width = min(column.width, area.width // 2)
        return column, pygame.Rect(column.right, 0, area.width - column.right, bottom)

    def _draw_bar(self, surface: pygame.Surface, area: pygame.Rect, unit: float) -> None:
        palette, player = self._stage.look.palette, self._player
        track = self._track(area, unit)
        length_s = player.replay.length_s
        share = (player.time_s - player.start_s) / length_s if length_s else 1.0
        draw_bar(surface, palette, track, share)
        centre = track.left + round(track.width * share), track.centery
        pygame.draw.circle(surface, palette.text, centre, round(9 * unit))

    def _track(self, area: pygame.Rect, unit: float) -> pygame.Rect:
        track = pygame.Rect(0, 0, area.width - round(64 * unit), max(4, round(6 * unit)))
        track.center = area.centerx, area.bottom - round(32 * unit)
        return track

    def mouse(self, event: pygame.event.Event, time_s: float) -> None:
        """Seek on the bar; else choose from the menu."""
        track = self._track(self._stage.area, self._stage.unit)
        near = track.inflate(0, round(36 * self._stage.unit))
        pressed = event.type == pygame.MOUSEBUTTONDOWN and event.button == 1
        dragged = event.type == pygame.MOUSEMOTION and event.buttons[0]
        if (pressed or dragged) and near.collidepoint(event.pos):
            share = (event.pos[0] - track.left) / track.width
            self._player.seek(self._player.start_s + share * self._player.replay.length_s)
            self._game_view.clear()
        else:
            super().mouse(event, time_s)
