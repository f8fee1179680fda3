"""Bot in the window: one action at a time, at a pace that can be followed by eye."""

from typing import Final

from tetris.bots import greedy
from tetris.bots.registry import Planner
from tetris.engine.events import Action, Event, Spawned, ToppedOut
from tetris.engine.game import Game, Phase
from tetris.engine.pieces import Piece

_REST_S: Final = 4.0  # how long its lost game stays on the screen


class BotPlayer:
    """Plays a game one action at a time, looking at the board before each."""

    def __init__(self, action_s: float, plan: Planner = greedy.plan) -> None:
        """Act every `action_s` seconds, as one of `tetris.bots.registry.BOTS` plans."""
        self._action_s = action_s
        self._plan = plan
        self._next_s = 0.0
        self._target: Piece | None = None

    def actions(self, game: Game, time_s: float) -> list[Action]:
        """Return what to do now: one action or none."""
        if time_s < self._next_s or game.phase is Phase.PAUSED:
            return []
        if game.phase is Phase.OVER:
            self._next_s = time_s + self._action_s
            return [Action.RESTART]
        if not game.in_play:
            return []
        plan = self._plan(game, target=self._target)
        self._target = plan.landing
        self._next_s = time_s + self._action_s
        return [plan.actions[0]]

    def watch(self, events: list[Event]) -> None:
        """Forget the target when a new piece has come."""
        if any(isinstance(event, Spawned) for event in events):
            self._target = None
        if any(isinstance(event, ToppedOut) for event in events):
            self._next_s += _REST_S
