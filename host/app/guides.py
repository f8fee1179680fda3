"""Ways to the introduction and to the demo: items of the title page, and the first start."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from host.app.screen import Orb
from host.app.screens.learn import LearnScreen
from host.app.screens.watch import TakeOver, WatchScreen
from tetris.window.menu import Item
from tetris.window.screen_stack import ScreenStack
from tetris.window.settings import changed


@dataclass(frozen=True, slots=True)
class Guides:
    """The two screens and what they lead to.

    Attributes:
        orb: What is introduced.
        play: Begins a game.
        go_on: Lets the player go on with a recorded game.
    """

    orb: Orb
    play: Callable[[], None]
    go_on: TakeOver

    def items(self, stage: ScreenStack) -> list[Item]:
        """Return the items; the demo needs a virtual orb, which has a hand of its own."""
        words = stage.look.words
        learn = Item(words("learn.title"), lambda: self.learn(stage), hint=words("learn.hint"))
        watch = Item(words("watch.title"), lambda: self.watch(stage), hint=words("watch.hint"))
        return [learn, watch] if self.orb.virtual else [learn]

    def learn(self, stage: ScreenStack, *, ask: bool = False) -> None:
        """Show the introduction, or `ask` whether to."""

        def exits() -> Sequence[Item]:
            return [Item(stage.look.words("menu.play"), self.play)]

        stage.push(LearnScreen(stage, self.orb, exits, ask=ask))

    def watch(self, stage: ScreenStack) -> None:
        """Let the virtual orb's own hand play."""
        stage.push(WatchScreen(stage, self.orb, self.go_on))

    def offer(self, stage: ScreenStack) -> None:
        """Ask at the first start whether to show the introduction."""
        if not stage.settings.introduced:
            stage.change(changed(stage.settings, introduced=True))
            self.learn(stage, ask=True)
