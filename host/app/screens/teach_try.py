"""Page on which a gesture just learned is tried, with what the others have lost by it."""

from collections.abc import Callable
from typing import Final

from controller.protocol.messages import Command, Report, Telemetry
from controller.protocol.teaching import LearnStatus, SaveAs, Undo
from host.app.gesture_state import TouchEvent, Trial
from host.app.screens.teach_page import Course, NamePage, TeachPage, gesture_name
from tetris.window.language import Words
from tetris.window.menu import Item, Menu, Row

_KEPT_FILES: Final = ("mine", "game", "music")  # proposed names of saved vocabularies


class TryPage(TeachPage):
    """Counts how often a gesture is understood."""

    def __init__(self, course: Course, label: str, more: Callable[[], None]) -> None:
        """Try a gesture; `more` shows the page on which further examples are taken."""
        self.trial, self._more = Trial(label), more
        self._learned = course.gestures.status
        super().__init__(course)

    def page(self) -> Menu:
        """Return the count so far, and what can be done next."""
        words, trial = self.words, self.trial
        items = [
            Item(words("teach.play"), self.course.play, hint=words("teach.play_hint")),
            Item(words("teach.more"), self._again, hint=words("teach.more_hint")),
            Item(words("teach.undo"), self._undo, hint=words("teach.undo_hint")),
            Item(words("teach.save_as"), lambda: save_as(self.course)),
            Item(words("teach.menu"), self.leave),
        ]
        name = gesture_name(words, trial.label)
        title = words("teach.tried" if trial.over else "teach.try", name=name, count=trial.wanted)
        waits = self._learned.text if self._learned else ""
        return Menu(title, items, self._rows(), notice=self.notice() or waits)

    def _rows(self) -> list[Row]:
        words, trial = self.words, self.trial
        understood = words("teach.understood", count=trial.understood, tries=trial.tries)
        rows = [Row((understood,), marked=True)]
        if trial.confused:
            taken = ", ".join(
                f"{gesture_name(words, label or 'null')} ×{count}"
                for label, count in trial.confused.most_common()
            )
            rows.append(Row((words("teach.taken_for", names=taken),)))
        labels = self.gestures.vocabulary.labels if self.gestures.vocabulary else ()
        if kept := kept_words(words, self._learned, labels, trial.label):
            rows.append(Row((kept,)))
        return rows

    def _again(self) -> None:
        self.leave()
        self._more()

    def _undo(self) -> None:
        self.leave()
        self.gestures.ask(Undo())

    def recognised(self, command: Command, time_s: float) -> bool:
        """Count a gesture; it is a step only when the trial is over."""
        self.trial.recognised(command.label)
        return not self.trial.over or super().recognised(command, time_s)

    def report(self, message: Report, time_s: float) -> None:
        """Count a gesture that has no command, too."""
        if isinstance(message, Telemetry):
            self.trial.recognised(message.gesture)
        super().report(message, time_s)

    def touched(self, event: TouchEvent, time_s: float) -> None:
        """Count a touch that is over."""
        self.trial.touched(event)
        if self.trial.over:
            self._shown_s = time_s  # the last try is no step


def save_as(course: Course) -> None:
    """Show the page that asks for the name of a copy."""
    ask = course.gestures.ask
    page = NamePage(course, "teach.save_as", _KEPT_FILES, lambda name: ask(SaveAs(name)))
    course.stage.push(page)


def kept_words(
    words: Words, status: LearnStatus | None, labels: tuple[str, ...], label: str
) -> str:
    """Return what older gestures have kept, in words; "" if that is unknown."""
    if status is None or len(status.kept) != len(labels):
        return ""
    older = {
        each: share
        for each, share in zip(labels, status.kept, strict=True)
        if each not in ("null", label)
    }
    if not older:
        return ""
    mean = sum(older.values()) / len(older)
    worst = min(older, key=lambda each: older[each])
    return words(
        "teach.kept",
        percent=f"{100 * mean:.0f}",
        name=gesture_name(words, worst),
        least=f"{100 * older[worst]:.0f}",
    )
