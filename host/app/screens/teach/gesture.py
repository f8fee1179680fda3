"""The page on which a gesture is taught: its examples, what it costs, and its trial."""

from dataclasses import replace
from functools import partial
from typing import Final, Literal

import pygame

from controller.shared.protocol.messages import COMMANDS, Command, Report, Telemetry
from controller.shared.protocol.teaching import (
    DONE,
    LEARNING,
    ExampleTaken,
    Learn,
    SaveAs,
    SetWaiting,
    Undo,
)
from host.app import traces
from host.app.lessons import Trial
from host.app.screens.teach.page import (
    Course,
    Do,
    NamePage,
    command_page,
)
from host.app.screens.teach.pictures import PicturePage
from host.app.traces import Trace
from host.ui import naming
from host.ui.touch_watch import PAUSE_S, TouchEvent
from tetris.kit.menu import Item, Menu

LEAST: Final = 3  # examples from which a gesture can be learned
ENOUGH: Final = 5  # examples after which more are of little use
_ANSWER_S: Final = 3.0  # in which the orb answers an example
_COMMANDS: Final = (*COMMANDS, "")
_ROTATIONS: Final = ("none", "half", "all")
_SHOWN: Final = 6  # examples, the newest
_BESIDE: Final = 0.9  # of the height: in a narrower window the pictures stand below the items
_COLUMN: Final = 0.54  # of the width, for the items
_FITS: Final = 375  # design units of a column whose items need no smaller letters

Mode = Literal["examples", "learning", "trial"]


def save_as(course: Course) -> None:
    """Show the page that asks for the name of a copy."""
    save = lambda name: course.orb.lessons.change(SaveAs(name))  # noqa: E731
    names = course.stage.look.words("teach.save_names").split()
    course.stage.push(NamePage(course, "teach.save_as", names, save))


class GesturePage(PicturePage):
    """Takes each touch of the dome as an example, or in the trial as a try.

    No gesture is a step here.

    Attributes:
        mode: What touches are now.
        trial: What was tried, and understood.
        doubt: An example that is questioned, and the gesture that it looks like, "" none.
    """

    def __init__(self, course: Course, plan: Learn) -> None:
        """Take examples of a plan's gesture."""
        self.plan = plan
        self.mode: Mode = "examples"
        self.trial = Trial(plan.label)
        self.doubt: tuple[ExampleTaken, str] | None = None
        self._due_s: float | None = None  # until when the orb's answer is waited for
        self._learned = False  # on this visit
        self._number = 0  # of the example that is traced
        self._chosen, self._guessed = 0, True  # whether turns are those that the examples suggest
        self._refused = ""  # why the last example cannot be learned
        self._places: list[tuple[pygame.Rect, Do]] = []  # what a click does where
        super().__init__(course, plan.label)

    @property
    def examples(self) -> list[ExampleTaken]:
        """The examples that can be learned."""
        return self.lessons.of(self.plan.label)

    # -- what can be chosen --------------------------------------------------------------

    def page(self) -> Menu:
        """Return what can be done now."""
        if self.doubt:
            items = [self.item("teach.keep", self._keep), self.item("teach.throw", self._throw)]
        elif self.mode == "learning":
            share = self.lessons.status.progress if self.lessons.status else 0.0
            items = [self.item("teach.learning", share=share)]
        else:
            items = self._trial_items() if self.mode == "trial" else self._example_items()
        title = naming.gesture(self.words, self.plan.label)
        return Menu(title, [*items, self.back_item()], notice=self.notice())

    def notice(self) -> str:
        """Return what is wrong, with the link or with the last example."""
        return super().notice() or self._refused

    def _example_items(self) -> list[Item]:
        words, plan, count = self.words, self.plan, len(self.examples)
        hint = words("teach.learn_hint" if count >= LEAST else "teach.learn_least", least=LEAST)
        learn = self._learn if count >= LEAST else None
        items = [self.item("teach.learn", learn, f"{count}/{ENOUGH}", hint=hint)]
        if plan.label in self.orb.state.labels:
            items.append(self.item("teach.trial", partial(self._turn_to, "trial")))
        if count:
            self._chosen = min(self._chosen, count - 1)
            chosen = f"{self._chosen + 1}"
            items.append(self.item("teach.throw_away", self._throw, chosen, step=self._choose))
        turned = words(f"teach.turned_{plan.rotations}")
        mirrored, hint = words("teach.same" if plan.mirrored else "teach.other"), ""
        hint = words("teach.guessed") if self._guessed else ""
        return [
            *items,
            self._command_item(),
            self.item("teach.turned", value=turned, step=self._turn, hint=hint),
            self.item("teach.mirror", value=mirrored, step=lambda _: self._mirror(), hint=hint),
        ]

    def _command_item(self) -> Item:
        """Return the item of the command; that of a gesture that is in use changes at once."""
        words, label = self.words, self.plan.label
        known = self.orb.state.gestures.get(label)
        if known is None:
            value = naming.command(words, self.plan.command)
            return self.item("teach.command", value=value, step=self._turn_command)
        command = known.rules[0].command if known.rules else ""
        self.plan = replace(self.plan, command=command)
        title = words("teach.change_command")
        show = lambda: self.show(command_page(self.course, title, label))  # noqa: E731
        return self.item("teach.command", show, naming.command(words, command))

    def _trial_items(self) -> list[Item]:
        words, meant = self.words, naming.gesture(self.words, self.trial.label)
        items = [
            self.item("teach.end_trial", partial(self._turn_to, "examples")),
            self.item("teach.meant", value=meant, step=self._mean),
        ]
        if any((one.now, one.now_s) != (one.eager, one.eager_s) for one in self.costs):
            waits = words("teach.yes" if self.lessons.waits else "teach.no")
            ask = SetWaiting(self.plan.label, not self.lessons.waits)
            step = lambda _: self.lessons.change(ask)  # noqa: E731
            items.append(self.item("teach.wait", value=waits, step=step))
        return [
            *items,
            self.item("teach.play", self.course.play),
            self.item("teach.undo", self.leaving(partial(self.lessons.change, Undo()))),
            self.item("teach.save_as", lambda: save_as(self.course)),
        ]

    def _choose(self, step: int) -> None:
        self._chosen = (self._chosen + step) % max(1, len(self.examples))

    def _turn_command(self, step: int) -> None:
        place = _COMMANDS.index(self.plan.command) if self.plan.command in _COMMANDS else 0
        self.plan = replace(self.plan, command=_COMMANDS[(place + step) % len(_COMMANDS)])

    def _turn(self, step: int) -> None:
        place = _ROTATIONS.index(self.plan.rotations) + step
        rotations = _ROTATIONS[place % len(_ROTATIONS)]
        self.plan, self._guessed = replace(self.plan, rotations=rotations), False

    def _mirror(self) -> None:
        self.plan, self._guessed = replace(self.plan, mirrored=not self.plan.mirrored), False

    def _mean(self, step: int) -> None:
        labels = self.orb.state.labels[1:]
        place = labels.index(self.trial.label) if self.trial.label in labels else 0
        self.trial.label = labels[(place + step) % len(labels)]

    def _turn_to(self, mode: Mode) -> None:
        self.mode, self.selected, self.long_leaves = mode, 0, mode != "trial"

    def _keep(self) -> None:
        self.doubt = None

    def _throw(self, example: ExampleTaken | None = None) -> None:
        one = example or (self.doubt[0] if self.doubt else self.examples[self._chosen])
        self.doubt, self._refused = None, ""
        self.lessons.drop(one.number)

    def _learn(self) -> None:
        self._turn_to("learning")
        self._learned = True
        self.lessons.change(self.plan)

    # -- the touches ---------------------------------------------------------------------

    def recognised(self, command: Command, time_s: float) -> bool:
        """Return True: no gesture is a step here."""
        self._name(command.label)
        return True

    def _name(self, label: str) -> None:
        if (trace := self.lessons.traces.get(self._number)) and self._number:
            self.lessons.traces[self._number] = replace(trace, names=(*trace.names, label))

    def touched(self, event: TouchEvent, time_s: float) -> None:
        """Begin or end an example, or a try."""
        felt = self.course.watch.felt
        if self.mode == "trial":
            ended = event == "ended"
            self.trial.touch(not ended, time_s - PAUSE_S * ended, felt=felt)
        elif event == "ended":
            if self.lessons.open is not None and felt:
                self._due_s = time_s + _ANSWER_S
            self.lessons.end_example(keep=felt)
        elif self.mode == "examples" and self._due_s is None and not self.doubt:
            self._number = self.lessons.begin_example(self.plan.label)

    def report(self, message: Report, time_s: float) -> None:
        """Take a report; question an example, try what was learned."""
        super().report(message, time_s)
        trace = self.lessons.traces.get(self._number)
        if isinstance(message, Telemetry) and trace and self.lessons.open is not None:
            self.lessons.traces[self._number] = trace.step(self.orb.state.felt)
        if self.mode == "trial":
            self.trial.take(message, time_s)
        if isinstance(message, ExampleTaken):
            self._taken(message)
        status = self.lessons.status
        if self.mode == "learning" and status is not None and status.state != LEARNING:
            self._turn_to("trial" if status.state == DONE else "examples")

    def _taken(self, example: ExampleTaken) -> None:
        self._due_s, self._number = None, 0
        if self.mode != "examples":
            return
        self._refused = self._stage.told(example.text)
        self.lessons.status = None  # why it could not be learned before
        if not example.felt or example.label != self.plan.label:
            return
        self._chosen = len(self.examples) - 1
        if self._guessed:
            turns, mirrored = example.rotations, example.mirrored
            self.plan = replace(self.plan, rotations=turns, mirrored=mirrored)
        seen = self.lessons.traces
        siblings = [seen[one.number] for one in self.examples[:-1] if one.number in seen]
        like = traces.doubt(self.plan.label, seen.get(example.number, Trace()), siblings)
        self.doubt = None if like is None else (example, like)
        self.selected = 0 if self.doubt else self.selected

    def link_lost(self) -> None:
        """Give up the example under way."""
        super().link_lost()
        self.lessons.end_example(keep=False)
        self._due_s = None

    def tick(self, time_s: float) -> None:
        """Let time pass."""
        if self._due_s is not None and time_s >= self._due_s:
            self._due_s = None
        lessons = self.lessons
        if self.mode == "learning" and lessons.status is None and lessons.vocabulary is not None:
            self._turn_to("examples")  # an orb that was started again learns no more
        super().tick(time_s)

    def leave(self) -> None:
        """Go back; an example under way is thrown away."""
        self.lessons.end_example(keep=False)
        super().leave()

    # -- the picture ---------------------------------------------------------------------

    def mouse(self, event: pygame.event.Event, time_s: float) -> None:
        """Do what a click on a picture does."""
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            for place, do in self._places:
                if place.collidepoint(event.pos):
                    do()
                    return
        super().mouse(event, time_s)

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw what can be chosen; beside it the examples or tries, and all gestures."""
        surface.fill(self._stage.look.palette.background)
        self._places = []
        area = self._stage.area
        column, side = pygame.Rect(area), pygame.Rect(area)
        if area.width >= _BESIDE * area.height:
            column.width = round(_COLUMN * area.width)
            side.left, side.width = column.right, area.width - column.width
        else:
            column.height = side.top = area.height // 2
            side.height = area.height - side.top
        column.top += self.px(28)
        column.height -= self.px(40)
        unit = min(self._stage.unit, column.width / _FITS)
        self._view.draw(surface, column, self.menu, self.selected, unit)
        side = side.inflate(-self.px(32), -self.px(44))
        self.write(surface, self._cue(), 32, side.midtop, side.width, dim=not self._ready)
        side.top, side.height = side.top + self.px(46), side.height - self.px(46)
        learned = self.mode == "trial" and self._learned
        cards = self.draw_cards(surface, side, learned=learned)
        room = pygame.Rect(side.left, side.top, side.width, cards - side.top)
        if self.doubt:
            self._draw_doubt(surface, room, *self.doubt)
        elif self.mode == "examples":
            self._draw_examples(surface, room)
        elif self.mode == "trial":
            self.draw_tries(surface, room, self.trial.heard)

    @property
    def _ready(self) -> bool:
        return self._due_s is None and self.orb.state.link == "live"

    def _cue(self) -> str:
        words, name = self.words, naming.gesture(self.words, self.plan.label)
        if self.doubt:
            other = naming.gesture(words, self.doubt[1])
            return words("teach.looks_like" if self.doubt[1] else "teach.unlike", name=other)
        if self.mode == "learning" or not self._ready:
            return words("teach.moment")
        if self.lessons.open is not None:
            return words("teach.taking")
        if self.mode == "trial":
            count, tries = self.trial.count(self.trial.label)
            name = naming.gesture(words, self.trial.label)
            return words("teach.tried", name=name, count=count, tries=tries)
        return words("teach.now", name=name)

    def _draw_doubt(
        self, surface: pygame.Surface, room: pygame.Rect, one: ExampleTaken, like: str
    ) -> None:
        others = [each for each in self.examples if each.number != one.number]
        known = self.orb.state.gestures.get(like)
        image, name = (known.image, like) if known else (others[-1].image, self.plan.label)
        trace = None if known else self.lessons.traces.get(others[-1].number)
        radius = min(room.width // 4, room.height // 2 - self.px(20)) - self.px(6)
        half = pygame.Rect(room.left, room.top, room.width // 2, room.height)
        own = self.lessons.traces.get(one.number)
        words = self.words("teach.this_one")
        self.draw_dome(surface, half.midtop, radius, one.image, own, words)
        half.left = half.right
        words = naming.gesture(self.words, name)
        self.draw_dome(surface, half.midtop, radius, image, trace, words)

    def _draw_examples(self, surface: pygame.Surface, room: pygame.Rect) -> None:
        shown = self.examples[-_SHOWN:]
        first, across = len(self.examples) - len(shown), 3 if room.width < 2 * room.height else 6
        wide, high = room.width // across, room.height // (-(-_SHOWN // across))
        radius = min(wide, high) // 2 - self.px(6)
        for number, one in enumerate(shown):
            x = room.left + round((number % across + 0.5) * wide)
            trace = self.lessons.traces.get(one.number)
            at = x, room.top + number // across * high
            place = self.draw_dome(surface, at, radius, one.image, trace, "")
            self._places.append((place, partial(self._throw, one)))
            if first + number == self._chosen:
                colour, line = self._stage.look.palette.dim, max(1, self.px(2))
                pygame.draw.circle(surface, colour, place.center, place.width // 2, line)
