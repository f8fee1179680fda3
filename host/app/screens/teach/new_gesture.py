"""Pages of a new gesture: its details before it is learned, and its trial afterwards.

Details are its command, and which turns are the same gesture. The trial also shows what the other
gestures have lost by it.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Final

import pygame

from controller.shared.protocol.messages import COMMANDS, Command, Report
from controller.shared.protocol.teaching import GestureInfo, Learn, SaveAs, Undo
from host.app.lessons import Trial
from host.app.screens.teach.page import Course, NamePage, TeachPage, command_name, gesture_name
from host.ui import naming
from host.ui.thumbnails import ROTATIONS, Base, arrows, hooks
from host.ui.touch_watch import PAUSE_S, TouchEvent
from tetris.kit.menu import Menu, Row

NAMES: Final = ("swipe", "double_tap", "squeeze", "circle", "knock")  # proposed
_COMMANDS: Final = (*COMMANDS, "")
_RADIUS: Final = 52  # of a picture, design units
_WANTED: Final = 5  # tries
_KEPT_FILES: Final = ("mine", "game", "music")  # proposed names of saved vocabularies


def plan_of(gesture: GestureInfo) -> Learn:
    """Return the plan to teach a gesture anew with its command."""
    return _plan(gesture.label, gesture.rules[0].command if gesture.rules else "")


def new_plan(label: str, gestures: Iterable[GestureInfo]) -> Learn:
    """Return the plan of a new gesture, for a command that none of the others has."""
    reachable = {rule.command for one in gestures for rule in one.rules}
    free = [name for name in ("hold", *COMMANDS) if name not in reachable]
    return _plan(label, free[0] if free else "hold")


def _plan(label: str, command: str) -> Learn:
    return Learn(label, command, "none", False, "")


class DetailsPage(TeachPage):
    """Asks for a gesture's command, and shows in pictures which turns are the same gesture."""

    def __init__(
        self,
        course: Course,
        plan: Learn,
        learn: Callable[[Learn], TeachPage],
        more: Callable[[Learn], TeachPage],
    ) -> None:
        """Ask about a plan; `learn` and `more` return the pages of learning and of examples."""
        self.plan, self._learn, self._more = plan, learn, more
        self._pictures: list[tuple[pygame.Rect, str]] = []  # of rotations; "": of the mirror image
        super().__init__(course)

    def page(self) -> Menu:
        """Return the questions."""
        words, plan = self.words, self.plan
        learn = lambda: self.become(self._learn(self.plan))  # noqa: E731
        command, turned = command_name(words, plan.command), words(f"teach.turned_{plan.rotations}")
        mirrored = words("teach.same" if plan.mirrored else "teach.other")
        hint = words("teach.turned_hint")
        items = [
            self.item("teach.learn", learn, hint=words("teach.guessed")),
            self.item("teach.command", value=command, step=self._turn_command),
            self.item("teach.turned", value=turned, step=self._turn_rotations),
            self.item("teach.mirror", value=mirrored, step=lambda _: self._mirror(), hint=hint),
            self.item("teach.go_on", lambda: self.become(self._more(self.plan))),
            self.back_item(),
        ]
        return Menu(naming.gesture(words, plan.label), items, notice=self.notice())

    def _turn_command(self, step: int) -> None:
        place = _COMMANDS.index(self.plan.command) if self.plan.command in _COMMANDS else 0
        self.plan = replace(self.plan, command=_COMMANDS[(place + step) % len(_COMMANDS)])

    def _turn_rotations(self, step: int) -> None:
        names = list(ROTATIONS)
        place = names.index(self.plan.rotations) + step
        self.plan = replace(self.plan, rotations=names[place % len(names)])

    def _mirror(self) -> None:
        self.plan = replace(self.plan, mirrored=not self.plan.mirrored)

    def mouse(self, event: pygame.event.Event, time_s: float) -> None:
        """Choose a picture by a click."""
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            for place, name in self._pictures:
                if place.collidepoint(event.pos):
                    if name:
                        self.plan = replace(self.plan, rotations=name)
                    else:
                        self._mirror()
                    self.rebuild()
                    return
        super().mouse(event, time_s)

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the questions, and a picture of each answer."""
        super().draw(surface, time_s)
        strip, palette = self.strip(), self._stage.look.palette
        radius = min(self.px(_RADIUS), strip.height // 3)
        base = Base(radius, palette.raised, palette.line)
        self._pictures = []
        wide = strip.width // (len(ROTATIONS) + 1)
        for number, name in enumerate((*ROTATIONS, "")):
            x = strip.left + round(wide * (number + 0.5))
            chosen = name == self.plan.rotations or (not name and self.plan.mirrored)
            colour = palette.accent if chosen else palette.dim
            white = palette.flash if chosen else palette.line
            picture = (
                arrows(ROTATIONS[name], base, white)
                if name
                else hooks(self.plan.mirrored, base, white)
            )
            place = picture.get_rect(midtop=(x, strip.top + self.px(8)))
            surface.blit(picture, place)
            if chosen:
                pygame.draw.circle(
                    surface, colour, place.center, place.width // 2, max(1, self.px(3))
                )
            words = self.words(f"teach.turned_{name}" if name else "teach.mirrored")
            self.write(surface, words, 20, place.midbottom, wide - self.px(8), dim=not chosen)
            self._pictures.append((place, name))


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
