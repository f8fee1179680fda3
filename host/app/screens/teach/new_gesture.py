"""Details of a gesture before it is learned: its command, and which turns are the same."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Final

import pygame

from controller.shared.protocol.messages import COMMANDS
from controller.shared.protocol.teaching import GestureInfo, Learn
from host.app.screens.teach.page import Course, TeachPage, command_name
from host.ui import naming
from host.ui.thumbnails import ROTATIONS, Base, arrows, hooks
from tetris.kit.menu import Menu

NAMES: Final = ("swipe", "double_tap", "squeeze", "circle", "knock")  # proposed
_COMMANDS: Final = (*COMMANDS, "")
_RADIUS: Final = 52  # of a picture, design units


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
