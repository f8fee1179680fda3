"""First page of Teach: the gestures in use, and what can be done with them."""

from functools import partial
from typing import Final

import pygame

from controller.shared.protocol.messages import COMMANDS, Correction, Report, UploadStatus
from controller.shared.protocol.teaching import (
    DeleteExamples,
    Forget,
    GestureInfo,
    Learn,
    LearnStatus,
    SetCommand,
    Undo,
)
from host.app.screens.teach.gesture import GesturePage, save_as
from host.app.screens.teach.page import (
    ChoicePage,
    Course,
    Do,
    NamePage,
    TeachPage,
    command_page,
)
from host.app.screens.teach.strength import strength_item
from host.app.screens.teach.train import TrainPage
from host.ui import naming
from tetris.kit.menu import Item, Menu

_ICON: Final = 19  # radius, design units
_WIDE: Final = 560  # of the list, as other pages
_BY_POINTER: Final = ("swipe", "double_tap", "circle")  # proposed names of gestures
_BY_HAND: Final = ("squeeze", "knock")  # those that take more than one finger
_NULL: Final = "null"
_FIRST: Final = 1  # number of the first gesture's item


class TeachScreen(TeachPage):
    """Lists the gestures."""

    def __init__(self, course: Course) -> None:
        """List the gestures of a course's orb."""
        self._said = ""
        self._listed: list[GestureInfo] = []
        super().__init__(course)

    def page(self) -> Menu:
        """Return the gestures in use, with their commands."""
        words = self.words
        self._listed = list(self.orb.state.gestures.values())
        users = (lambda: self.show(UsersPage(self.course))) if self.lessons.users else None
        hint = words("teach.users_hint" if users else "teach.no_users")
        train = lambda: self.show(TrainPage(self.course))  # noqa: E731
        items = [
            self.item("teach.new", self._new),
            *(self._item(one) for one in self._listed),
            self.item("teach.users", users, hint=hint),
            strength_item(self),
            self.item("train.item", train, hint=words("train.hint")),
            self.item("teach.that_was", self._correct),
            self.item("teach.files", self._files),
            self.back_item(),
        ]
        return Menu(words("teach.title"), items, notice=self.notice() or self._said)

    def _item(self, one: GestureInfo) -> Item:
        words = self.words
        commands = dict.fromkeys(rule.command for rule in one.rules) or ("",)
        value = " / ".join(naming.command(words, command) for command in commands)
        hint = words("teach.taught_hint", count=one.examples) if one.taught else one.say
        change = partial(self._change, one) if one.taught else None
        return Item(naming.gesture(words, one.label), change, value, hint=hint)

    def report(self, message: Report, time_s: float) -> None:
        """Take a report; the answer to a request stands below the list."""
        super().report(message, time_s)
        if isinstance(message, UploadStatus | LearnStatus):
            self._said = self._stage.told(message.text)

    # -- pages that it leads to ----------------------------------------------------------

    def _new(self) -> None:
        hands = not self.orb.virtual or self.orb.by_fingers
        proposed = (*_BY_POINTER, *_BY_HAND) if hands else _BY_POINTER
        names = [name for name in proposed if name not in self.orb.state.gestures]
        self.show(NamePage(self.course, "teach.name", names, self._named))

    def _named(self, label: str) -> None:
        known = self.orb.state.gestures.get(label)
        if known and not known.taught:
            self._said = self.words("teach.known", name=naming.gesture(self.words, label))
            return
        if known:
            self.ask("teach.replace", label, lambda: self._relearn(known))
        else:
            self._teach(label, self._free_command())

    def _free_command(self) -> str:
        """Return a command that no gesture has."""
        gestures = self.orb.state.gestures.values()
        reachable = {rule.command for one in gestures for rule in one.rules}
        return next((name for name in ("hold", *COMMANDS) if name not in reachable), "hold")

    def _relearn(self, one: GestureInfo) -> None:
        self._teach(one.label, one.rules[0].command if one.rules else "")

    def _teach(self, label: str, command: str) -> None:
        self.show(GesturePage(self.course, Learn(label, command, "none", False, "")))

    def _change(self, one: GestureInfo) -> None:
        words, forget = self.words, partial(self.lessons.change, Forget(one.label))
        title = words("teach.change_command")
        choices: list[tuple[str, Do]] = [
            (words("teach.relearn"), partial(self._relearn, one)),
            (title, lambda: self.show(command_page(self.course, title, one.label))),
            (words("teach.remove"), partial(self.ask, "teach.sure_remove", one.label, forget)),
        ]
        self.show(ChoicePage(self.course, naming.gesture(words, one.label), choices))

    def _correct(self) -> None:
        words, labels, last = self.words, (*self.orb.state.gestures, _NULL), self.orb.state.last
        hint = words("teach.taken_for", name=naming.gesture(words, last.label if last else ""))
        choices = [
            (naming.gesture(words, label), partial(self.orb.send, Correction(label)))
            for label in labels
        ]
        choices.append((words("teach.undo_correction"), partial(self.orb.send, Correction(""))))
        self.show(ChoicePage(self.course, words("teach.that_was"), choices, hint))

    def _files(self) -> None:
        words, vocabulary = self.words, self.lessons.vocabulary
        delete = partial(self.lessons.change, DeleteExamples())
        choices: list[tuple[str, Do]] = [
            (words("teach.undo"), partial(self.lessons.change, Undo())),
            (words("teach.save_as"), partial(save_as, self.course)),
            (words("teach.delete"), partial(self.ask, "teach.sure_delete", "", delete)),
        ]
        hint = words("teach.folder") if vocabulary and vocabulary.folder else ""
        self.show(ChoicePage(self.course, words("teach.files"), choices, hint))

    # -- the picture ---------------------------------------------------------------------

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the list, with a picture of each gesture; those that were taught have a ring."""
        stage, area = self._stage, self._stage.area
        surface.fill(stage.look.palette.background)
        edge, wide = self.px(2 * _ICON + 2), self.px(_WIDE)  # pictures stand before the items
        left = max(edge, (area.width - wide) // 2)
        column = pygame.Rect(left, self.px(28), min(wide, area.width - left), 0)
        column.height = area.height - column.top - self.px(16)
        self._view.draw(surface, column, self.menu, self.selected, stage.unit)
        for spot in self.spots:
            place, place_in_list = spot.place, spot.number - _FIRST
            if not 0 <= place_in_list < len(self._listed):
                continue
            one = self._listed[place_in_list]
            picture = self.thumbnail(one.image, _ICON)
            at = picture.get_rect(midright=(place.left - self.px(4), place.centery))
            surface.blit(picture, at)
            if one.taught:
                accent = self._stage.look.palette.accent
                pygame.draw.circle(surface, accent, at.center, at.width // 2, max(1, self.px(3)))


class UsersPage(TeachPage):
    """Lists the users."""

    def page(self) -> Menu:
        """Return the users, each with what is their own."""
        words = self.words
        items = []
        for name, info in self.lessons.users.items():
            show = partial(lambda name: self.show(UserPage(self.course, name)), name)
            items.append(Item(name, show, words("teach.own" if info.labels else "teach.as_all")))
        title = words("teach.users").rstrip("…")
        return Menu(title, [*items, self.back_item()], notice=self.notice())


class UserPage(TeachPage):
    """Shows the mapping of one user, and changes it."""

    def __init__(self, course: Course, user: str) -> None:
        """Show the mapping of a user."""
        self.user = user
        super().__init__(course)

    def page(self) -> Menu:
        """Return the gestures with the commands that they have for the user."""
        words, own = self.words, self._own()
        items = [
            Item(
                naming.gesture(words, label),
                partial(self._set, label),
                value=" / ".join(naming.command(words, each) for each in commands),
                hint=words("teach.own_hint" if label in own else "teach.as_all_hint"),
            )
            for label, commands in {**self._common(), **own}.items()
        ]
        back = partial(self.lessons.change, SetCommand("", "", self.user))
        items += [
            self.item("teach.like_all", back if own else None),
            strength_item(self, self.user),
        ]
        return Menu(self.user, [*items, self.back_item()], notice=self.notice())

    def _common(self) -> dict[str, list[str]]:
        """Return the commands of all users, by gesture."""
        return {
            label: list(dict.fromkeys(rule.command for rule in one.rules)) or [""]
            for label, one in self.orb.state.gestures.items()
        }

    def _own(self) -> dict[str, list[str]]:
        """Return the user's own commands, by gesture."""
        found: dict[str, list[str]] = {}
        if info := self.lessons.users.get(self.user):
            for label, command in zip(info.labels, info.commands, strict=False):
                found.setdefault(label, []).append("" if command == "none" else command)
        return found

    def _set(self, label: str) -> None:
        title = f"{self.user}: {naming.gesture(self.words, label)}"
        self.show(command_page(self.course, title, label, self.user))
