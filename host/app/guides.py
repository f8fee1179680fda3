"""Ways to introduction, teaching and demo: items of the title page, and the first start."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from host.app.screen import Orb
from host.app.screens.learn import LearnScreen
from host.app.screens.teach.page import Course
from host.app.screens.teach.screen import TeachScreen
from host.app.screens.watch import TakeOver, WatchScreen
from tetris.kit.menu import Item
from tetris.kit.stage import Stage


@dataclass(frozen=True, slots=True)
class Guides:
    """The screens and what they lead to."""

    orb: Orb
    play: Callable[[], None]  # begins a game
    go_on: TakeOver  # lets the player go on with a recorded game

    def items(self, stage: Stage) -> list[Item]:
        """Return the items; the demo needs a virtual orb, which has a hand of its own."""
        words = stage.look.words
        learn = Item(words("menu.learn"), lambda: self.learn(stage), hint=words("learn.hint"))
        watch = Item(words("watch.title"), lambda: self.watch(stage), hint=words("watch.hint"))
        teach = Item(words("menu.teach"), lambda: self.teach(stage), hint=words("teach.hint"))
        return [learn, teach, watch] if self.orb.virtual else [learn, teach]

    def learn(self, stage: Stage, *, ask: bool = False) -> None:
        """Show the introduction, or `ask` whether to."""

        def exits() -> Sequence[Item]:
            words = stage.look.words
            teach = Item(words("menu.teach"), lambda: self.teach(stage))
            return [Item(words("menu.play"), self.play), teach]

        stage.push(LearnScreen(stage, self.orb, exits, ask=ask))

    def teach(self, stage: Stage) -> None:
        """Show the gestures in use, to which others can be added."""
        self.orb.lessons.begin()
        stage.push(TeachScreen(Course(stage, self.orb, self.play)))

    def watch(self, stage: Stage, seed: int | None = None) -> None:
        """Let the virtual orb's own hand play, a game of its own without a seed."""
        stage.push(WatchScreen(stage, self.orb, self.go_on, seed))

    def offer(self, stage: Stage) -> None:
        """Ask at the first start whether to show the introduction."""
        if not stage.settings.introduced:
            stage.change(replace(stage.settings, introduced=True))
            self.learn(stage, ask=True)
