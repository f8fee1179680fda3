"""The doctor's checks in the window: what to do now, the progress, and the verdict."""

from dataclasses import replace
from typing import Final

from controller.shared.protocol.messages import Command, Contact, Report
from controller.shared.protocol.teaching import FAILED, Check, CheckRow, CheckStep, LearnStatus
from host.app.screen import Orb, OrbScreen, rows
from host.ui.naming import check_name, said
from tetris.kit.menu import Item, Menu, Row
from tetris.kit.stage import Stage

_VERDICTS: Final = ("FAULT", "doubtful", "not checked", "good")  # worst first
_AFTER_S: Final = 2.0  # the last press of the check does not steer the menu
_GHOST_MM: Final = (8.0, 7.0)  # depth and radius of the finger that shows where to press


class CheckScreen(OrbScreen):
    """Leads through a calibration and the checks, which run in the orb."""

    def __init__(self, stage: Stage, orb: Orb) -> None:
        self.orb = orb
        self._begin()
        super().__init__(stage, orb)

    def _again(self) -> None:
        self._begin()
        self.rebuild()

    def _begin(self) -> None:
        self._step = CheckStep("waiting", 0, 0, 0.0)
        self._found: list[CheckRow] = []
        self._problem = ""
        self._busy_s = 0.0  # until when presses belong to the check
        self.orb.send(Check(True))

    def page(self) -> Menu:
        """Return what is to be done, or a line for each check, the worst first."""
        words, step = self.words, self._step
        if step.step != "over":
            done = Row((words("check.done"), f"{step.progress:.0%}"))
            task = rows(words(f"check.{step.step}", row=step.row, column=step.column), marked=True)
            return Menu(words("check.title"), [self.back_item()], table=[*task, done])
        items = [self._line(row) for row in self._found]
        items += [self.item("check.again", self._again), self.back_item()]
        return Menu(words("check.title"), items, notice=self._problem)

    def _line(self, row: CheckRow) -> Item:
        words = self.words
        hint = f"{said(words, row.found)}. {said(words, row.advice)}".strip()
        key = row.verdict.lower().replace(" ", "_")
        name = check_name(words, row.name)
        return Item(name, lambda: None, words(f"check.{key}"), hint=hint)

    def recognised(self, command: Command, time_s: float) -> bool:
        """Keep presses of the check out of the menu."""
        return self._step.step != "over" or time_s < self._busy_s

    def report(self, message: Report, time_s: float) -> None:
        """Take a step or a row of the check, or its refusal."""
        match message:
            case CheckRow():
                self._found.append(message)
                self._found.sort(key=lambda row: _VERDICTS.index(row.verdict))
            case CheckStep():
                self._step, self._busy_s = message, time_s + _AFTER_S
                self.orb.ghost = self._ghost()
                self.rebuild()
            case LearnStatus(state=state, text=text) if state == FAILED:
                self._problem = said(self.words, text)
                self._step = replace(self._step, step="over")
                self.rebuild()

    def _ghost(self) -> tuple[Contact, ...]:
        if self._step.step != "press":
            return ()
        y = self.orb.state.shape[0] - 1.0 - self._step.row
        return (Contact(1, float(self._step.column), y, *_GHOST_MM),)

    def leave(self) -> None:
        """End the check."""
        if self._step.step != "over":
            self.orb.send(Check(False))
        super().leave()
