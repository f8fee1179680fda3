"""Autoplayer of the demo, and the record of what its hand did and what was understood.

It looks at the board, decides, and asks the virtual orb's hand to act. It sees what a player sees,
the board, and nothing of what the orb makes of its gestures. It errs in no other way than its hand
does.
"""

import math
import random
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, Final

from controller.bundles import vocabulary
from controller.shared.event_metric import Answer, Event, Score, judge
from controller.shared.protocol.messages import Command, GroundTruth, Perform, Welcome
from host.actions import ACTIONS
from host.connection.receiver import Delivered, Received
from tetris.bots.greedy import Plan, plan, plan_piece
from tetris.engine.events import Event as GameEvent
from tetris.engine.events import Locked
from tetris.engine.game import Action, Game, Phase
from tetris.engine.pieces import Piece

Manual = dict[str, tuple[str, tuple[float, float]]]  # command -> gesture, and where it goes

COMMAND_OF: Final = {action: command for command, action in ACTIONS.items()}
HOLD: Final = "hold"
MIDDLE: Final = (2.0, 2.0)
ASIDE: Final = ((0.8, 2.7), (3.2, 2.7), (2.0, 0.4))  # where gestures go whose place matters
FIRST_S: Final = 1.8  # the orb takes its rest image during the first second
LAST_S: Final = 3.0  # before the end nothing is begun that could not be answered in time
LOOK_S: Final = (0.3, 0.7)  # from the last finger's leaving to the next gesture
STRAY_S: Final = (9.0, 20.0)  # from one brush or resting hand to the next: >= 2 a minute
AIM: Final = 0.15  # deviation of where a press is meant, grid units; the hand adds its own
COMMAND_COST: Final = 1.0  # of a gesture, in the bot's values: docs/measurements.md, fast hands
NUDGE: Final = 0.3  # how often the player lets a piece down a row to see where it will land


def _manual() -> Manual:
    """Return the orb's manual: the shipped vocabulary, read from command to gesture."""
    book = vocabulary.shipped()
    mapping, manual = book.mapping, Manual()
    for entry in book.entries:
        for place in ASIDE if entry.located else (MIDDLE,):
            if command := mapping.command(entry.label, place):
                manual.setdefault(command, (entry.label, place))
    return manual


MANUAL: Final = _manual()


class Autoplayer:
    """One player's decisions; the same for the same seed and the same board."""

    def __init__(self, seed: int, seconds: float) -> None:
        self._seconds = seconds
        self._random = random.Random(f"orbtouch player {seed}")
        self._free_s = FIRST_S  # when the hand may begin again
        self._stray_s = self._random.uniform(*STRAY_S)
        self._busy = 0  # number of the performance under way
        self._number = 0
        self._piece = -1  # which piece the target and the nudge belong to
        self._target: Piece | None = None
        self._nudge = False
        self._manual = MANUAL

    def meet(self, welcome: Welcome) -> None:
        """Take an orb's labels and commands.

        A gesture that is not in the manual, and `hold` that is not either, belong together: that is
        what its owner has taught it.
        """
        named = {label for label, _ in MANUAL.values()}
        taught = [label for label in welcome.labels[1:] if label not in named]
        self._manual = {does: how for does, how in MANUAL.items() if how[0] in welcome.labels}
        if len(taught) == 1 and set(welcome.commands) - set(self._manual) == {HOLD}:
            self._manual[HOLD] = taught[0], MIDDLE

    def decide(self, game: Game, now_s: float) -> tuple[Perform, str] | None:
        """Return what the hand shall do now and the command it means ("" for a stray touch)."""
        if self._busy or now_s < self._free_s or now_s > self._seconds - LAST_S:
            return None
        if now_s >= self._stray_s:
            self._stray_s = now_s + self._random.uniform(*STRAY_S)
            label = self._random.choice(("brush", "rest"))
            return self._act(label, self._random.uniform(0, 4), self._random.uniform(0, 4)), ""
        command = self._choose(game)
        if command not in self._manual:
            return None
        label, (x, y) = self._manual[command]
        if (x, y) != MIDDLE:
            x, y = self._random.gauss(x, AIM), self._random.gauss(y, AIM)
        return self._act(label, x, y), command

    def left(self, number: int, now_s: float) -> None:
        """Take note that the hand has left the orb after performance `number`."""
        if number == self._busy:
            self._busy = 0
            self._free_s = now_s + self._random.uniform(*LOOK_S)

    def _act(self, label: str, x: float, y: float) -> Perform:
        self._number += 1
        self._busy = self._number
        return Perform(self._number, label, x, y)

    def _choose(self, game: Game) -> str | None:
        if game.phase is Phase.OVER:
            return "drop"  # begins the next game
        if game.phase is not Phase.RUNNING:
            return None
        if game.pieces_placed != self._piece:
            self._piece, self._target = game.pieces_placed, None
            self._nudge = self._random.random() < NUDGE
        chosen = plan(game, command_cost=COMMAND_COST, target=self._target)
        if HOLD in self._manual and game.can_hold and self._rather_other(game, chosen):
            self._piece = -1  # another piece, another target
            return HOLD
        self._target = chosen.landing
        action = chosen.actions[0]
        if action is Action.HARD_DROP and self._nudge and game.piece.y - game.ghost_y > 3:
            self._nudge = False
            return "down"
        return COMMAND_OF[action]

    @staticmethod
    def _rather_other(game: Game, chosen: Plan) -> bool:
        """Whether the piece that holding would bring into play is worth the gesture."""
        other = Piece.entering(game.hold or game.next[0])
        best = plan_piece(game.board.bits, other, command_cost=COMMAND_COST)
        return best.value - COMMAND_COST > chosen.value


@dataclass(slots=True)
class DemoRecord:
    """Record of a demo: the hand's truth, the commands, the game."""

    meant: dict[int, str] = field(default_factory=dict)
    truths: list[GroundTruth] = field(default_factory=list)
    commands: list[tuple[int, str]] = field(default_factory=list)  # (ms of the action, name)
    pieces: int = 0
    lines: int = 0

    def take(self, received: list[Received], until_ms: int) -> None:
        """Note truths and commands of one tick."""
        for item in received:
            if isinstance(item, Delivered) and isinstance(item.message, GroundTruth):
                self.truths.append(item.message)
            elif isinstance(item, Delivered) and isinstance(item.message, Command):
                self.commands.append((until_ms, item.message.name))

    def watch(self, events: list[GameEvent]) -> None:
        """Note what the game did."""
        for event in events:
            if isinstance(event, Locked):
                self.pieces += 1
                self.lines += len(event.rows)

    @property
    def _gestures(self) -> list[GroundTruth]:
        """The performances that mean something; the others are stray touches."""
        return [truth for truth in self.truths if self.meant[truth.number]]

    @property
    def _events(self) -> list[Event]:
        return [
            Event(truth.onset_ms / 1000, truth.release_ms / 1000, self.meant[truth.number])
            for truth in self._gestures
        ]

    def score(self) -> Score:
        """Judge each performed gesture by the command that it meant."""
        return judge(self._events, [Answer(ms / 1000, name) for ms, name in self.commands])

    def verdict(
        self, seed: int, seconds: float, received: int = 0, sent: int = 0
    ) -> dict[str, Any]:
        """Return the figures of a demo, and bytes over the link: each performed gesture judged."""
        gestures, events, score = self._gestures, self._events, self.score()
        return {
            "seed": seed,
            "seconds": seconds,
            "intended": score.intended,
            "hits": score.hits,
            "wrong": score.wrong,
            "missed": score.missed,
            "false_alarms": score.false_alarms,
            "duplicates": score.duplicates,
            "latency_s": {
                "p50": _quantile(score.latencies_s, 0.5),
                "p95": _quantile(score.latencies_s, 0.95),
            },
            "pieces": self.pieces,
            "lines": self.lines,
            "by_command": dict(sorted(Counter(event.kind for event in events).items())),
            "stray_touches": len(self.truths) - len(gestures),
            "link_bytes": {"received": received, "sent": sent},
            "commands": self.commands,
            "events": [[one.onset_ms, one.release_ms, self.meant[one.number]] for one in gestures],
        }


def _quantile(values: list[float], share: float) -> float | None:
    """Return the smallest value that `share` of the values do not exceed; None of none."""
    if not values:
        return None
    return round(sorted(values)[max(0, math.ceil(share * len(values)) - 1)], 4)
