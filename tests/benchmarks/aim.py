"""Pieces a minute by Aim, and columns that are right: a simulated hand that sees the ghost late.

    python -m tests.benchmarks.aim [--games 8] [--minutes 4] [--touches-hz 2.5] [--orb] [--json]

The greedy bot chooses the places; a turn is a twist, an aimed drop one touch that counts two, a
drop where the piece already is a pinch. Before each piece the player looks, as in the demo. The
hand lands with a deviation of 2 mm on each axis, sees the ghost .2 s late, slides at most twice,
each time with that deviation, and then presses deeper; what it corrects takes time on top. Depth
and place are estimated with the errors of `ERRORS`; with `--orb` by the shipped bundle, from the
frames of virtual orbs, whose own quick hand makes the twists and pinches. `buttons` is the same
player with a command for each step.
"""

import math
import random
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Final, Protocol

from controller.bundles import bundle as bundles
from controller.bundles.inference.networks import Recognizer
from controller.recognition.contact import SLOW_S
from controller.recognition.pipeline import Pipeline
from controller.shared.protocol.messages import Contact, ContactState
from controller.simulator.orb import PRESETS
from controller.simulator.virtual_orb import VirtualOrb
from host.actions import ACTIONS
from host.aim import FINE, HYSTERESIS, Aim
from host.demo.autoplayer import COMMAND_OF, FIRST_S, LOOK_S, MANUAL, MIDDLE
from host.demo.demo import PACE
from host.ui.pointer_input import FINGER_RADIUS_MM
from tetris.bots import greedy
from tetris.engine import moves
from tetris.engine.events import Locked
from tetris.engine.game import Action, Game, Phase
from tetris.engine.pieces import Piece

from .results import Results, command_line

PITCH_MM: Final = 10.0
FRAME_S: Final = 1 / 40
HAND_MM: Final = 2.0  # where a touch lands and a slide ends, each axis
SEEN_S: Final = 0.2  # from the ghost to the hand
BEYOND_MM: Final = 8.0  # the outer taxels, to which a finger slides
RAMP_S: Final = 0.08  # of a landing and a lift
SLIDE_S: Final = 0.15
DEEPER_S, DEEPER_MM = 0.1, 6.0
PATIENCE_S: Final = 0.2  # so much longer the finger waits for the drop
CORRECTIONS: Final = 2
LATE_S: Final = 0.5  # after a gesture of the orb's hand, until which it may be answered
TRIES: Final = 3
SHIPPED: Final = bundles.read(bundles.default_path())
DOMAIN: Final = 9  # of the virtual orbs' seeds
DEPTHS_MM: Final = (4.0, 8.0)  # of a hand that aims lightly, to press deeper
GOALS: Final = {"nominal": (2.0, 45.0, 0.99), "paper-snr": (None, 25.0, 0.95)}
TURNS: Final = ((), (Action.ROTATE_CW,), (Action.ROTATE_CCW,), (Action.ROTATE_CW,) * 2)


@dataclass(frozen=True, slots=True)
class Errors:
    """Deviations of the estimates: place held and moving, depth; mm."""

    held_mm: float
    moving_mm: float
    depth_mm: float


ERRORS: Final = {"nominal": Errors(0.8, 0.8, 0.6), "paper-snr": Errors(1.5, 3.0, 1.5)}


@dataclass
class Tally:
    """What happened in the games of one player."""

    pieces: int = 0
    right: int = 0
    commands: int = 0
    touches: int = 0  # an aimed drop is one
    aimed: int = 0
    corrections: int = 0
    seconds: float = 0.0


Finger = tuple[float, float, float]  # place and depth, mm
Given = tuple[Action, bool]  # by a command, and whether it is one of a located gesture
Seen = tuple[ContactState, Given | None]


class Eye(Protocol):
    """What the game is told of a hand, frame by frame."""

    def see(self, now_s: float, finger: Finger | None, moving: bool) -> Seen:
        """Return the contact and the command of the next frame."""
        ...

    def gesture(self, now_s: float, command: str) -> None:
        """Begin a gesture of several fingers."""
        ...

    def busy(self, now_s: float) -> bool:
        """Whether that gesture is under way or may still be answered."""
        ...


class Estimator:
    """Errors of a bias in each touch and of each frame, half of the variance each."""

    def __init__(self, errors: Errors, touch_s: float, source: random.Random) -> None:
        self._errors, self._touch_s, self._source = errors, touch_s, source
        self._bias: tuple[float, ...] = ()
        self._usual_mm: float | None = None  # mean depth of late
        self._due: tuple[float, Action] | None = None

    def see(self, now_s: float, finger: Finger | None, moving: bool) -> Seen:
        given = None
        if self._due and now_s >= self._due[0]:
            given, self._due = (self._due[1], False), None
        if finger is None:
            self._bias, self._usual_mm = (), None
            return ContactState(0), given
        self._bias = self._bias or self._draw(self._errors.held_mm)
        place_mm = self._errors.moving_mm if moving else self._errors.held_mm
        x, y, depth = map(sum, zip(finger, self._bias, self._draw(place_mm), strict=True))
        place = x / PITCH_MM, y / PITCH_MM
        usual_mm = depth if self._usual_mm is None else self._usual_mm
        self._usual_mm = usual_mm + (depth - usual_mm) * FRAME_S / (SLOW_S + FRAME_S)
        seen = ContactState(
            *(0, *place, place_mm / PITCH_MM, max(0.1, depth)),
            fingers=1,
            rise_mm=depth - self._usual_mm,
            rise_sigma=self._errors.depth_mm,
        )
        return seen, given

    def _draw(self, place_mm: float) -> tuple[float, ...]:
        deviations = (place_mm, place_mm, self._errors.depth_mm)
        return tuple(self._source.gauss(0.0, math.sqrt(0.5) * one) for one in deviations)

    def gesture(self, now_s: float, command: str) -> None:
        self._due = now_s + self._touch_s, ACTIONS[command]

    def busy(self, now_s: float) -> bool:
        return self._due is not None


class Orb:
    """A virtual orb and the shipped bundle."""

    def __init__(self, preset: str, seed: int) -> None:
        self._orb = VirtualOrb(seed, 1 / FRAME_S, DOMAIN, PRESETS[preset])
        self._orb.quick = True
        self._pipeline = Pipeline(SHIPPED.settings, Recognizer(SHIPPED), SHIPPED.mapping)
        self._touched, self._number, self._until_s = False, 0, 0.0

    def see(self, now_s: float, finger: Finger | None, moving: bool) -> Seen:
        if finger is not None:
            x, y, depth = finger
            contact = Contact(0, x / PITCH_MM, y / PITCH_MM, depth, FINGER_RADIUS_MM)
            self._orb.touch([contact], now_s - FRAME_S)
        elif self._touched:
            self._orb.touch([], now_s - FRAME_S)
        self._touched = finger is not None
        step = self._pipeline.step(self._orb.read(now_s), now_s)
        if any(truth.number == self._number for truth in self._orb.truths()):
            self._until_s = now_s + LATE_S
        given, fields = None, asdict(step.contact) if step.contact else {}
        if step.command is not None and step.command.command in ACTIONS:
            self._until_s = 0.0
            located = len(SHIPPED.mapping.rules[step.command.gesture]) > 1
            given = ACTIONS[step.command.command], located
        return ContactState(0, **fields), given

    def gesture(self, now_s: float, command: str) -> None:
        self._number, self._until_s = self._number + 1, math.inf
        self._orb.perform(self._number, MANUAL[command][0], *MIDDLE, now_s)

    def busy(self, now_s: float) -> bool:
        return now_s < self._until_s


@dataclass(frozen=True, slots=True)
class Placement:
    """What the bot wants: turns, the left column after them, and the landing."""

    turns: tuple[Action, ...]
    left: int
    landing: Piece
    aimed: bool

    @property
    def cost(self) -> int:
        return len(self.turns) + 1 + self.aimed


def placements(game: Game) -> Iterator[Placement]:
    bits, table = game.board.bits, moves.TABLES[game.config.kicks]
    for turns in TURNS:
        piece: Piece | None = game.piece
        for action in turns:
            tests = piece.turned[table + (action is Action.ROTATE_CCW)] if piece else ()
            piece = next((one for one in tests if not bits & one.mask), None)
        if piece is None:
            continue
        for there in _along(bits, piece):
            left = min(x for x, _ in there.cells)
            yield Placement(turns, left, moves.landed(bits, there), there is not piece)


def _along(bits: int, piece: Piece) -> Iterator[Piece]:
    yield piece
    for side in ("left", "right"):
        there = getattr(piece, side)
        while not bits & there.mask:
            yield there
            there = getattr(there, side)


def choose(game: Game, cost: float) -> Placement:
    def worth(one: Placement) -> float:
        return greedy.value(game.board.bits, one.landing, game.config) - cost * one.cost

    return max(placements(game), key=worth)


class Hand:
    """Plays one game by Aim."""

    def __init__(self, seed: int, eye: Eye, touch_s: float, tally: Tally) -> None:
        self._random, self._eye = random.Random(f"aim {seed}"), eye
        self.game, self._aim = Game(seed, PACE), Aim()
        self._touch_s, self._tally = touch_s, tally
        self._landed: list[Piece] = []
        self.now_s = 0.0
        self._update([])
        self._wait(FIRST_S)

    def _update(self, actions: list[Action]) -> None:
        for event in self.game.update(self.now_s, actions):
            if isinstance(event, Locked):
                self._landed.append(event.piece)

    def _frame(self, finger: Finger | None, moving: bool = False) -> None:
        self.now_s += FRAME_S
        touch, given = self._eye.see(self.now_s, finger, moving)
        self._update(self._aim.touch(touch, self.now_s, self.game))
        if given is not None:
            self._update(self._aim.command(*given, self.now_s, self.game))

    def _wait(self, seconds: float) -> None:
        for _ in range(round(seconds / FRAME_S)):
            self._frame(None)

    def _command(self, action: Action) -> None:
        """Make a gesture of several fingers, once more if it is not understood."""

        def state() -> tuple[int, int]:
            return self.game.piece.turn, self.game.pieces_placed

        for _ in range(TRIES):
            before, until_s = state(), self.now_s + self._touch_s
            self._eye.gesture(self.now_s, COMMAND_OF[action])
            while self._eye.busy(self.now_s) or self.now_s < until_s:
                self._frame(None)
            self._tally.commands += 1
            self._tally.touches += 1
            if state() != before:
                return

    def piece(self, cost: float) -> None:
        """Place one piece."""
        game, tally = self.game, self._tally
        if game.phase is Phase.OVER:
            self._update([Action.RESTART])
        began_s = self.now_s
        self._landed.clear()
        wanted = choose(game, cost)
        self._wait(self._random.uniform(*LOOK_S))
        for action in wanted.turns:
            self._command(action)
        if wanted.aimed:
            tally.aimed += 1
            self._aimed(wanted.left)
        else:
            self._command(Action.HARD_DROP)
        if not self._landed:  # pressed without a drop
            self._command(Action.HARD_DROP)
        tally.pieces += 1
        tally.right += {one.mask for one in self._landed} == {wanted.landing.mask}
        tally.seconds += self.now_s - began_s

    def _aimed(self, left: int) -> None:
        """Land on a column, correct what the ghost shows, press deeper and lift."""
        tally, source, placed = self._tally, self._random, self.game.pieces_placed
        tally.commands += 2
        tally.touches += 1
        began_s = self.now_s
        self._wait(self._touch_s / 2)  # the way to the dome
        column_mm = 4 * PITCH_MM / self.game.config.columns
        width = width_of(self.game.piece)
        x = (left + width / 2) * column_mm + source.gauss(0.0, HAND_MM)
        y = 2 * PITCH_MM + source.gauss(0.0, HAND_MM)
        depth = source.uniform(*DEPTHS_MM)
        self._move((x, x), y, (0.0, depth), RAMP_S)
        self._move((x, x), y, (depth, depth), SEEN_S)
        corrected_s = 0.0
        for _ in range(CORRECTIONS):
            away = left - min(column for column, _ in self.game.piece.cells)
            if not away or self.game.pieces_placed != placed:
                break
            tally.corrections += 1
            there = x + column_mm * way(away) + source.gauss(0.0, HAND_MM)
            there = max(-BEYOND_MM, min(4 * PITCH_MM + BEYOND_MM, there))
            self._move((x, there), y, (depth, depth), SLIDE_S)
            self._move((there, there), y, (depth, depth), SEEN_S)
            x, corrected_s = there, corrected_s + SLIDE_S + SEEN_S
        self._move((x, x), y, (depth, depth + DEEPER_MM), DEEPER_S)
        for _ in range(round(PATIENCE_S / FRAME_S)):
            if self.game.pieces_placed != placed:
                break
            self._move((x, x), y, (depth + DEEPER_MM,) * 2, FRAME_S)
        self._move((x, x), y, (depth + DEEPER_MM, 0.0), RAMP_S)
        self._wait(FRAME_S)
        self._wait(max(0.0, began_s + 2 * self._touch_s + corrected_s - self.now_s))

    def _move(
        self, xs: tuple[float, float], y: float, depths: tuple[float, float], seconds: float
    ) -> None:
        for number in range(1, round(seconds / FRAME_S) + 1):
            share = number * FRAME_S / seconds
            x, depth = (a + share * (b - a) for a, b in (xs, depths))
            self._frame((x, y, depth), xs[0] != xs[1])


def width_of(piece: Piece) -> int:
    columns = [x for x, _ in piece.cells]
    return max(columns) - min(columns) + 1


def way(away: int) -> float:
    """Return how far a finger slides for a piece's way, amid the places that give it; columns."""
    (near, slow), (far, _) = FINE
    long = abs(away) + HYSTERESIS
    if long <= slow:
        way = long * near / slow
    elif long < far:
        way = near + (long - slow) * (far - near) / (far - slow)
    else:
        way = long
    return math.copysign(way, away)


def by_buttons(seed: int, touch_s: float, pieces: int) -> Tally:
    """Play with a command for each step, turn and drop, none of which goes wrong."""
    tally, game = Tally(), Game(seed, PACE)
    source = random.Random(f"buttons {seed}")
    for _ in range(pieces):
        if game.phase is Phase.OVER:
            game.update(tally.seconds, [Action.RESTART])
        plan = greedy.plan(game, command_cost=1.0)
        tally.seconds += source.uniform(*LOOK_S)
        for action in plan.actions:
            tally.seconds += touch_s
            game.update(tally.seconds, [action])
        tally.commands += len(plan.actions)
        tally.pieces += 1
    return tally


def main() -> None:
    parser = command_line(__doc__, games=8, minutes=4.0, touches_hz=2.5, cost=1.0, orb=False)
    arguments = parser.parse_args()
    results, touch_s = Results("aim"), 1 / arguments.touches_hz
    for preset, errors in ERRORS.items():
        tally = Tally()
        for seed in range(arguments.games):
            source = random.Random(f"eye {seed}")
            eye = Orb(preset, seed) if arguments.orb else Estimator(errors, touch_s, source)
            hand = Hand(seed, eye, touch_s, tally)
            while hand.now_s < 60 * arguments.minutes:
                hand.piece(arguments.cost)
        commands, rate, right = GOALS[preset]
        note, count = results.note, tally.pieces
        note("commands_per_piece", tally.commands / count, "1", preset=preset, goal=commands)
        note("touches_per_piece", tally.touches / count, "1", preset=preset)
        note("pieces_per_min", 60 * count / tally.seconds, "1/min", preset=preset, goal=rate)
        note("columns_right", tally.right / count, "1", preset=preset, goal=right)
        note("corrections_per_aim", tally.corrections / tally.aimed, "1", preset=preset)
    played = by_buttons(0, touch_s, 1000)
    results.note("commands_per_piece", played.commands / played.pieces, preset="buttons")
    results.note("pieces_per_min", 60 * played.pieces / played.seconds, "1/min", preset="buttons")
    results.finish(arguments.json)


if __name__ == "__main__":
    main()
