"""Pages of the users that the orb knows, each with commands of their own."""

from functools import partial

from host.app.screens.teach_page import (
    ChoicePage,
    Course,
    TeachPage,
    command_choices,
    commands_of,
)
from host.ui import naming
from tetris.window.menu import Item, Menu


class UsersPage(TeachPage):
    """Lists the users."""

    def page(self) -> Menu:
        """Return the users; the one who touches the orb is marked."""
        words, state = self.words, self.orb.state
        items = []
        for user, own in state.users.items():
            value = words("users.own", count=len(own)) if own else words("users.common")
            if user == state.user:
                value = f"{words('users.here')}, {value}"
            items.append(Item(user, partial(self._choose, user), value=value))
        return Menu(words("users.title"), [*items, self.back_item()], notice=self.notice())

    def _choose(self, user: str) -> None:
        self.show(UserPage(self.course, user))


class UserPage(TeachPage):
    """Lists the gestures with a user's commands, and changes them."""

    def __init__(self, course: Course, user: str) -> None:
        """Show the commands of a user."""
        self.user = user
        super().__init__(course)

    def page(self) -> Menu:
        """Return the gestures with their commands."""
        words, own = self.words, self.orb.state.users.get(self.user, {})
        items = []
        for label, info in self.orb.state.gestures.items():
            value = commands_of(words, info.rules)
            hint = words("users.common_hint", name=self.user)
            if label in own:
                hint = words("users.own_hint", name=self.user, command=value)
                value = commands_of(words, own[label])
            choose = partial(self._choose, label, own=label in own)
            items.append(Item(naming.gesture(words, label), choose, value=value, hint=hint))
        if own:
            reset = partial(self.lessons.reset_command, "", self.user)
            hint = words("users.reset_hint", name=self.user)
            items.append(Item(words("users.reset"), reset, hint=hint))
        return Menu(self.user, [*items, self.back_item()], notice=self.notice())

    def notice(self) -> str:
        """Return what is wrong, or that a change is under way."""
        return super().notice() or (self.words("teach.moment") if self.lessons.busy else "")

    def _choose(self, label: str, *, own: bool) -> None:
        words, lessons = self.words, self.lessons
        choices = command_choices(words, lambda name: lessons.set_command(label, name, self.user))
        if own:
            again = partial(lessons.reset_command, label, self.user)
            choices = [(words("users.as_all"), again), *choices]
        title = f"{self.user}: {naming.gesture(words, label)}"
        self.show(ChoicePage(self.course, title, choices))
