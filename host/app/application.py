"""The application: the game's window with the dome docked, and what passes between the two."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import pygame

from controller.shared.notices import Notice
from controller.shared.protocol.messages import Command, Message, Report, State, UploadStatus
from host.actions import ACTIONS, HeldGestures
from host.app.aiming import Aiming
from host.app.correction_keys import CorrectionKeys
from host.app.guides import Guides
from host.app.lab_data import LabData
from host.app.orbs import Orbs
from host.app.programs import Programs
from host.app.screen import Orb, OrbScreen
from host.app.screens.lab import LabScreen
from host.app.screens.orbs import OrbsScreen
from host.app.screens.phone import PhoneScreen
from host.app.screens.teach.gesture import GesturePage
from host.connection.receiver import Connected, Delivered, Lost, Received, Refused, Stale
from host.targets import SIZE, TargetOptions
from host.ui.naming import said
from host.ui.orb_state import pulse_strength
from host.ui.panel.panel import Panel
from host.ui.panel.panel_layout import Dock
from tetris.engine.board import EMPTY
from tetris.engine.events import Event
from tetris.engine.game import Action, Game
from tetris.files import config_folder, data_folder
from tetris.kit.language import FALLBACK, Words
from tetris.kit.menu import Item, MenuStep
from tetris.kit.stage import Screen, Stage
from tetris.window.app import App, Start
from tetris.window.menu_screen import MenuScreen
from tetris.window.play_screen import PlayScreen

_MOUSE: Final = pygame.MOUSEMOTION, pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP, pygame.MOUSEWHEEL
_FINGERS: Final = (pygame.FINGERDOWN, pygame.FINGERMOTION, pygame.FINGERUP)
_RIGHT_BUTTON: Final = 3
_BUTTONS: Final = (1, _RIGHT_BUTTON)
_TWO_FINGERS: Final = pygame.K_2
_ARMED: Final = "disarmed", "armed"
_LONG_S: Final = 2.0  # a pinch held so long leaves a page on which gestures are no steps
_UNUSED_HZ, _IDLE_HZ, _LIVELY_HZ = 3, 10, 60  # pictures a second
_UNUSED_S: Final = 10.0  # without input, after which a menu is drawn least often


class OrbApp(Orb):
    """The game's screens, and the orb that plays in them.

    Attributes:
        game: The window of the game, which is a part of this one.
        dock: Where the game and the panel are.
    """

    def __init__(
        self,
        start: Start = Start(),  # noqa: B008 (frozen)
        *,
        config: Path | None = None,
        data: Path | None = None,
        sound: bool = True,
        demo: int | None = None,
    ) -> None:
        """Set up the first screen; without a folder, settings or games are not kept.

        With the seed of a demo it is a game that the virtual orb's own hand plays.
        """
        super().__init__()
        self.orbs: Orbs | None = None  # set by a program that can change the orb
        self.programs, self.lab = Programs(), LabData()
        self._behind = False  # whether another window has the focus
        self.dock = Dock.of(SIZE)
        self._guides = Guides(
            self,
            play=lambda: self.game.flow.play(self.game.flow.mode),
            go_on=lambda past: self.game.flow.go_on(past),
        )
        self.game = App(
            pygame.Surface(self.dock.game.size),
            start,
            config=config,
            data=data,
            sound=sound,
            items=lambda stage: [*self._guides.items(stage), *self._orb_items(stage)],
        )
        self.stage.name, self.stage.told = "OrbTouch", self._told
        self.stage.notice = self._told(self.stage.notice)  # of reading the settings
        self.panel = Panel()
        self.stage.watch = self._happened
        self._correcting = CorrectionKeys(self.send)
        self._gestures = HeldGestures(self.stage.settings)
        self.aiming = Aiming(self.stage, self.orb)
        self._button = 0  # of the mouse, held on the dome
        self._events: list[pygame.event.Event] = []  # for the game, since the last tick
        self._pause: Screen | None = None  # the menu of a pause that the link made
        self._used_s = 0.0  # when there was input last
        self._long_s = math.inf  # when a held pinch leaves the page
        self._taken = False  # whether the page took the last gesture for itself
        self._surface: pygame.Surface | None = None
        self._size = SIZE
        if demo is not None:
            self._guides.watch(self.stage, demo)
        elif config is not None and start == Start():
            self._guides.offer(self.stage)

    @property
    def stage(self) -> Stage:
        """The screens."""
        return self.game.stage

    @property
    def words(self) -> Words:
        """The language of the window."""
        return self.stage.look.words

    def _told(self, sentence: str) -> str:
        """Return a notice in the language in use; of English text one that leads to it."""
        if not sentence or self.words.name == FALLBACK or isinstance(sentence, Notice):
            return said(self.words, sentence)
        self.originals[sentence] = None
        return self.words("orb.trouble")

    @property
    def fullscreen(self) -> bool:
        """Whether the player wants the window to fill the screen."""
        return self.stage.settings.fullscreen

    @fullscreen.setter
    def fullscreen(self, wanted: bool) -> None:
        self.stage.change(replace(self.stage.settings, fullscreen=wanted))

    def _orb_items(self, stage: Stage) -> list[Item]:
        """Return the item that leads to the orbs, if the program can change them."""
        if self.orbs is None:
            return []
        show = partial(OrbsScreen, stage, self, self.orbs, self.programs, self._show_lab)
        words, do = stage.look.words, lambda: stage.push(show())
        return [Item(words("orbs.title"), do, hint=words("orbs.hint"))]

    def _show_lab(self) -> None:
        screen = self.stage.screen
        if isinstance(screen, LabScreen):
            screen.leave()
            return
        self._over_game(LabScreen(self.stage, self, self.lab))

    def show_phone(self) -> None:
        """Show the code for a phone."""
        self._over_game(PhoneScreen(self.stage, self))

    def _over_game(self, page: Screen) -> None:
        if isinstance(self.stage.screen, PlayScreen):
            self.stage.screen.pause()
        self.stage.push(page)

    @property
    def frames_hz(self) -> int:
        """How often the window has something new to show: the screen's or the panel's need."""
        if self.orb.lively(self._now_s):
            return max(_LIVELY_HZ, self.game.frames_hz)
        unused = self._now_s >= self._used_s + _UNUSED_S and type(self.stage.screen) is MenuScreen
        return _UNUSED_HZ if unused else max(_IDLE_HZ, self.game.frames_hz)

    def _happened(self, events: Sequence[Event]) -> None:
        """Let the dome answer what happened in a game."""
        if self.stage.settings.motion:
            self.orb.rim.strike(pulse_strength(events), self._now_s)

    # -- what comes over the link --------------------------------------------------------

    def tick(self, now_s: float, received: Sequence[Received] = ()) -> None:
        """Advance to the present time and process received events, oldest first."""
        self._now_s = now_s
        self._used_s = now_s if self._events or self.orb.lively(now_s) else self._used_s
        for item in received:
            self._take(item, now_s)
        self._upload([*received])
        if self.orbs is not None:
            self.orbs.tick()
        self.programs.tick(now_s, received, behind=self._behind)
        self.aims = self.aiming.expected
        if now_s >= self._long_s:
            self._long_s = math.inf
            self.game.act(Action.PAUSE)
        repeats = self._gestures.poll(now_s)
        lowering = [Action.DOWN] if self._gestures.soft_drop(now_s) else []
        self.game.hold(lowering, repeats)
        events, self._events = self._events, []
        self.closed = not self.game.advance(now_s, events)
        screen = self.stage.screen  # what is taught is pressed as in the game that follows
        teaches = self.aiming.on and isinstance(screen, GesturePage)
        self.touch.light = teaches or self.aiming.game(screen) is not None
        self.orb.advance(now_s)

    def _take(self, item: Received, now_s: float) -> None:
        self.observe(item, now_s)
        match item:
            case Connected(welcome=welcome):
                self.lessons.connected()
                self.lab.connected(welcome)
                self._gestures = HeldGestures(self.stage.settings, welcome.rate_hz)
                self.aiming.connected(welcome)
                self._go_on(now_s)
            case Stale() | Lost() | Refused():
                self._gestures.hold((), now_s)
                self.aiming.lost()
                self._wait("orb.silent" if isinstance(item, Stale) else "orb.lost")
                if isinstance(self.stage.screen, OrbScreen):
                    self.stage.screen.link_lost()
            case Delivered(message=message, t_ms=t_ms):
                self._go_on(now_s)
                self.lessons.take(message)
                self.lab.take(message, now_s)
                self._play(message, t_ms / 1000, now_s)
                self._report(message, now_s)

    def _wait(self, reason: str) -> None:
        """Pause a game that is played by hand."""
        screen = self.stage.screen
        if self._pause is None and isinstance(screen, PlayScreen) and screen.by_hand:
            screen.pause(self.words(reason), *self._orb_items(self.stage))
            if self.stage.screen is not screen:
                self._pause = self.stage.screen

    def _go_on(self, now_s: float) -> None:
        """End the pause that the link made, once it is seen; one that the player made stays."""
        if self._pause is not None and self._pause is self.stage.screen:
            self._pause.nav(MenuStep.BACK, now_s)
        self._pause = self._pause if self.stage.holds(self._pause) else None

    def _play(self, message: Message, t_s: float, now_s: float) -> None:
        """Let contacts, commands and gestures that are held act in the game or on the page."""
        if self.programs.on and self._behind:
            return
        screen = self.stage.screen
        deaf = isinstance(message, Command) and now_s < self._deaf_until_s
        if deaf or self.aiming.take(message, t_s, screen, now_s):
            return
        if isinstance(message, Command):
            self._taken = isinstance(screen, OrbScreen) and screen.recognised(message, now_s)
            if not self._taken and (action := ACTIONS.get(message.name)):
                self.game.act(action)
        elif isinstance(message, State):
            steered = self.aiming.game(screen) is not None
            self._gestures.hold(() if steered else message.pressed, now_s)
            taken = self._taken or steered
            page = taken and isinstance(screen, OrbScreen) and screen.long_leaves
            leaves = "drop" in message.pressed and (page or isinstance(screen, PlayScreen))
            self._long_s = now_s + _LONG_S if leaves else math.inf

    def _report(self, message: Message, now_s: float) -> None:
        """Let the page have a report."""
        if isinstance(message, UploadStatus):
            self._correcting.answer(message, now_s)
        screen = self.stage.screen
        if isinstance(screen, OrbScreen) and isinstance(message, Report):
            screen.report(message, now_s)

    # -- the window ----------------------------------------------------------------------

    def handle(self, event: pygame.event.Event, now_s: float) -> None:
        """Process an event of the window: a key, the mouse, a finger, the focus."""
        match event.type:
            case pygame.KEYDOWN if self._correcting.key(
                event.key, getattr(event, "mod", 0), self.orb.labels, now_s
            ):
                pass
            case pygame.KEYDOWN | pygame.KEYUP if event.key == _TWO_FINGERS:
                self.touch.hold_two(event.type == pygame.KEYDOWN)
            case pygame.KEYDOWN if event.key == pygame.K_F2:
                self._show_lab()
            case pygame.KEYDOWN if self.programs.hot_key(pygame.key.name(event.key)):
                pass
            case kind if kind in _MOUSE:
                self._mouse(event, now_s)
            case kind if kind in _FINGERS:
                self._touch(event, now_s)
            case _:
                if event.type == pygame.WINDOWLEAVE:
                    self.orb.pointer = None
                if event.type in (pygame.WINDOWFOCUSLOST, pygame.WINDOWFOCUSGAINED):
                    self._behind = event.type == pygame.WINDOWFOCUSLOST
                if event.type == pygame.WINDOWFOCUSLOST:
                    self.touch.lift_all()
                self._events.append(event)

    def _touch(self, event: pygame.event.Event, now_s: float) -> None:
        """Pass an event of the mouse or a touch screen to the dome."""
        self.screen_touched |= event.type in _FINGERS
        # SDL reports a finger as a mouse, too.
        if not self.virtual or getattr(event, "touch", False):
            return
        to_grid = self.panel.projection.to_grid
        match event.type:
            case pygame.MOUSEBUTTONDOWN if event.button in _BUTTONS:
                pinch = event.button == _RIGHT_BUTTON
                if self.touch.press(*to_grid(*event.pos), now_s, pinch=pinch):
                    self._button = event.button
                else:
                    self.touch.deepen(now_s)
            case pygame.MOUSEWHEEL:
                self.touch.deepen(now_s)
            case pygame.MOUSEMOTION:
                self.touch.move(*to_grid(*event.pos))
            case pygame.MOUSEBUTTONUP if event.button == self._button:
                self.touch.move(*to_grid(*event.pos))
                if end := self.touch.update(now_s):
                    self._ends.append(end)
                self.touch.release()
            case pygame.FINGERDOWN | pygame.FINGERMOTION:
                place = to_grid(event.x * self._size[0], event.y * self._size[1])
                down = event.type == pygame.FINGERDOWN
                self.touch.finger(event.finger_id, *place, down=down)
            case pygame.FINGERUP:
                self.touch.finger_up(event.finger_id)

    def _mouse(self, event: pygame.event.Event, now_s: float) -> None:
        """Pass an event of the mouse to the dome, or with its place there to the game."""
        self._touch(event, now_s)
        place = getattr(event, "pos", pygame.mouse.get_pos())
        point = self.panel.projection.to_grid(*place)
        self.orb.pointer = point if self.touch.pad.on_dome(*point) else None
        if self.dock.game.collidepoint(place) and event.type != pygame.MOUSEBUTTONUP:
            left, top = self.dock.game.topleft
            moved = {**event.dict, "pos": (place[0] - left, place[1] - top)}
            self._events.append(pygame.event.Event(event.type, moved))

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the game's screen and the orb as they were at the last tick."""
        self._place(surface)
        if self.closed:
            return
        self.game.draw(self._now_s)
        surface.fill(self.stage.look.palette.background, self.dock.side(self._size))
        look, settings = self.stage.look, self.stage.settings
        self.orb.note = self.note or self._correcting.told(self._now_s, look.words)
        self.orb.hint, self.orb.ghost = self._hint(), self.ghost
        self.orb.badge = "" if not self.programs.on else _ARMED[self.programs.armed]
        screen = self.stage.screen
        playing = screen if isinstance(screen, PlayScreen) else None
        game = playing.session.game if playing and playing.by_hand else None
        self.orb.columns = self.aiming.columns(screen)
        self.orb.board = _rows(game) if game and self.phone else ()
        self.orb.zones = self.zones or (playing is not None and self.orb.pointer is not None)
        scale = settings.scale / 100
        gestures = len(self.orb.labels[1:])
        self.panel.place(self.dock.panel, self.touch.pad, gestures=gestures, scale=scale)
        self.panel.draw(surface, self.orb, self._now_s, look)

    def _place(self, surface: pygame.Surface) -> None:
        """Lay out the window anew when its surface is another one."""
        if surface is self._surface and surface.get_size() == self._size:
            return
        self._surface, self._size = surface, surface.get_size()
        self.dock = Dock.of(self._size)
        self.game.place(surface.subsurface(self.dock.game))

    def _hint(self) -> str:
        words = self.stage.look.words
        if self.programs.on:
            return words(f"programs.{_ARMED[self.programs.armed]}")
        if self.virtual and self.touch.two_fingers:
            return words("orb.two_fingers")
        playing, last = isinstance(self.stage.screen, PlayScreen), self.orb.last
        if playing and (hint := self.aiming.hint(mouse=self.virtual)):
            return words(hint)
        return words("orb.first_touch") if self.virtual and not last else ""

    def close(self) -> None:
        """Let go of the devices."""
        self.programs.stop()
        self.game.close()


def _rows(game: Game) -> list[str]:
    """Return the visible rows of a game with its piece, top first; "." is empty."""
    marks = {(x, y): mark for y, row in enumerate(game.board.rows) for x, mark in enumerate(row)}
    if game.in_play:
        marks |= dict.fromkeys(game.piece.cells, game.piece.kind)
    across = range(game.config.columns)
    rows = reversed(range(game.config.rows))
    return ["".join(marks.get((x, y), EMPTY) for x in across) for y in rows]


def create(options: TargetOptions) -> OrbApp:
    """Make the application with the player's settings and records."""
    start = Start() if options.seed is None else Start(seed=options.seed)
    return OrbApp(
        start, config=config_folder(), data=data_folder(), sound=options.sound, demo=options.demo
    )
