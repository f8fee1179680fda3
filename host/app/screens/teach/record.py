"""Page on which a session is recorded by cues on the screen, for a training."""

from collections.abc import Sequence
from pathlib import Path
from random import Random
from typing import Final

import pygame

from controller.protocol.messages import Command, Contact, Perform
from controller.protocol.teaching import Record, RecordLabel
from host.app import ghost
from host.app.cues import EXAMPLE_S, NULL, Cue, CueRun
from host.app.screens.teach.page import Course, TeachPage
from host.app.screens.teach.touch_watch import TouchEvent
from host.ui import naming, sprites
from tetris.window.menu import Item, Menu

_LONGEST_S: Final = 0.1  # time that one picture may bring: cues wait while nothing is seen
_TARGET_MM: Final = (2.0, 6.0)  # depth and radius of the finger that shows where to touch
_DOWN_S: Final = 0.45  # of a showing of the ghost, when its fingers come down
_QUIET_S: Final = 0.8  # after leaving, in which the last gesture may still be recognised
_LIFT: Final = Perform(0, "", 0.0, 0.0)


def homely(text: object) -> str:
    """Return a text with the user's home folder as ~."""
    return str(text).replace(str(Path.home()), "~")


class RecordPage(TeachPage):
    """Shows what to do now, and labels the orb's recording with it.

    Attributes:
        run: The cues; their time begins when the orb records.
    """

    def __init__(
        self, course: Course, cues: Sequence[Cue], rng: Random, *, by_hand: bool = False
    ) -> None:
        """Begin a recording; `by_hand`: the virtual orb's own hand follows the cues."""
        self.run, self._by_hand, self._rng = CueRun(cues, rng), by_hand, rng
        self._begun = self._felt = False  # whether it records; a touch began
        self._last_s, self._label, self._number = course.stage.time_s, NULL, 0
        super().__init__(course)
        course.recording = None
        self.orb.send(Record(True))

    def page(self) -> Menu:
        """Return the ways to wait and to end."""
        words, status = self.words, self.course.recording
        where = words("train.where", folder=homely(Path(status.text).parent)) if status else ""
        go_on = words("train.go_on" if self.run.paused else "train.pause")
        pause = Item(go_on, self._pause, hint=where)
        stop = Item(words("train.stop"), self.leave, hint=words("train.stop_hint"))
        problem = self.notice() or (words("train.untouched") if self.run.paused else "")
        return Menu("", [pause, stop], notice=problem)

    def _pause(self) -> None:
        self.run.paused = not self.run.paused

    def recognised(self, command: Command, time_s: float) -> bool:
        """Return True while cues run: their gestures are no steps."""
        return not self.run.paused or super().recognised(command, time_s)

    def touched(self, event: TouchEvent, time_s: float) -> None:
        """Note that a touch began."""
        self._felt |= event == "begun"

    # -- time ----------------------------------------------------------------------------

    def tick(self, time_s: float) -> None:
        """Let the cues go on while the orb records; it may end the recording by itself."""
        passed_s, self._last_s = time_s - self._last_s, time_s
        super().tick(time_s)
        status = self.course.recording
        if status is None or self._stage.screen is not self:
            return
        if not status.on:
            self._leave()
            return
        self._begun = True
        if self.orb.state.ready:
            self._advance(min(_LONGEST_S, max(0.0, passed_s)))
        if self.run.phase == "over":
            self.leave()

    def _advance(self, passed_s: float) -> None:
        run, before = self.run, self.run.phase
        run.advance(passed_s, touched=self._felt)
        self._felt = False
        if run.label != self._label:
            self._label = run.label
            self.orb.send(RecordLabel(run.label))
        if run.phase == "go" != before and self._by_hand:
            self._perform(run.cue)
        self.orb.ghost = self._shown()

    def _perform(self, cue: Cue) -> None:
        self._number += 1
        stray = self._rng.choice(("brush", "rest"))
        label = stray if cue.label == NULL else cue.label
        self.orb.send(Perform(self._number, label, *cue.place))

    def _shown(self) -> tuple[Contact, ...]:
        run, cue = self.run, self.run.cue
        if run.paused or run.phase not in ("ready", "go") or self.orb.state.contacts:
            return ()
        if cue.label not in ghost.STROKES:
            return (Contact(1, *cue.place, *_TARGET_MM),)
        at_s = _DOWN_S + (run.length_s - run.left_s) * (run.phase == "go")
        return ghost.contacts(cue.label, cue.place, at_s, self.orb.state.pad)

    def link_lost(self) -> None:
        """Give up: the orb ends the recording, or goes on with it unlabelled until asked again."""
        super().link_lost()
        self._leave()

    def leave(self) -> None:
        """End the recording, which is kept, and go back."""
        self.orb.send(Record(False))
        self._leave()

    def _leave(self) -> None:
        if self._by_hand:
            self.orb.send(_LIFT)
        self.orb.ignore(_QUIET_S)
        super().leave()

    # -- the picture ---------------------------------------------------------------------

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the items, and what to do now: icon, words, countdown, progress."""
        super().draw(surface, time_s)
        strip, palette, run = self.strip(), self._stage.look.palette, self.run
        top = strip.top + self.px(16)
        going = run.phase == "go" and not run.paused
        icon = sprites.icon(run.cue.label, self.px(96), palette.accent if going else palette.dim)
        surface.blit(icon, icon.get_rect(midtop=(strip.centerx, top)))
        place = strip.centerx, top + self.px(104)
        self.write(surface, self._what(), 54, place, strip.width, dim=not going)
        wide, high = min(strip.width, self.px(360)), max(3, self.px(14))
        bar = pygame.Rect(strip.centerx - wide // 2, top + self.px(190), wide, high)
        pygame.draw.rect(surface, palette.line, bar, border_radius=high // 2)
        bar.width = round(wide * max(0.0, run.left_s) / max(run.length_s, 0.01))
        colour = palette.accent if going else palette.dim
        pygame.draw.rect(surface, colour, bar, border_radius=high // 2)
        place = strip.centerx, bar.bottom + self.px(14)
        self.write(surface, self._progress(), 24, place, strip.width, dim=True)

    def _what(self) -> str:
        words, run = self.words, self.run
        stray = run.cue.label == NULL
        name = words("train.stray") if stray else naming.gesture(words, run.cue.label)
        if run.paused:
            return words("train.paused")
        if not self._begun or not self.orb.state.ready:
            return words("teach.moment")
        return words(f"train.{run.phase}", name=name)

    def _progress(self) -> str:
        run = self.run
        minutes = f"{(run.count - run.made) * EXAMPLE_S / 60 + 0.5:.0f}"
        return self.words("train.progress", made=run.made, count=run.count, minutes=minutes)
