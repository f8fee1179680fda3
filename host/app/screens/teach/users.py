"""Pages of the users that a bundle knows, with the commands of each."""

from functools import partial

from controller.shared.protocol.teaching import SetCommand
from host.app.screens.teach.page import Course, TeachPage, command_name, command_page
from host.ui import naming
from tetris.kit.menu import Item, Menu


class UsersPage(TeachPage):
    """Lists the users."""

    def page(self) -> Menu:
        """Return the users, each with what is their own."""
        words = self.words
        items = [
            Item(
                name,
                partial(self._open, name),
                words("teach.own" if info.labels else "teach.as_all"),
            )
            for name, info in self.lessons.users.items()
        ]
        title = words("teach.users").rstrip("…")
        return Menu(title, [*items, self.back_item()], notice=self.notice())

    def _open(self, name: str) -> None:
        self.show(UserPage(self.course, name))


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
                value=" / ".join(command_name(words, each) for each in commands),
                hint=words("teach.own_hint" if label in own else "teach.as_all_hint"),
            )
            for label, commands in {**self._common(), **own}.items()
        ]
        back = partial(self.lessons.change, SetCommand("", "", self.user))
        items.append(self.item("teach.like_all", back if own else None))
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
