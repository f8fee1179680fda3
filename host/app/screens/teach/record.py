"""Page on which a session is recorded by cues on the screen, for a training."""

from collections.abc import Sequence
from typing import Final

import numpy as np
import pygame

from controller.shared.cues import NULL_LABEL, CueSession, CueTiming, ExampleRequest, Phase
from controller.shared.protocol.messages import Command, Contact
from controller.shared.protocol.teaching import Record, RecordLabel
from host.app.screens.teach.page import Course, TeachPage
from host.ui import ghost, naming, sprites
from host.ui.touch_watch import TouchEvent
from tetris.kit.menu import Menu

TIMING: Final = CueTiming(get_ready_s=1.0, go_s=1.2, rest_s=0.6, jitter_s=0.8)
EXAMPLE_S: Final = TIMING.get_ready_s + TIMING.go_s + TIMING.rest_s + TIMING.jitter_s / 2
UNTOUCHED: Final = 3  # examples without a touch in a row, after which the session pauses
_LONGEST_S: Final = 0.1  # time that one picture may bring: cues wait while nothing is seen
_TARGET_MM: Final = (2.0, 6.0)  # depth and radius of the finger that shows where to touch
_DOWN_S: Final = 0.45  # of a showing of the ghost, when its fingers come down
_QUIET_S: Final = 0.8  # after leaving, in which the last gesture may still be recognised
_WORDS: Final = {Phase.GET_READY: "ready", Phase.GO: "go", Phase.REST: "rest", Phase.DONE: "rest"}


class RecordPage(TeachPage):
    """Shows what to do now, and labels the orb's recording with it.

    Attributes:
        cue: The present cue; time begins when the orb records.
        count: Number of all examples.
        paused: Whether time stands still, by choice or after examples without a touch.
    """

    def __init__(self, course: Course, asks: Sequence[ExampleRequest], seed: int) -> None:
        """Begin a recording, which the seed times."""
        self._session = CueSession(asks, TIMING, np.random.default_rng(seed))
        self._session.advance(0.0, felt=False)
        self.cue, self.count, self.paused = self._session.at(0.0), len(asks), False
        self._now_s = self._phase_s = 0.0  # time of the cues; when the phase began
        self._missed = 0  # examples without a touch in a row
        self._begun = self._felt = False  # whether it records; whether it is touched
        self._last_s, self._label = course.stage.time_s, NULL_LABEL
        super().__init__(course)
        course.recording = None
        self.orb.send(Record(True))

    def page(self) -> Menu:
        """Return the ways to wait and to end."""
        words, status = self.words, self.course.recording
        where = words("train.where") if status else ""
        go_on = "train.go_on" if self.paused else "train.pause"
        items = [self.item(go_on, self._pause, hint=where), self.item("train.stop", self.leave)]
        problem = self.notice() or (words("train.untouched") if self.paused else "")
        return Menu("", items, notice=problem)

    def _pause(self) -> None:
        self.paused = not self.paused

    def recognised(self, command: Command, time_s: float) -> bool:
        """Return True while cues run: their gestures are no steps."""
        return not self.paused or super().recognised(command, time_s)

    def touched(self, event: TouchEvent, time_s: float) -> None:
        """Note whether it is touched."""
        self._felt = event == "begun" or (self._felt and event != "ended")

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
        if self.orb.state.ready and not self.paused:
            self._advance(min(_LONGEST_S, max(0.0, passed_s)))
        if self.cue.phase is Phase.DONE:
            self.leave()

    def _advance(self, passed_s: float) -> None:
        before = self.cue
        self._now_s += passed_s
        missed = self._session.advance(self._now_s, felt=self._felt)
        self.cue = self._session.at(self._now_s)
        if self.cue.left < before.left:
            self._missed = 0
        self._missed += len(missed)
        if self._missed == UNTOUCHED:
            self.paused, self._missed = True, 0
        if self.cue.phase is not before.phase:
            self._phase_s = self._now_s
        label = self.cue.label if self.cue.phase is Phase.GO else NULL_LABEL
        if label != self._label:
            self._label = label
            self.orb.send(RecordLabel(label))
        self.orb.ghost = self._shown()

    def _place(self) -> tuple[float, float]:
        return self.cue.place or self.orb.state.pad.centre

    def _shown(self) -> tuple[Contact, ...]:
        cue = self.cue
        shown = cue.phase in (Phase.GET_READY, Phase.GO)
        if self.paused or not shown or self.orb.state.contacts:
            return ()
        if cue.label not in ghost.STROKES:
            return (Contact(1, *self._place(), *_TARGET_MM),)
        at_s = _DOWN_S + (self._now_s - self._phase_s) * (cue.phase is Phase.GO)
        return ghost.contacts(cue.label, self._place(), at_s, self.orb.state.pad)

    def link_lost(self) -> None:
        """Give up: the orb ends the recording, or goes on with it unlabelled until asked again."""
        super().link_lost()
        self._leave()

    def leave(self) -> None:
        """End the recording, which is kept, and go back."""
        self.orb.send(Record(False))
        self._leave()

    def _leave(self) -> None:
        self.orb.ignore(_QUIET_S)
        super().leave()

    # -- the picture ---------------------------------------------------------------------

    def draw(self, surface: pygame.Surface, time_s: float) -> None:
        """Draw the items, and what to do now: icon, words, countdown, progress."""
        super().draw(surface, time_s)
        strip, palette, cue = self.strip(), self._stage.look.palette, self.cue
        top = strip.top + self.px(16)
        going = cue.phase is Phase.GO and not self.paused
        icon = sprites.icon(cue.label, self.px(96), palette.accent if going else palette.dim)
        surface.blit(icon, icon.get_rect(midtop=(strip.centerx, top)))
        place = strip.centerx, top + self.px(104)
        self.write(surface, self._what(), 54, place, strip.width, dim=not going)
        wide, high = min(strip.width, self.px(360)), max(3, self.px(14))
        bar = pygame.Rect(strip.centerx - wide // 2, top + self.px(190), wide, high)
        pygame.draw.rect(surface, palette.line, bar, border_radius=high // 2)
        bar.width = round(wide * cue.left_s / max(cue.left_s + self._now_s - self._phase_s, 0.01))
        colour = palette.accent if going else palette.dim
        pygame.draw.rect(surface, colour, bar, border_radius=high // 2)
        place = strip.centerx, bar.bottom + self.px(14)
        self.write(surface, self._progress(), 24, place, strip.width, dim=True)

    def _what(self) -> str:
        words, label = self.words, self.cue.label
        stray = label == NULL_LABEL
        name = words("train.stray") if stray else naming.gesture(words, label)
        if self.paused:
            return words("train.paused")
        if not self._begun or not self.orb.state.ready:
            return words("teach.moment")
        return words(f"train.{_WORDS[self.cue.phase]}", name=name)

    def _progress(self) -> str:
        minutes = f"{self.cue.left * EXAMPLE_S / 60 + 0.5:.0f}"
        made = self.count - self.cue.left
        return self.words("train.progress", made=made, count=self.count, minutes=minutes)
