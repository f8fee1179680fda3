"""Forty lines by Aim with the window's pointer, as fast as it goes, in virtual time.

    python -m tests.benchmarks.forty [--games 10] [--seed 0] [--json]

The fastest player there is: it looks for .05 s, presses a column, slides as often as four times
towards what the ghost shows, presses deeper, and is at the next place .1 s later. So the rubber
never recovers, and the sensor is busy for minutes. Pointer, virtual orb, pipeline and Aim run in
one process; the window's own loop adds its latency.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.shared.protocol.messages import ContactState
from controller.simulator.virtual_orb import VirtualOrb
from host.actions import ACTIONS
from host.aim import Aim
from host.ui.pointer_input import PointerInput
from tetris.engine.game import Action, Game, Phase
from tetris.engine.modes import MODES

from .aim import Placement, choose, way, width_of
from .results import Results, command_line, say
from .tapping import RIM, TURN_DEG

TICK_HZ: Final = 120
FRAME_TICKS: Final = 3  # of the sensor
REST_S: Final = 3.0  # before the first touch
LOOK_S: Final = 0.05
SEEN_S: Final = 0.25  # from a landing until its ghost is known
SLID_S: Final = 0.3  # and from a slide
SLIDE_S: Final = 0.12
TWIST_S: Final = 0.3
ANSWER_S: Final = 0.7  # in which a twist turns the piece
DROP_S: Final = 0.3  # in which a deeper press drops it
AFTER_S: Final = 0.1  # from one touch to the next
TRIES: Final = 3  # of a twist, and of a drop
MOST_SLIDES: Final = 4
HAND_SIGMAS: Final = (0.1, 0.2)  # grid units: where a touch lands and a slide ends, across and up
COMMAND_COST: Final = 0.05  # of a command, in the choice of the place
SLIDE_BEYOND: Final = 0.8  # grid units beyond the outer taxels, to which a finger slides
LAND_BEYOND: Final = 0.4  # and beyond which none lands
PATIENCE_S: Final = 200.0
SHIPPED: Final = bundles.read(bundles.default_path())


class Player:
    """One game of forty lines, and what came of its pieces."""

    def __init__(self, seed: int) -> None:
        self._random = np.random.default_rng(seed)
        self._orb = VirtualOrb(seed, TICK_HZ / FRAME_TICKS)
        self._pipeline = Pipeline(SHIPPED.settings, Recognizer(SHIPPED), SHIPPED.mapping)
        self._touch, self._aim = PointerInput(light=True), Aim()
        self.game, self._ticks = Game(seed, MODES["sprint"].config()), 0
        self.pieces = self.right = self.failed = self.slides = self.turns = self.missed = 0
        self._wait(REST_S)

    @property
    def now_s(self) -> float:
        return self._ticks / TICK_HZ

    def play(self) -> None:
        """Play until the goal, the end, or no patience is left."""
        while self.game.phase is not Phase.OVER and self.now_s < PATIENCE_S:
            self._piece()

    def _wait(self, seconds: float) -> None:
        for _ in range(max(1, round(seconds * TICK_HZ))):
            self._ticks += 1
            if (contacts := self._touch.update(self.now_s)) is not None:
                self._orb.touch(contacts.contacts, self.now_s)
            if self._ticks % FRAME_TICKS == 0:
                self._scan()
            self.game.update(self.now_s, [])

    def _scan(self) -> None:
        step = self._pipeline.step(self._orb.read(self.now_s), self.now_s)
        touch = ContactState(0, **(asdict(step.contact) if step.contact else {}))
        self.game.update(self.now_s, self._aim.touch(touch, self.now_s, self.game))
        if step.command is not None and step.command.command in ACTIONS:
            located = len(SHIPPED.mapping.rules[step.command.gesture]) > 1
            action = ACTIONS[step.command.command]
            done = self._aim.command(action, located, self.now_s, self.game)
            self.game.update(self.now_s, done)

    def _piece(self) -> None:
        game, lines = self.game, self.game.lines
        wanted = choose(game, COMMAND_COST)
        self._wait(LOOK_S)
        for action in wanted.turns:
            self._turn(action)
            self._wait(AFTER_S)
        self._place(wanted)
        self.pieces += 1
        landed = game.board.bits & wanted.landing.mask == wanted.landing.mask
        self.right += landed or game.lines > lines
        self._wait(AFTER_S)

    def _turn(self, action: Action) -> None:
        """Twist on the rim, again if it is not understood."""
        before = self.game.piece.turn
        for _ in range(TRIES):
            self.turns += 1
            self._twist(1 if action is Action.ROTATE_CCW else -1)
            if self._until(ANSWER_S, lambda: self.game.piece.turn != before):
                return
            self.missed += 1

    def _twist(self, sense: int) -> None:
        angle = self._random.uniform(0.0, math.tau)
        for share in np.linspace(0.0, 1.0, round(TWIST_S * TICK_HZ)):
            now = angle + sense * math.radians(TURN_DEG) * share
            place = 2.0 + RIM * math.cos(now), 2.0 + RIM * math.sin(now)
            if share == 0.0:
                self._touch.press(*place, self.now_s)
            self._touch.move(*place)
            self._wait(1 / TICK_HZ)
        self._touch.release()

    def _place(self, wanted: Placement) -> None:
        """Press a column, slide to what the ghost lacks, press deeper and lift."""
        game, placed = self.game, self.game.pieces_placed
        column, (across, up) = 4.0 / game.config.columns, self._random.normal(0.0, HAND_SIGMAS)
        x = (wanted.left + width_of(game.piece) / 2) * column + across
        x, y = min(4.0 + LAND_BEYOND, max(-LAND_BEYOND, x)), 2.0 + up
        self._touch.press(x, y, self.now_s)
        self._wait(SEEN_S)
        for _ in range(MOST_SLIDES):
            away = wanted.left - min(at for at, _ in game.piece.cells)
            if not away or game.pieces_placed != placed:
                break
            self.slides += 1
            there = x + column * way(away) + self._random.normal(0.0, HAND_SIGMAS[0])
            there = min(4.0 + SLIDE_BEYOND, max(-SLIDE_BEYOND, there))
            for share in np.linspace(0.0, 1.0, round(SLIDE_S * TICK_HZ)):
                self._touch.move(x + (there - x) * share, y)
                self._wait(1 / TICK_HZ)
            x = there
            self._wait(SLID_S)
        for _ in self._tries(placed):
            self._touch.deepen(self.now_s)
            self.failed += not self._until(DROP_S, lambda: game.pieces_placed != placed)
        self._touch.release()

    def _tries(self, placed: int) -> Iterator[int]:
        for number in range(TRIES):
            if self.game.pieces_placed == placed and self.game.phase is not Phase.OVER:
                yield number

    def _until(self, seconds: float, reached: Callable[[], bool]) -> bool:
        for _ in range(round(seconds * TICK_HZ)):
            if reached():
                return True
            self._wait(1 / TICK_HZ)
        return reached()


def main() -> None:
    arguments = command_line(__doc__, games=10, seed=0).parse_args()
    results, players = Results("forty"), []
    for seed in range(arguments.seed, arguments.seed + arguments.games):
        player = Player(seed)
        player.play()
        players.append(player)
        say(f"{seed}: {player.game.lines} lines in {player.now_s - REST_S:.0f} s")

    def total(name: str) -> int:
        return sum(getattr(player, name) for player in players)

    pieces, seconds = total("pieces"), sum(player.now_s - REST_S for player in players)
    won = [player for player in players if player.game.lines >= 40]
    results.note("forty", len(won) / len(players), "1", goal=1.0)
    if won:
        times = [player.now_s - REST_S for player in won]
        results.note("forty_time", float(np.median(times)), "s", goal=150.0)
    lines = sum(player.game.lines for player in players)
    results.note("lines_per_min", 60 * lines / seconds, "1/min")
    results.note("places_right", total("right") / pieces, "1")
    results.note("slides_per_piece", total("slides") / pieces, "1")
    results.note("drops_failed", total("failed") / pieces, "1")
    results.note("twists_missed", total("missed") / max(1, total("turns")), "1")
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
