"""Page on which a gesture just learned is tried, with what the others have lost by it."""

from collections.abc import Callable
from functools import partial
from typing import Final

from controller.shared.protocol.messages import Command, Report
from controller.shared.protocol.teaching import SaveAs, Undo
from host.app.lessons import Trial
from host.app.screens.teach.page import Course, NamePage, TeachPage, gesture_name
from host.ui import naming
from host.ui.touch_watch import PAUSE_S, TouchEvent
from tetris.kit.menu import Menu, Row

_WANTED: Final = 5  # tries
_KEPT_FILES: Final = ("mine", "game", "music")  # proposed names of saved vocabularies


class TryPage(TeachPage):
    """Counts how often a gesture is understood."""

    def __init__(self, course: Course, label: str, more: Callable[[], None]) -> None:
        """Try a gesture; `more` shows the page on which further examples are taken."""
        self.trial, self._more = Trial(label), more
        self._kept = course.orb.lessons.kept
        super().__init__(course)

    @property
    def over(self) -> bool:
        """Whether it was tried often enough."""
        return len(self.trial.heard) >= _WANTED

    def page(self) -> Menu:
        """Return the count so far, and what can be done next."""
        words, trial = self.words, self.trial
        items = [
            self.item("teach.play", self.course.play),
            self.item("teach.more", self.leaving(self._more)),
            self.item("teach.undo", self.leaving(partial(self.lessons.change, Undo()))),
            self.item("teach.save_as", lambda: save_as(self.course)),
            self.item("teach.menu", self.leave),
        ]
        name = naming.gesture(words, trial.label)
        title = words("teach.tried" if self.over else "teach.try", name=name, count=_WANTED)
        status = self.lessons.status
        said = naming.said(words, status.text) if status else ""
        return Menu(title, items, self._rows(), notice=self.notice() or said)

    def _rows(self) -> list[Row]:
        words, trial = self.words, self.trial
        taken = ", ".join(
            f"{gesture_name(words, label)} ×{count}" for label, count in trial.confused
        )
        count = words("teach.of", count=trial.understood, tries=len(trial.heard))
        return [
            Row((words("teach.understood"), count), marked=True),
            Row((words("teach.taken_for"), taken or "–")),
            *self._kept_rows(),
        ]

    def _kept_rows(self) -> list[Row]:
        """Return what the other gestures have kept, and the least of them; [] if unknown."""
        words = self.words
        older = {each: share for each, share in self._kept.items() if each != self.trial.label}
        if not older:
            return []
        worst = min(older, key=lambda each: older[each])
        mean = sum(older.values()) / len(older)
        least = words("teach.least", name=naming.gesture(words, worst))
        return [
            Row((words("teach.kept"), f"{100 * mean:.0f} %")),
            Row((least, f"{100 * older[worst]:.0f} %")),
        ]

    def recognised(self, command: Command, time_s: float) -> bool:
        """Return True during the trial: its gestures are no steps."""
        return not self.over or super().recognised(command, time_s)

    def report(self, message: Report, time_s: float) -> None:
        """Take a report, and count the touch that it ends."""
        super().report(message, time_s)
        if not self.over:
            self.trial.take(message, time_s)
            self._shown_s = time_s  # the last try is no step

    def touched(self, event: TouchEvent, time_s: float) -> None:
        """Take the beginning or the end of a try."""
        if not self.over:
            self.trial.touch(event == "begun", time_s - PAUSE_S * (event == "ended"))


def save_as(course: Course) -> None:
    """Show the page that asks for the name of a copy."""
    save = lambda name: course.orb.lessons.change(SaveAs(name))  # noqa: E731
    course.stage.push(NamePage(course, "teach.save_as", _KEPT_FILES, save))
