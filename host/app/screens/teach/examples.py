"""Pages on which examples of a gesture are taken, and learned."""

from dataclasses import replace
from functools import partial
from typing import Final

import pygame

from controller.shared.protocol.messages import Command, Report
from controller.shared.protocol.teaching import DONE, FAILED, ExampleTaken, Learn
from host.app.screens.teach.new_gesture import DetailsPage, TryPage
from host.app.screens.teach.page import Course, TeachPage
from host.ui import naming
from host.ui.touch_watch import TouchEvent
from tetris.kit.menu import Menu, MenuStep

LEAST: Final = 3  # examples from which a gesture can be learned
_ENOUGH: Final = 5  # examples after which the next page comes by itself, after
_MOMENT_S: Final = 3.0
_ANSWER_S: Final = 3.0  # in which the orb answers an example
_IDLE_S: Final = 30.0  # without a touch, after which the orb steers the menu again
_RADIUS: Final = 34  # of a thumbnail, design units
_FORGOTTEN_S: Final = 3.0  # without a word of the learning
_SHOWN: Final = 8  # thumbnails, the newest


class ExamplesPage(TeachPage):
    """Takes each touch of the dome as an example, and shows the examples so far."""

    def __init__(self, course: Course, plan: Learn) -> None:
        """Take examples of a plan's gesture."""
        self.plan = plan
        self._armed_s = course.stage.time_s  # of the last touch; examples are taken for a while
        self._armed = True
        self._due_s: float | None = None  # until when the orb's answer is waited for
        self._ask_s: float | None = None  # when the page after this one comes by itself
        self._automatic = True
        self._chosen = 0
        self._refused = ""  # why the last example cannot be learned
        self._places: list[tuple[pygame.Rect, ExampleTaken]] = []
        super().__init__(course)

    @property
    def examples(self) -> list[ExampleTaken]:
        """The examples that can be learned."""
        return self.lessons.of(self.plan.label)

    def page(self) -> Menu:
        """Return what can be done with the examples."""
        words, count = self.words, len(self.examples)
        enough = count >= LEAST
        left_s = None if self._ask_s is None else max(0.0, self._ask_s - self._stage.time_s)
        value = f"{count}/{_ENOUGH}"
        if left_s is not None:
            value = words("teach.in_s", seconds=f"{left_s:.0f}")
        hint = words("teach.learn_hint" if enough else "teach.learn_least", least=LEAST)
        items = [self.item("teach.next", self._ask if enough else None, value, hint=hint)]
        if left_s is not None:
            items.append(self.item("teach.not_yet", self._wait))
        elif not self._armed:
            items.append(self.item("teach.go_on", self._arm))
        if count:
            self._chosen = min(self._chosen, count - 1)
            drop = lambda: self.lessons.drop(self.examples[self._chosen].number)  # noqa: E731
            chosen = f"{self._chosen + 1}"
            items.append(self.item("teach.throw_away", drop, chosen, step=self._choose))
        title = naming.gesture(words, self.plan.label)
        return Menu(title, [*items, self.back_item()], notice=self.notice())

    def notice(self) -> str:
        """Return what is wrong, with the link or with the last example."""
        return super().notice() or self._refused

    def _choose(self, step: int) -> None:
        self._chosen = (self._chosen + step) % max(1, len(self.examples))

    def _arm(self) -> None:
        self._armed, self._armed_s = True, self._stage.time_s

    def _wait(self) -> None:
        self._automatic, self._ask_s = False, None
        self._arm()

    def _ask(self) -> None:
        """Ask for the rest of the plan, with the symmetries that the examples suggest."""
        last, course = self.examples[-1], self.course
        plan = replace(self.plan, rotations=last.rotations, mirrored=last.mirrored)
        more = partial(ExamplesPage, course)
        self.become(DetailsPage(course, plan, partial(LearningPage, course), more))

    # -- the touches ---------------------------------------------------------------------

    def recognised(self, command: Command, time_s: float) -> bool:
        """Return True while examples are taken: their gestures are no steps."""
        return self._armed or super().recognised(command, time_s)

    def touched(self, event: TouchEvent, time_s: float) -> None:
        """Begin or end an example."""
        if event == "ended":
            if self.lessons.open is not None:
                self._due_s = time_s + _ANSWER_S
            self.lessons.end_example()
        elif self._armed and self._due_s is None:
            self._armed_s, self._ask_s = time_s, None
            self.lessons.begin_example(self.plan.label)

    def report(self, message: Report, time_s: float) -> None:
        """Take a report; go on after a moment when there are enough examples."""
        super().report(message, time_s)
        if isinstance(message, ExampleTaken):
            self._due_s = None
            self._refused = naming.said(self.words, message.text)
            self.lessons.status = None  # why it could not be learned before
            self._chosen = len(self.examples) - 1
            if self._automatic and len(self.examples) >= _ENOUGH:
                self._ask_s = time_s + _MOMENT_S

    def link_lost(self) -> None:
        """Give up the example under way."""
        super().link_lost()
        self.lessons.end_example(keep=False)
        self._due_s = self._ask_s = None

    def tick(self, time_s: float) -> None:
        """Let time pass."""
        if self._due_s is not None and time_s >= self._due_s:
            self._due_s = None
        if time_s >= self._armed_s + _IDLE_S and self.lessons.open is None:
            self._armed = False
        if len(self.examples) < _ENOUGH:
            self._ask_s = None
        super().tick(time_s)
        if self._ask_s is not None and time_s >= self._ask_s:
            self._ask()

    def nav(self, nav: MenuStep, time_s: float) -> None:
        """Take a step; it postpones the learning."""
        if self._ask_s is not None:
            self._ask_s = time_s + _MOMENT_S
        super().nav(nav, time_s)

    def leave(self) -> None:
        """Go back; an example under way is thrown away."""
        self.lessons.end_example(keep=False)
        super().leave()

    # -- the picture ---------------------------------------------------------------------

    def mouse(self, event: pygame.event.Event, time_s: float) -> None:
        """Throw an example away whose thumbnail is clicked."""
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            for place, example in self._places:
                if place.collidepoint(event.pos):
                    self.lessons.drop(example.number)
                    self.rebuild()
                    return
        super().mouse(event, time_s)

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the page, what to do now, and the examples."""
        super().draw(surface, time_s)
        strip, palette = self.strip(), self._stage.look.palette
        top = strip.top + self.px(6)
        self.write(surface, self._cue(), 40, (strip.centerx, top), strip.width, dim=not self._ready)
        self._places = []
        first = max(0, len(self.examples) - _SHOWN)
        for number, example in enumerate(self.examples[first:]):
            picture = self.thumbnail(example.image, _RADIUS)
            wide = picture.get_width() + self.px(8)
            row = wide * min(_SHOWN, len(self.examples))
            left = strip.centerx - row // 2 + number * wide
            place = picture.get_rect(topleft=(left, top + self.px(52)))
            surface.blit(picture, place)
            if first + number == self._chosen:
                line = max(1, self.px(2))
                pygame.draw.circle(surface, palette.dim, place.center, place.width // 2, line)
            self._places.append((place, example))

    @property
    def _ready(self) -> bool:
        return self._armed and self._due_s is None and self.orb.state.link == "live"

    def _cue(self) -> str:
        words = self.words
        if self.lessons.open is not None:
            return words("teach.taking")
        if self._due_s is not None:
            return words("teach.moment")
        if not self._ready:
            return ""
        return words("teach.now", name=naming.gesture(words, self.plan.label))


class LearningPage(TeachPage):
    """Shows how far the orb is with a gesture, and leads to the trial of it."""

    def __init__(self, course: Course, plan: Learn) -> None:
        """Let the orb learn the plan's gesture from its pending examples."""
        self.plan, self._begun_s = plan, course.stage.time_s
        self._heard_s = self._begun_s  # when the orb was learning, or away
        course.orb.lessons.change(plan)
        super().__init__(course)

    def page(self) -> Menu:
        """Return the progress."""
        words, status = self.words, self.lessons.status
        share = status.progress if status else 0.0
        seconds = self._stage.time_s - self._begun_s
        value = words("teach.seconds", seconds=f"{seconds:.0f}")
        item = self.item("teach.learning", value=value, share=share)
        text = naming.said(words, status.text) if status else ""
        title = naming.gesture(words, self.plan.label)
        return Menu(title, [item, self.back_item()], notice=self.notice() or text)

    def tick(self, time_s: float) -> None:
        """Let time pass; an orb that was started again learns no more, and is asked again."""
        super().tick(time_s)
        if self.lessons.status is not None or self.lessons.vocabulary is None:
            self._heard_s = time_s
        elif time_s > self._heard_s + _FORGOTTEN_S and self._stage.screen is self:
            self.become(ExamplesPage(self.course, self.plan))

    def report(self, message: Report, time_s: float) -> None:
        """Take a report; go on when the gesture is learned."""
        super().report(message, time_s)
        status = self.lessons.status
        if status is None or self._stage.screen is not self:
            return
        if status.state == DONE:
            more = lambda: self._stage.push(ExamplesPage(self.course, self.plan))  # noqa: E731
            self.become(TryPage(self.course, self.plan.label, more))
        elif status.state == FAILED:
            self.become(ExamplesPage(self.course, self.plan))
