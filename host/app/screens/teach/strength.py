"""Page on which the touch strength of a user is found from presses."""

from collections import deque
from functools import partial
from typing import Final

import numpy as np

from controller.shared import touch_strength
from controller.shared.protocol.codec import image_from_bytes
from controller.shared.protocol.messages import Command, Report, Telemetry
from controller.shared.protocol.teaching import SetStrength
from controller.shared.touch_strength import PRESSES
from host.app.screen import Orb, rows
from host.app.screens.teach.page import Course, TeachPage
from host.ui import naming
from tetris.kit.language import Words
from tetris.kit.menu import Item, Menu, Row

_GESTURE: Final = "press"
_WITHIN_S: Final = 40.0  # in which the presses are made
_SETTLE_S: Final = 1.0  # before them, in which the touch that opened the page ends


def named(words: Words, strength: float) -> str:
    """Return a touch strength in words, with its number."""
    key = "light" if strength < 1.0 else "usual" if strength == 1.0 else "strong"
    return f"{words(f'strength.{key}')}, {words.number(strength, '.2f')}"


def usual_deviation(orb: Orb) -> float:
    """Return the mean |z - 1| of a press of the orb's training; 0: unknown."""
    press = orb.state.gestures.get(_GESTURE)
    if press is None or not press.image:
        return 0.0
    return abs(float(np.mean(image_from_bytes(press.image))) - 1.0)


def strength_item(page: TeachPage, user: str = "") -> Item:
    """Return the item that opens the page of a user, or of all ("")."""
    known = page.lessons.strengths and usual_deviation(page.orb) > 0.0
    show = (lambda: page.show(StrengthPage(page.course, user))) if known else None
    value = named(page.words, page.lessons.strength(user)) if known else ""
    return page.item("strength.title", show, value)


class StrengthPage(TeachPage):
    """Counts presses, and sets the strength that they show."""

    def __init__(self, course: Course, user: str) -> None:
        """Find the strength of a user; "": of all who have none of their own."""
        self.user = user
        self._means: deque[float] = deque()  # of z - 1, frame by frame
        self._count, self._found = 0, False
        super().__init__(course)

    def page(self) -> Menu:
        """Return the strength, the number of presses so far, and what can be done."""
        words, user, lessons = self.words, self.user, self.lessons
        usual = None if user else 1.0
        own = lessons.strengths.get(user, usual) != usual
        forget = partial(lessons.change, SetStrength(0.0, user)) if own else None
        items = [self.item("strength.again", self._begin)] if self._found else []
        items.append(self.item("strength.as_all" if user else "strength.as_trained", forget))
        made = words("teach.of", count=self._count, tries=PRESSES)
        table = [
            *rows(words("strength.ask", count=PRESSES), marked=not self._found),
            Row((words("strength.presses"), made)),
            Row((words("strength.now"), named(words, lessons.strength(user)))),
        ]
        title = words("strength.title")
        said = naming.said(words, lessons.status.text) if lessons.status else ""
        return Menu(
            f"{user}: {title}" if user else title,
            [*items, self.back_item()],
            table,
            notice=self.notice() or said,
        )

    def _begin(self) -> None:
        self._means.clear()
        self._count, self._found, self._shown_s = 0, False, self._stage.time_s

    def recognised(self, command: Command, time_s: float) -> bool:
        """Return True for presses while they are counted: they are no steps."""
        counted = command.label == _GESTURE and not self._found
        return counted or super().recognised(command, time_s)

    def report(self, message: Report, time_s: float) -> None:
        """Take a report; set the strength after enough presses."""
        super().report(message, time_s)
        state, usual = self.orb.state, usual_deviation(self.orb)
        ready = state.ready and usual and time_s >= self._shown_s + _SETTLE_S
        if self._found or not ready or not isinstance(message, Telemetry):
            return
        self._means.append(float(state.felt.mean()))
        while len(self._means) > _WITHIN_S * state.rate_hz:
            self._means.popleft()
        presses = touch_strength.press_deviations(self._means, state.rate_hz)
        self._count = min(len(presses), PRESSES)
        if self._count == PRESSES and not self.lessons.busy:
            self._found, self._shown_s = True, time_s  # the last press is no step
            strength = touch_strength.of_presses(presses, usual)
            if strength != self.lessons.strengths.get(self.user):
                self.lessons.change(SetStrength(strength, self.user))
