"""The quick check of the skin: leave it alone, then press each quarter; what was found."""

from typing import Final

from controller.protocol.messages import Command, Contact, Report, Telemetry
from host.app.screen import Orb, OrbScreen, rows
from host.app.skin_check import QUARTERS, SkinCheck, named
from host.ui.naming import health
from tetris.window.menu import Item, Menu, Row
from tetris.window.screen_stack import ScreenStack

_AFTER_S: Final = 2.0  # the last press of the check does not steer the menu
_GHOST_MM: Final = (5.0, 6.0)  # depth and radius of the finger that shows where to press


class SkinScreen(OrbScreen):
    """Leads through a `SkinCheck`; a quarter to press is shown by a finger on the dome."""

    def __init__(self, stage: ScreenStack, orb: Orb) -> None:
        """Begin with the rest."""
        self._check = SkinCheck()
        self._busy_s = 0.0  # until when presses belong to the check
        super().__init__(stage, orb)

    def page(self) -> Menu:
        """Return what is to be done, or what was found."""
        words, check = self._stage.look.words, self._check
        over = check.stage == "over"
        table = self._found() if over else self._task()
        items = []
        if over:
            items.append(Item(words("skin.again"), self._again))
        items.append(Item(words("menu.back"), self.leave))
        limits = words("skin.limits")
        return Menu(words("skin.title"), items, table=table, notice=limits if over else "")

    def _task(self) -> list[Row]:
        words, check = self._stage.look.words, self._check
        done = Row((words("skin.done"), f"{check.progress:.0%}"))
        return [*rows(words(f"skin.{check.stage}"), marked=True), done]

    def _found(self) -> list[Row]:
        """Return the verdict, and what the orb itself has found."""
        words, verdict = self._stage.look.words, self._check.verdict
        found = [health(words, sentence) for sentence in self.orb.state.health]
        if verdict.touched:
            found.append(words("skin.touched"))
        if verdict.noisy:
            found.append(words("skin.noisy", places=named(verdict.noisy)))
        if verdict.still:
            found.append(words("skin.still", places=named(verdict.still)))
        return [row for said in found or [words("skin.sound")] for row in rows(said)]

    def _again(self) -> None:
        self._check = SkinCheck()
        self.rebuild()

    def recognised(self, command: Command, time_s: float) -> bool:
        """Keep presses of the check out of the menu."""
        return time_s < self._busy_s

    def report(self, message: Report, time_s: float) -> None:
        """Pass images to the check."""
        if self._check.stage != "over":
            self._busy_s = time_s + _AFTER_S
        if isinstance(message, Telemetry) and message.ready:
            self._check.step(self.orb.state.felt, time_s)
            self.orb.ghost = self._ghost()

    def _ghost(self) -> tuple[Contact, ...]:
        """Return a finger in the middle of the quarter to press."""
        if self._check.stage not in QUARTERS:
            return ()
        high, wide = self.orb.state.shape
        right = self._check.stage.endswith("right")
        top = self._check.stage.startswith("top")
        x = (wide - 1) * (0.75 if right else 0.25)
        y = (high - 1) * (0.75 if top else 0.25)
        return (Contact(1, x, y, *_GHOST_MM),)
