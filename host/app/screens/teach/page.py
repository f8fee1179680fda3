"""Base of the pages of Teach, a page of choices, and one on which a name is chosen or typed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Final

import pygame

from controller.shared.protocol.messages import COMMANDS, Command, Report, Telemetry
from controller.shared.protocol.teaching import RecordingStatus, SetCommand
from host.app.lessons import failed
from host.app.screen import Orb, OrbScreen
from host.ui import naming
from host.ui.thumbnails import Base, thumbnail
from host.ui.touch_watch import TouchEvent, TouchWatch
from tetris.kit import theme
from tetris.kit.bindings import Code
from tetris.kit.menu import Item, Menu
from tetris.kit.stage import Stage

_FOOT: Final = 100  # design units of the sentence below a menu
_QUIET_S: Final = 0.6  # in which the gesture that opened a page takes no step on it
_LONGEST: Final = 40  # characters of a name
Do = Callable[[], None]


@dataclass
class Course:
    """What the pages of Teach share.

    Attributes:
        play: Begins a game.
        recording: State of the orb's recording; None before the first, and without a link.
    """

    stage: Stage
    orb: Orb
    play: Do
    watch: TouchWatch = field(default_factory=TouchWatch)
    recording: RecordingStatus | None = None


class TeachPage(OrbScreen):
    """A page of Teach."""

    centred = False  # its items stay where they are as others are added

    def __init__(self, course: Course) -> None:
        """Show the page of a course."""
        self.course, self.lessons = course, course.orb.lessons
        self._shown_s = course.stage.time_s
        super().__init__(course.stage, course.orb)

    def show(self, page: "TeachPage") -> None:
        """Show a page on top of this one."""
        self._stage.push(page)

    def ask(self, question: str, label: str, do: Do) -> None:
        """Ask whether to do something, with a gesture or none (""), once."""
        asked = self.words(question, name=naming.gesture(self.words, label))
        choices = [(self.words("teach.no"), self.rebuild), (self.words("teach.yes"), do)]
        self.show(ChoicePage(self.course, asked, choices))

    def leaving(self, do: Do) -> Do:
        """Return what leaves the page, and does something then."""

        def both() -> None:
            self.leave()
            do()

        return both

    def become(self, page: "TeachPage") -> None:
        """Show a page in place of this one."""
        self.leave()
        self._stage.push(page)

    def notice(self) -> str:
        """Return what is wrong; "": nothing."""
        if self.orb.state.link != "live":
            return self.words("teach.lost")
        if self.lessons.vocabulary is None:
            return self.words("teach.waiting")
        problem = self.lessons.objection or failed(self.lessons.status)
        return self._stage.told(problem)

    def recognised(self, command: Command, time_s: float) -> bool:
        """Return whether a gesture is no step: the one that opened the page is none."""
        return time_s < self._shown_s + _QUIET_S

    def report(self, message: Report, time_s: float) -> None:
        """Take a report."""
        if isinstance(message, RecordingStatus):
            self.course.recording = message
        if not isinstance(message, Telemetry):
            return
        if event := self.course.watch.step(self.orb.state.felt, time_s):
            self.touched(event, time_s)

    def touched(self, event: TouchEvent, time_s: float) -> None:
        """Take the beginning or the end of a touch."""

    def link_lost(self) -> None:
        """Give up what was under way over the link."""
        self.course.watch, self.course.recording = TouchWatch(), None

    # -- pictures ------------------------------------------------------------------------

    def px(self, units: float) -> int:
        """Return a length in pixels."""
        return round(units * self._stage.unit)

    def strip(self) -> pygame.Rect:
        """Return the room between the items and the sentence below them."""
        area = self._stage.area
        top = max((spot.place.bottom for spot in self.spots), default=area.top)
        bottom = area.bottom - self.px(_FOOT)
        return pygame.Rect(self.px(24), top, area.width - 2 * self.px(24), max(1, bottom - top))

    def thumbnail(self, image: bytes, radius: float) -> pygame.Surface:
        """Return the dome with an image; the radius is in design units."""
        palette = self._stage.look.palette
        base = Base(max(6, self.px(radius)), palette.raised, palette.line)
        return thumbnail(image, *self.orb.state.shape, base)

    def write(
        self,
        surface: pygame.Surface,
        words: str,
        size: int,
        place: tuple[int, int],
        widest: int,
        *,
        dim: bool,
    ) -> None:
        """Write words centred below a place, not wider than so many pixels."""
        palette = self._stage.look.palette
        colour = palette.dim if dim else palette.accent
        picture = theme.fitted(words, self.px(size), colour, widest)
        surface.blit(picture, picture.get_rect(midtop=place))


class ChoicePage(TeachPage):
    """A page of items to choose one from; choosing leaves it first."""

    def __init__(
        self, course: Course, title: str, choices: Sequence[tuple[str, Do]], hint: str = ""
    ) -> None:
        """Offer choices, each with its words and what it does."""
        self._title, self._choices, self._hint = title, choices, hint
        super().__init__(course)

    def page(self) -> Menu:
        """Return the choices."""
        items = [Item(text, self.leaving(do), hint=self._hint) for text, do in self._choices]
        asks = items[0].label == self.words("teach.no")  # that leads back
        items += [] if asks else [self.back_item()]
        return Menu(self._title, items, notice=self.notice())


def command_page(course: Course, title: str, label: str, user: str = "") -> ChoicePage:
    """Return the page that sets the command of a gesture, of one user or of all ("")."""
    words, lessons = course.stage.look.words, course.orb.lessons
    choices = [
        (naming.command(words, each), partial(lessons.change, SetCommand(label, each, user)))
        for each in (*COMMANDS, "")
    ]
    return ChoicePage(course, title, choices)


class NamePage(TeachPage):
    """A page on which a name is chosen from some, or typed: small letters and spaces."""

    def __init__(
        self, course: Course, title: str, names: Sequence[str], chosen: Callable[[str], None]
    ) -> None:
        """Offer names; `chosen` is called with one after the page was left."""
        self._title, self._names, self._chosen = title, names, chosen
        self._typed = ""
        super().__init__(course)

    def page(self) -> Menu:
        """Return the names."""
        words, take = self.words, self._taking(self._typed) if self._typed else None
        typed = self.item("teach.typed", take, f"{self._typed.replace('_', ' ')}|")
        proposed = [Item(naming.gesture(words, name), self._taking(name)) for name in self._names]
        items = [typed, *proposed] if self._typed else [*proposed, typed]
        return Menu(words(self._title), [*items, self.back_item()], notice=self.notice())

    def _taking(self, name: str) -> Do:
        return self.leaving(lambda: self._chosen(name))

    def press(self, code: Code, time_s: float) -> None:
        """Type a letter; other keys move through the page."""
        letter = chr(code).lower() if isinstance(code, int) and 32 <= code < 127 else ""
        letter = "_" if letter in ("-", " ") else letter
        if code == pygame.K_BACKSPACE and self._typed:
            self._typed = self._typed[:-1]
        elif letter.isalpha() or (self._typed and letter == "_"):
            self._typed = (self._typed + letter)[:_LONGEST]
            self.selected = 0
        else:
            super().press(code, time_s)
